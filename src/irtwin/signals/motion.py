"""A motion: one run's signals, conditioned and evenly sampled."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace

import numpy as np

from irtwin.signals.channels import Signals

# A joint stands still below this share of its fastest speed in the run, or below a speed that no task needs.
STILL_SHARE, STILL_SPEED = 0.005, 1e-3  # -, rad/s
_SLIP = 0.15  # s: no move is shorter
BRIEF = 0.05  # s: where all joints turn at once they stand that long, and do not pause


@dataclass(frozen=True)
class Motion(Signals):
    """What a robot of n joints did over N even samples: the channels of `Signals`, speeds and accelerations known.

    standing: (N, n) whether a joint stood still, as seen before any filter; payload_com: (3,) m in the flange frame.
    `cutoff` is that of the zero-phase filter that the signals went through, Hz; None for a planned motion.
    fast_torque: (N, n) what of torque that filter took and the wider one of the states leaves; None: nothing.
    A part knows the `whole` that it was cut from, and its first sample there: what depends on the past is computed
    over the whole.
    """

    dq: np.ndarray = field()
    ddq: np.ndarray = field()
    run: str = field(kw_only=True)
    standing: np.ndarray | None = field(default=None, kw_only=True)
    payload_mass: float = field(default=0.0, kw_only=True)  # kg
    payload_com: tuple[float, float, float] = field(default=(0.0, 0.0, 0.0), kw_only=True)
    cutoff: float | None = field(default=None, kw_only=True)
    fast_torque: np.ndarray | None = field(default=None, repr=False, compare=False, kw_only=True)
    whole: Motion | None = field(default=None, repr=False, compare=False, kw_only=True)
    start: int = field(default=0, compare=False, kw_only=True)

    @property
    def rate(self) -> float:
        """Samples per second, Hz."""
        return (len(self.time) - 1) / float(self.time[-1] - self.time[0])

    def pieces(self, size: int) -> Iterator[Motion]:
        """Yield the motion in consecutive parts of at most `size` samples."""
        for start in range(0, len(self.time), size):
            yield self.part(start, start + size)

    def part(self, start: int, stop: int) -> Motion:
        """Return samples start..stop (exclusive) as a motion of the same run."""
        return replace(self.rows(slice(start, stop)), whole=self.whole or self, start=self.start + start)

    def moved(self, time: np.ndarray, q: np.ndarray, dq: np.ndarray, ddq: np.ndarray) -> Motion:
        """Return another motion, (M,) and (M, n) each, of the same run and payload; nothing of it was measured."""
        return Motion(time, q, dq, ddq, run=self.run, payload_mass=self.payload_mass, payload_com=self.payload_com)


def trapezoid(time: np.ndarray) -> np.ndarray:
    """Return the weights of the trapezoidal rule, (N,) s."""
    steps = np.diff(time)
    return np.asarray((np.append(steps, 0.0) + np.insert(steps, 0, 0.0)) / 2)


def standstill(motion: Motion) -> np.ndarray:
    """Return where no joint moves, (N,) bool."""
    speed = np.abs(motion.dq)
    return ~moves(motion, (speed >= np.maximum(STILL_SPEED, STILL_SHARE * speed.max(axis=0))).any(axis=1))


def moves(motion: Motion, fast: np.ndarray) -> np.ndarray:
    """Return where joints are `fast` (N,) for a while, (N,) bool: one that slips as it comes to rest does not move."""
    lasting = fast.copy()
    for own in stretches(fast):
        lasting[own] = own.stop - own.start >= _SLIP * motion.rate
    return lasting


def pauses(motion: Motion) -> Iterator[Motion]:
    """Yield the parts of a motion in which no joint moves, but for brief ones."""
    least = max(3, round(BRIEF * motion.rate))
    return (motion.part(own.start, own.stop) for own in stretches(standstill(motion)) if own.stop - own.start >= least)


def stretches(where: np.ndarray) -> Iterator[slice]:
    """Yield the stretches of samples at which `where` (N,) is true, in order."""
    edges = np.flatnonzero(np.diff(where.astype(int), prepend=0, append=0)).tolist()
    return map(slice, edges[::2], edges[1::2])

"""A motion: one run's signals, conditioned and evenly sampled."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace

import numpy as np


@dataclass(frozen=True)
class Motion:
    """What a robot of n joints did over N even samples. Absent measurements are None.

    time: (N,) s; q, dq, ddq: (N, n) rad, rad/s, rad/s^2; torque: (N, n) N m on the joint side;
    current: (N, n) A; temperature: (N, n) degC; power: (N,) W; payload_com: (3,) m in the flange frame;
    standing: (N, n) whether a joint stood still, as seen before any filter.
    `cutoff` is that of the zero-phase filter that the signals went through, Hz; None for a planned motion.
    A part knows the `whole` that it was cut from, and its first sample there: what depends on the past is computed
    over the whole.
    """

    run: str
    time: np.ndarray
    q: np.ndarray
    dq: np.ndarray
    ddq: np.ndarray
    torque: np.ndarray | None = None
    current: np.ndarray | None = None
    temperature: np.ndarray | None = None
    power: np.ndarray | None = None
    standing: np.ndarray | None = None
    payload_mass: float = 0.0  # kg
    payload_com: tuple[float, float, float] = (0.0, 0.0, 0.0)
    cutoff: float | None = None
    whole: Motion | None = field(default=None, repr=False, compare=False)
    start: int = field(default=0, compare=False)

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

        def cut(signal: np.ndarray | None) -> np.ndarray | None:
            return None if signal is None else signal[start:stop]

        return replace(
            self,
            time=self.time[start:stop],
            q=self.q[start:stop],
            dq=self.dq[start:stop],
            ddq=self.ddq[start:stop],
            torque=cut(self.torque),
            current=cut(self.current),
            temperature=cut(self.temperature),
            power=cut(self.power),
            standing=cut(self.standing),
            whole=self.whole or self,
            start=self.start + start,
        )

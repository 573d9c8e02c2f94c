"""The energy of a run that lasts, worked out as its samples come: each stretch of it once, with its surroundings.

A stretch is conditioned together with as much before and after it as the filter and the effects reach, so the sums are
those of the whole run at once but for rounding at the seams. What is known trails the newest sample by half the
filter's kernel.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from irtwin.signals.channels import Signals, from_columns
from irtwin.signals.conditioning import choose_cutoff, condition
from irtwin.signals.filter import kernel
from irtwin.signals.holes import HOLE
from irtwin.signals.log import Run, run_of
from irtwin.signals.motion import Motion
from irtwin.signals.samples import FEWEST
from irtwin.signals.sampling import holes, interval
from irtwin.twin.twin import Twin

_SEAM = 16  # samples on either side for the splines that differentiate; their ends are forgotten by a third a sample
_SHORTEST = 1e-5  # s between even times: closer stamps are no robot's, and would make a filter of millions of samples
_MEMORY = 30.0  # s that effects with memory are given of what went before


@dataclass(frozen=True)
class WatchedStretch:
    """Some samples of a run as conditioned, and what its twin says of them; the first is the last of the one before.

    torque: (N, n) N m, as a measurement would show it; power: (N,) W; residual: measured less modelled, (N, n) N m and
    (N,) W, None where that was not measured.
    """

    motion: Motion
    torque: np.ndarray
    power: np.ndarray
    torque_residual: np.ndarray | None
    power_residual: np.ndarray | None
    begins: bool  # nothing of the run goes before it without a hole


class EnergySoFar:
    """What a run took, from its samples: energies in J, powers in W, times in s.

    `seconds` were worked out; `measured` is None where power was not said throughout. Without a twin it sums the
    measured power alone. `ledger`: J by effect and joint, None for the whole robot.
    """

    def __init__(
        self,
        joints: tuple[str, ...],
        twin: Twin | None = None,
        *,
        name: str = "live",
        payload: float = 0.0,
        payload_com: tuple[float, float, float] = (0.0, 0.0, 0.0),
    ) -> None:
        """Take the robot's joints, base to flange, and what its flange carries: kg, and m in the flange's frame."""
        self.seconds = self.modelled = self.returned = 0.0
        self.peak = -np.inf
        self.ledger: dict[tuple[str, str | None], float] = {}
        self._joints, self._twin, self._name = joints, twin, name
        self._payload, self._payload_com = payload, payload_com
        self._cutoff = None if twin is None else twin.cutoff
        self._measured = 0.0
        self._measured_peak = -np.inf
        self._metered = True
        self._signals: Signals | None = None
        self._start = 0.0  # of the even times of the stretch without a hole that is under way
        self._step = np.nan  # between them, s; not known before there are enough samples
        self._done = 0  # the even time up to which all is worked out

    @property
    def measured(self) -> float | None:
        """The energy that was measured, J."""
        return self._measured if self._metered and self.seconds else None

    @property
    def peak_power(self) -> float:
        """The greatest power, W: measured where it is, else modelled."""
        return self._measured_peak if self.measured is not None else self.peak

    def feed(
        self, columns: dict[str, np.ndarray], *, last: bool = False, least: float = 0.0
    ) -> Iterator[WatchedStretch]:
        """Take the next samples, columns as of a log, (N,) each and NaN where not said; yield what is worked out.

        `last`: nothing follows. Less than `least` seconds wait for more. Where a hole in time is, one stretch ends.
        """
        if len(columns["time"]):
            for number, piece in enumerate(self._pieces(columns)):
                if number:
                    yield from self._work(0.0, to_the_end=True)
                    self._signals = None
                self._append(piece)
        yield from self._work(least, to_the_end=last)

    def _pieces(self, columns: dict[str, np.ndarray]) -> Iterator[dict[str, np.ndarray]]:
        """Yield samples between holes; the first goes on from what is held, be it nothing."""
        time = columns["time"]
        before = np.array([time[0] if self._signals is None else self._signals.time[-1]])
        steps = np.diff(time, prepend=before)
        usual = self._step if np.isfinite(self._step) else interval(time) if len(time) >= FEWEST else np.inf
        cuts = [0, *np.flatnonzero(steps > HOLE * usual).tolist(), len(time)]
        for start, stop in pairwise(cuts):
            yield {name: values[start:stop] for name, values in columns.items()}

    def _append(self, columns: dict[str, np.ndarray]) -> None:
        new = from_columns(columns, self._joints)
        if not len(new.time):
            return
        if self._signals is None:
            self._signals, self._start, self._done = new, float(new.time[0]), -1
            self._step = np.nan
        else:
            held = self._signals
            both = {field: np.concatenate([getattr(held, field), values]) for field, values in new.logged().items()}
            self._signals = Signals(**both)

    def _work(self, least: float, to_the_end: bool) -> Iterator[WatchedStretch]:
        if self._twin is None:
            return self._measure(to_the_end)
        if not self._paced():
            return
        held = self._signals
        assert held is not None
        newest = int((held.time[-1] - self._start) / self._step + 0.01)  # stamps are floats of 1e9 s
        half, back = self._reach(held)
        until = newest if to_the_end else newest - half
        begins = self._done < 0
        first = max(self._done, 0)
        if (until - first) * self._step < max(least, self._step):
            return
        low, high = max(0, first - back), min(newest, until + half)
        stretch = self._modelled(held, low, high, first, until, begins)
        self._done = until
        self._forget(until - back)
        self._add(stretch)
        yield stretch

    def _paced(self) -> bool:
        """Whether the step between samples is known; a hole among the first of them drops those before it."""
        held = self._signals
        if held is None:
            return False
        if np.isnan(self._step) and len(held.time) >= FEWEST:
            early = holes(held.time)
            if len(early):
                held = self._signals = held.rows(slice(int(early[-1]), None))
                self._start = float(held.time[0])
            if len(held.time) >= FEWEST:
                self._step = max(interval(held.time), _SHORTEST)
        return bool(np.isfinite(self._step))

    def _reach(self, held: Signals) -> tuple[int, int]:
        """Return how many even times after a stretch, and before it, bear on it."""
        assert self._twin is not None
        if self._cutoff is None:
            self._cutoff = choose_cutoff([self._run(held)])
        half = len(kernel(1 / self._step, self._cutoff)) // 2 + _SEAM
        memories = [effect.reach or _MEMORY for effect in self._twin.stack.effects if effect.memory]
        ahead = max((effect.reach or 0.0 for effect in self._twin.stack.effects if effect.memory), default=0.0)
        return half + round(ahead / self._step), half + round(max(memories, default=0.0) / self._step)

    def _modelled(self, held: Signals, low: int, high: int, first: int, until: int, begins: bool) -> WatchedStretch:
        assert self._twin is not None
        time = self._start + self._step * np.arange(low, high + 1)
        near = (held.time >= time[0] - 8 * self._step) & (held.time <= time[-1] + 8 * self._step)
        whole = condition(self._run(held.rows(near)), self._twin.robot, self._cutoff, time)
        motion = whole.part(first - low, until - low + 1)
        torque, power = self._twin.torque(motion), self._twin.power(motion)
        shown = self._twin.measured_torque(motion)
        return WatchedStretch(
            motion=motion,
            torque=torque,
            power=power,
            torque_residual=None if shown is None else shown - torque,
            power_residual=None if motion.power is None else motion.power - power,
            begins=begins,
        )

    def _run(self, signals: Signals) -> Run:
        """Return signals as a run; a channel that was not said throughout is none."""
        lacking = {name: None for name, values in signals.logged().items() if np.isnan(values).any()}
        whole = Signals(**{**signals.logged(), **lacking})  # type: ignore[arg-type]
        return run_of(self._name, whole, role="live", payload_mass=self._payload, payload_com=self._payload_com)

    def _add(self, stretch: WatchedStretch) -> None:
        assert self._twin is not None
        motion, time = stretch.motion, stretch.motion.time
        self.seconds += float(time[-1] - time[0])
        self.modelled += float(np.trapezoid(stretch.power, time))
        self.peak = max(self.peak, float(stretch.power.max()))
        self._meter(motion.power, time)
        self.returned += self._twin.returned_energy(motion)
        for entry in self._twin.ledger(motion):
            key = (entry.effect, entry.joint)
            self.ledger[key] = self.ledger.get(key, 0.0) + entry.energy

    def _meter(self, power: np.ndarray | None, time: np.ndarray) -> None:
        if power is None:
            self._metered = False
        else:
            self._measured += float(np.trapezoid(power, time))
            self._measured_peak = max(self._measured_peak, float(power.max()))

    def _measure(self, to_the_end: bool) -> None:
        """Sum the measured power as it was said: there is no twin to compare it with."""
        held = self._signals
        if held is None or len(held.time) < 2 or not (self._paced() or to_the_end):
            return
        is_whole = held.power is not None and not np.isnan(held.power).any()
        self.seconds += float(held.time[-1] - held.time[0])
        self._meter(held.power if is_whole else None, held.time)
        self._signals = held.rows(slice(-1, None))

    def _forget(self, place: int) -> None:
        """Drop the samples before an even time that nothing ahead reaches."""
        assert self._signals is not None
        old = self._start + self._step * (place - 2 * _SEAM)
        self._signals = self._signals.rows(self._signals.time >= old)

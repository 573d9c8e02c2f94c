"""Disturbances: what differs between two runs of one motion, located, described and weighed against the noise."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from irtwin.effects.effect import Quantity, force_unit, quantity
from irtwin.gap.data.case import Case
from irtwin.gap.data.differences import Pair, pairs_of
from irtwin.gap.data.noise_floor import sensor_noise
from irtwin.gap.repeats.lines import Line, lines
from irtwin.gap.repeats.series import EvenSeries, following
from irtwin.gap.repeats.slow import creep, from_start, slow
from irtwin.gap.repeats.switching import Switching, Watched, switching
from irtwin.gap.thresholds import Matters
from irtwin.signals.filter import low_pass
from irtwin.signals.log import Run
from irtwin.signals.motion import Motion
from irtwin.signals.sampling import interpolated

LINE, BAND, SWITCHING, OFFSET, DRIFT = "line", "band", "switching", "offset", "drift"

Located = tuple[str, tuple[Quantity, ...], float, float, Any]
"""Kind, quantities, size, p and shape of a disturbance."""


@dataclass(frozen=True)
class Disturbance:
    """What differs between repeats: `channel`, `joint` (None: the whole robot), and its `kind`.

    `size`: its mean square in one run, in the channel's unit squared; `share`: that of all that differs. `p`: adjusted
    for all channels and frequencies. `shape`: of a line its `Line`, of switching its `Switching`.
    """

    channel: str
    joint: str | None
    kind: str
    quantities: tuple[Quantity, ...]
    size: float
    share: float
    p: float
    shape: Any = field(default=None, repr=False)


def disturbances(case: Case) -> list[Disturbance]:
    """Return what differs between repeats beyond noise and beyond what follows the motion, the largest share first."""
    runs = {run.name: run for run in case.runs}
    pairs = pairs_of(case.runs, case.motions, case.thresholds.data)
    measured = [run for run in case.runs if run.role != "simulated"]
    torque_noise, power_noise = sensor_noise(measured, case.motions, case.thresholds.data)
    by_torque = [pair for pair in pairs if pair.difference("torque") is not None]
    by_power = [pair for pair in pairs if pair.difference("power") is not None]
    channels: list[_Channel] = []
    if by_torque:
        raw = {name: _torque(case, runs[name], case.motions[name]) for pair in by_torque for name in _names(pair)}
        noise = np.zeros(len(case.robot.joints)) if torque_noise is None else torque_noise
        for k, joint in enumerate(case.robot.joints):
            series = [_of_joint(pair, raw, k) for pair in by_torque]
            channels.append(_Channel("torque", joint.name, force_unit(joint), series, by_torque, float(noise[k])))
    if by_power:
        series, load = _of_power(by_power, runs)
        meter = 0.0 if power_noise is None else float(power_noise[0])
        channels.append(_Channel("power", None, "W", series, by_power, meter, load))
    differing = [
        disturbance
        for channel in channels
        for disturbance in channel.disturbances(len(channels), case.thresholds.matters)
    ]
    return sorted(differing, key=lambda disturbance: -disturbance.share)


@dataclass(frozen=True)
class _Channel:
    """One channel's differences, `series` of `pairs` of runs; `noise`: its sensor's, in the band."""

    name: str
    joint: str | None
    unit: str
    series: Sequence[EvenSeries]
    pairs: Sequence[Pair]
    noise: float
    load: Switching | None = None

    def disturbances(self, tests: int, limits: Matters) -> list[Disturbance]:
        """Return what matters beside what else differs, and the noise; the channel is one of `tests`."""
        peaks, left = lines(self.series, tests)
        parts = [_in_band(own.left(), pair) for own, pair in zip(left, self.pairs, strict=True)]
        rest = float(np.mean(parts)) / 2
        located: list[Located] = []
        if (load := self.load) is not None:
            located.append((SWITCHING, _load(load), load.level**2 * load.duty * (1 - load.duty), 0.0, load))
        for line in peaks:
            kind = LINE if line.purity > 0.5 else BAND
            located.append((kind, self._wave(line), line.size, line.p, line))
        located += self._slow(left, tests)
        spread = float(np.mean([np.var(difference.values) for difference in self.series])) / 2
        whole = max(spread, rest + sum(place[2] for place in located))
        return [
            Disturbance(self.name, self.joint, kind, quantities, size, float(min(size / whole, 1.0)), p, shape)
            for kind, quantities, size, p, shape in located
            if size >= max(limits.floors**2 * max(rest, self.noise**2), limits.share * whole)
        ]

    def _wave(self, line: Line) -> tuple[Quantity, ...]:
        return (
            quantity("f", self.joint, line.frequency, "Hz", line.error),
            Quantity("A", self.joint, line.amplitude, self.unit, *line.interval),
        )

    def _slow(self, series: Sequence[EvenSeries], tests: int) -> list[Located]:
        """Return the drift and the offset between runs; what drifts is held against the offset that it began with."""
        drift = self._most(DRIFT, f"{self.unit}/s", [slow(difference)[1] for difference in series], tests)
        flat = [from_start(difference) for difference in series] if drift else series
        return drift + self._most(OFFSET, self.unit, [slow(difference)[0] for difference in flat], tests)

    def _most(self, kind: str, unit: str, values: Sequence[np.ndarray], tests: int) -> list[Located]:
        """Return the largest of some values that say more than they cost, one for either kind, channel and pair."""
        cost = 2 * tests * sum(len(difference.values) for difference in self.series)
        sure = [estimate for estimate in values if estimate[2] * cost <= 1]
        if not sure:
            return []
        value, deviation, p, _ = max(sure, key=lambda estimate: estimate[3]).tolist()
        size = float(sum(estimate[3] for estimate in sure)) / len(values)
        return [(kind, (quantity(kind, self.joint, value, unit, deviation),), size, p, None)]


def _names(pair: Pair) -> tuple[str, str]:
    return pair.first.run, pair.second.run


def _torque(case: Case, run: Run, motion: Motion) -> np.ndarray:
    """Return the torque as logged, not filtered, at the motion's times, (N, n) N m."""
    signals, constants = run.signals, [joint.torque_constant for joint in case.robot.joints]
    values = signals.torque
    if values is None and signals.current is not None and None not in constants:
        values = signals.current * np.array(constants, dtype=float)
    assert values is not None
    return interpolated(signals.time, values, motion.time)


def _of_joint(pair: Pair, raw: Mapping[str, np.ndarray], joint: int) -> EvenSeries:
    """Return what two runs differ by in a joint's torque, beside what follows its motion."""
    values = pair.of(*(raw[name][:, joint] for name in _names(pair)))
    return EvenSeries(pair.time, values, following(pair.first, joint)[pair.inside]).tamed()


def _of_power(pairs: Sequence[Pair], runs: Mapping[str, Run]) -> tuple[list[EvenSeries], Switching | None]:
    """Return what two runs differ by in power, beside what the motion may and a drift, and the load that switches."""
    motions = {motion.run: motion for pair in pairs for motion in (pair.first, pair.second)}
    by_torque = all(motion.torque is not None for motion in motions.values())  # the same columns in all of them
    own = {name: _of_run(runs[name], motion, by_torque) for name, motion in motions.items()}
    watched = [_watched(pair, own) for pair in pairs]
    load = switching(watched, own)
    series = [pair.difference for pair in watched]
    if load is not None:
        apart = [pair.of(*(load.states[name] for name in _names(pair))) for pair in pairs]
        series = [difference.with_columns(column) for difference, column in zip(series, apart, strict=True)]
    return [creep(difference, pair.squares).tamed() for difference, pair in zip(series, watched, strict=True)], load


def _watched(pair: Pair, runs: Mapping[str, EvenSeries]) -> Watched:
    """Return the power of two runs, beside what their motion may take of their difference, and of their sum."""
    first, second = (runs[name].values for name in _names(pair))
    time, inside, torque = pair.time, pair.inside, pair.first.torque
    dq, squares = pair.first.dq[inside], None if torque is None else torque[inside] ** 2
    slow = [np.ones_like(time), time - time.mean()]
    beside = [*slow, *np.abs(dq).T, *(dq**2).T, *([] if squares is None else squares.T)]
    taken = [*slow, runs[pair.first.run].beside[inside]]
    apart, total = pair.of(first, second), pair.of(first, -second)
    return Watched(
        _names(pair), pair.shift, EvenSeries(time, apart, np.column_stack(beside)),
        EvenSeries(time, total, np.column_stack(taken)), squares,
    )  # fmt: skip


def _of_run(run: Run, motion: Motion, by_torque: bool) -> EvenSeries:
    """Return a run's power as logged, at its motion's times, beside what that may take, and its torque if it counts."""
    assert run.signals.power is not None
    values = interpolated(run.signals.time, run.signals.power, motion.time)
    beside = [np.ones(len(motion.time)), *np.abs(motion.dq).T, *(motion.dq**2).T]
    if by_torque and motion.torque is not None:
        beside += [*(motion.torque * motion.dq).T, *(motion.torque**2).T]
    else:
        beside += [*(motion.dq * motion.ddq).T, *(motion.ddq**2).T, *(motion.dq * np.cos(motion.q)).T]
    return EvenSeries(motion.time, values, np.column_stack(beside))


def _in_band(left: np.ndarray, pair: Pair) -> float:
    """Return the mean square of what is left of a difference, in the band of the motion's filter."""
    motion = pair.first
    return float(np.mean((low_pass(left, motion.rate, motion.cutoff) if motion.cutoff else left) ** 2))


def _load(load: Switching) -> tuple[Quantity, ...]:
    """Return what a load that switches takes, the share of time that it is on, and how long a period is."""
    periods, level = load.periods, quantity("P", None, load.level, "W", load.deviation)
    duty = Quantity("duty", None, load.duty, "1")
    if not periods:
        return level, duty
    ends = (min(periods), max(periods)) if len(periods) > 1 else (None, None)
    return level, duty, Quantity("period", None, float(np.median(periods)), "s", *ends)

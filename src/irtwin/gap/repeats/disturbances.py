"""Disturbances: what differs between two runs of one motion, located, described and weighed against the noise."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from scipy.interpolate import make_interp_spline
from scipy.stats import norm

from irtwin.effects.effect import Quantity
from irtwin.gap.data.case import Case
from irtwin.gap.data.differences import Pair, pairs_of
from irtwin.gap.data.noise_floor import sensor_noise
from irtwin.gap.repeats.creep import creep
from irtwin.gap.repeats.lines import Line, lines
from irtwin.gap.repeats.series import Series
from irtwin.gap.repeats.slow import slow
from irtwin.gap.repeats.switching import Switching, Watched, switching
from irtwin.gap.thresholds import NotRepeating
from irtwin.signals.filter import low_pass
from irtwin.signals.log import Run
from irtwin.signals.motion import Motion

LINE, BAND, SWITCHING, OFFSET, DRIFT = "line", "band", "switching", "offset", "drift"
_SLOW_SPEED = 0.02  # rad/s, across which friction changes its sign
_NORMAL = 1.96

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
    limits, runs = case.thresholds.not_repeating, {run.name: run for run in case.runs}
    pairs = pairs_of(case.runs, case.motions, case.thresholds.repeats)
    measured = [run for run in case.runs if run.role != "simulated"]
    torque_noise, power_noise = sensor_noise(measured, case.motions, case.thresholds.repeats)
    found: list[Disturbance] = []
    by_torque = [pair for pair in pairs if pair.difference("torque") is not None]
    by_power = [pair for pair in pairs if pair.difference("power") is not None]
    tests = (len(case.robot.joints) if by_torque else 0) + (1 if by_power else 0)
    if by_torque:
        raw = {name: _torque(case, runs[name], case.motions[name]) for pair in by_torque for name in _names(pair)}
        for joint, name in enumerate(case.robot.joint_names):
            series = [_of_joint(pair, raw, joint) for pair in by_torque]
            noise = 0.0 if torque_noise is None else float(torque_noise[joint])
            unit = "N" if case.robot.joints[joint].kind == "prismatic" else "N m"
            found += _of("torque", name, unit, series, by_torque, noise, tests, limits, None)
    if by_power:
        series, load = _of_power(case, by_power, runs)
        noise = 0.0 if power_noise is None else float(power_noise[0])
        found += _of("power", None, "W", series, by_power, noise, tests, limits, load)
    return sorted(found, key=lambda one: -one.share)


def _names(pair: Pair) -> tuple[str, str]:
    return pair.first.run, pair.second.run


def _torque(case: Case, run: Run, motion: Motion) -> np.ndarray:
    """Return the torque as logged, not filtered, at the motion's times, (N, n) N m."""
    signals, constants = run.signals, [joint.torque_constant for joint in case.robot.joints]
    values = signals.torque
    if values is None and signals.current is not None and None not in constants:
        values = signals.current * np.array(constants, dtype=float)
    assert values is not None
    return np.asarray(make_interp_spline(signals.time, values, k=1)(motion.time))


def _of_joint(pair: Pair, raw: Mapping[str, np.ndarray], joint: int) -> Series:
    """Return what two runs differ by in a joint's torque, beside what follows its motion: friction, inertia.

    The torque itself is not among the columns: it holds the disturbance.
    """
    motion, inside, time = pair.first, pair.inside, pair.time
    dq, ddq = motion.dq[inside, joint], motion.ddq[inside, joint]
    beside = [np.ones_like(time), time - time.mean(), dq, np.tanh(dq / _SLOW_SPEED), ddq]
    values = pair.of(*(raw[name][:, joint] for name in _names(pair)))
    return Series(time, values, np.column_stack(beside)).tamed()


def _of_power(case: Case, pairs: Sequence[Pair], runs: Mapping[str, Run]) -> tuple[list[Series], Switching | None]:
    """Return what two runs differ by in power, beside what the motion may and a drift, and the load that switches."""
    motions = {motion.run: motion for pair in pairs for motion in (pair.first, pair.second)}
    by_torque = all(motion.torque is not None for motion in motions.values())  # the same columns in all of them
    own = {name: _of_run(runs[name], motion, by_torque) for name, motion in motions.items()}
    watched = [_watched(pair, own) for pair in pairs]
    load = switching(watched, own, case.thresholds.not_repeating)
    found = [one.difference for one in watched]
    if load is not None:
        apart = [pair.of(*(load.states[name] for name in _names(pair))) for pair in pairs]
        found = [one.with_columns(column) for one, column in zip(found, apart, strict=True)]
    return [creep(one, each.squares).tamed() for one, each in zip(found, watched, strict=True)], load


def _watched(pair: Pair, runs: Mapping[str, Series]) -> Watched:
    """Return the power of two runs, beside what their motion may take of their difference, and of their sum."""
    first, second = (runs[name].values for name in _names(pair))
    time, inside, torque = pair.time, pair.inside, pair.first.torque
    dq, squares = pair.first.dq[inside], None if torque is None else torque[inside] ** 2
    slow = [np.ones_like(time), time - time.mean()]
    beside = [*slow, *np.abs(dq).T, *(dq**2).T, *([] if squares is None else squares.T)]
    taken = [*slow, runs[pair.first.run].beside[inside]]
    apart, total = pair.of(first, second), pair.of(first, -second)
    return Watched(
        _names(pair), pair.shift, Series(time, apart, np.column_stack(beside)),
        Series(time, total, np.column_stack(taken)), squares,
    )  # fmt: skip


def _of_run(run: Run, motion: Motion, by_torque: bool) -> Series:
    """Return a run's power as logged, at its motion's times, beside what that may take, and its torque if it counts."""
    assert run.signals.power is not None
    values = np.asarray(make_interp_spline(run.signals.time, run.signals.power, k=1)(motion.time))
    beside = [np.ones(len(motion.time)), *np.abs(motion.dq).T, *(motion.dq**2).T]
    if by_torque and motion.torque is not None:
        beside += [*(motion.torque * motion.dq).T, *(motion.torque**2).T]
    else:
        beside += [*(motion.dq * motion.ddq).T, *(motion.ddq**2).T, *(motion.dq * np.cos(motion.q)).T]
    return Series(motion.time, values, np.column_stack(beside))


def _of(
    channel: str,
    joint: str | None,
    unit: str,
    series: Sequence[Series],
    pairs: Sequence[Pair],
    noise: float,
    tests: int,
    limits: NotRepeating,
    load: Switching | None,
) -> list[Disturbance]:
    """Return the disturbances of one channel; noise: its sensor's, in the band."""
    found, left = lines(series, tests, limits)
    rest = [one.left() for one in left]
    rest_size = float(np.mean([_in_band(one, pair) for one, pair in zip(rest, pairs, strict=True)])) / 2
    spread = [float(np.mean((one.values - one.values.mean()) ** 2)) / 2 for one in series]
    least = max(rest_size, noise**2 * limits.least_noise**2 / limits.least_size)
    located: list[Located] = []
    if load is not None and load.level**2 * load.duty * (1 - load.duty) >= limits.least_size * least:
        located.append((SWITCHING, _load(load), load.level**2 * load.duty * (1 - load.duty), 0.0, load))
    for line in found:
        if line.size >= limits.least_size * least:
            kind = LINE if line.purity >= limits.pure else BAND
            located.append((kind, _wave(line, joint, unit), line.size, line.p, line))
    located += _slow(left, joint, unit, (rest_size, noise**2), tests, limits)
    whole = max(float(np.mean(spread)), rest_size + sum(each[2] for each in located))
    return [
        Disturbance(channel, joint, kind, quantities, size, float(min(size / whole, 1.0)), p, shape)
        for kind, quantities, size, p, shape in located
    ]


def _in_band(left: np.ndarray, pair: Pair) -> float:
    """Return the mean square of what is left of a difference, in the band of the motion's filter."""
    motion = pair.first
    return float(np.mean((low_pass(left, motion.rate, motion.cutoff) if motion.cutoff else left) ** 2))


def _load(load: Switching) -> tuple[Quantity, ...]:
    """Return what a load that switches takes, the share of time that it is on, and how long a period is."""
    half, periods = _NORMAL * load.deviation, load.periods
    level = Quantity("P", None, load.level, "W", load.level - half, load.level + half)
    duty = Quantity("duty", None, load.duty, "1")
    if not periods:
        return level, duty
    ends = (min(periods), max(periods)) if len(periods) > 1 else (None, None)
    return level, duty, Quantity("period", None, float(np.median(periods)), "s", *ends)


def _wave(line: Line, joint: str | None, unit: str) -> tuple[Quantity, ...]:
    half = _NORMAL * line.error
    return (
        Quantity("f", joint, line.frequency, "Hz", line.frequency - half, line.frequency + half),
        Quantity("A", joint, line.amplitude, unit, *line.interval),
    )


def _slow(
    series: Sequence[Series],
    joint: str | None,
    unit: str,
    sizes: tuple[float, float],
    tests: int,
    limits: NotRepeating,
) -> list[Located]:
    """Return the drift and the offset between runs: those of the pair of runs that shows most of either.

    What drifts is held against the offset that it began with. `sizes`: the mean squares of what else differs, and of
    the sensor's noise.
    """
    each, least, alpha = [slow(one) for one in series], limits.least_slow * max(sizes), limits.alpha / (2 * tests)
    drifts = [(one.drift, one.drift_deviation, one.p[1], one.sizes[1]) for one in each]
    found = _most(DRIFT, drifts, joint, f"{unit}/s", least, alpha)
    offsets = [(one.offset, one.offset_deviation, one.p[0], one.sizes[0]) for one in each]
    if found:
        began = [one.from_start() for one in each]
        offsets = [(value, by, 2 * float(norm.sf(abs(value) / max(by, 1e-300))), value**2 / 2) for value, by in began]
    return found + _most(OFFSET, offsets, joint, unit, least, alpha)


def _most(
    kind: str, each: Sequence[tuple[float, ...]], joint: str | None, unit: str, least: float, alpha: float
) -> list[Located]:
    """Return the largest of the values, deviations, p and sizes that are sure, where they matter together.

    alpha: the largest p, for all of them.
    """
    sure = [one for one in each if one[2] <= alpha / len(each)]
    together = sum(one[3] for one in sure) / len(each)
    if not sure or together < least:
        return []
    value, deviation, p, _ = max(sure, key=lambda one: one[3])
    half = _NORMAL * deviation
    return [(kind, (Quantity(kind, joint, value, unit, value - half, value + half),), together, p, None)]

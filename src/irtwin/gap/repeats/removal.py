"""Disturbances taken out: what an effect of the catalogue explains of what does not repeat, run by run.

No run tells another when it acts, so it is fitted in each run.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from irtwin.effects.catalogue import catalogue
from irtwin.effects.effect import Effect, Quantity, quantity
from irtwin.effects.stack import Stack
from irtwin.gap.data.case import Case
from irtwin.gap.regression.normal_equations import System, twin_values
from irtwin.gap.regression.residuals import as_filtered, torque_residual
from irtwin.gap.repeats.disturbances import LINE, SWITCHING, Disturbance
from irtwin.gap.repeats.series import correlation_samples, following, waves
from irtwin.signals.motion import Motion

_NO_MORE = 0.005  # mean square of a wave of one: the filter has taken nine tenths of it


@dataclass(frozen=True)
class Removed:
    """A disturbance that an `effect` explains: `parts`, what each run shows of it, (N,) N m or W, as filtered.

    `gain`: its part of the mean square of what differs, or of what the twin leaves.
    """

    disturbance: Disturbance
    effect: Effect
    quantities: tuple[Quantity, ...]
    parts: Mapping[str, np.ndarray]
    gain: float

    @property
    def joints(self) -> tuple[str, ...]:
        """The joint that it acts on; none for the whole robot."""
        return () if self.disturbance.joint is None else (self.disturbance.joint,)

    def mean_square(self, runs: Sequence[str]) -> float:
        """Return its mean square over some runs, 0 where it shows in none."""
        seen = [self.parts[run] for run in runs if run in self.parts]
        return float(np.mean(np.concatenate(seen) ** 2)) if seen else 0.0


def removed(
    case: Case, stack: Stack, plain: System | None, disturbances: Sequence[Disturbance]
) -> tuple[Case, list[Removed]]:
    """Return the case without the disturbances that effects explain, and these; `plain`: the twin's equations."""
    effects = {effect.disturbance: effect for effect in catalogue().values() if effect.disturbance}
    taken: list[Removed] = []
    if plain is not None:
        values = twin_values(plain, plain.solution((), plain.total(plain.noise_before)))
        steady = [
            disturbance for disturbance in disturbances if disturbance.kind == LINE and disturbance.channel == "torque"
        ]
        if steady:
            left = {motion.run: torque_residual(stack, motion, values) for motion in case.with_torque}
            for joint in dict.fromkeys(line.joint for line in steady):
                own = [line for line in steady if line.joint == joint]
                taken += _waves(case, effects[LINE], own, left)
    taken += [
        _load(case, effects[SWITCHING], disturbance) for disturbance in disturbances if disturbance.kind == SWITCHING
    ]
    return _without(case, taken), taken


def _waves(
    case: Case, effect: Effect, disturbances: Sequence[Disturbance], left: Mapping[str, np.ndarray]
) -> list[Removed]:
    """Return the waves of one joint's lines, fitted to what the twin leaves of each run, where it leaves anything."""
    joint = case.robot.index(str(disturbances[0].joint))
    fits = {m.run: _Fit(m, left[m.run][:, joint], joint, [line.shape.frequency for line in disturbances])
            for m in case.with_torque if np.isfinite(left[m.run][:, joint]).any()}  # fmt: skip
    if not (seen := [fit for run, fit in fits.items() if run in case.observed]):
        return []
    taken = []
    for k, line in enumerate(disturbances):
        fitted = replace(effect, f=line.shape.frequency, joints=(str(line.joint),))  # type: ignore[call-arg]
        amplitude = _amplitude(line, [fit.amplitude(k) for fit in seen])
        explained, before = np.sum([fit.squares(k) for fit in seen], axis=0)
        gain = min(float(explained) / max(float(before), 1e-300), 1.0)
        taken.append(Removed(line, fitted, amplitude, {run: fit.wave(k) for run, fit in fits.items()}, gain))
    return taken


def _amplitude(line: Disturbance, of_runs: Sequence[tuple[float, float]]) -> tuple[Quantity, ...]:
    """Return the line's frequency, and its amplitude over the runs where the filter lets it through."""
    amplitudes, deviations = np.array(of_runs).T
    if not np.isfinite(amplitudes).all():
        return line.quantities
    frequency, known = line.quantities
    value = float(np.sqrt(np.mean(amplitudes**2)))
    deviation = float(np.sqrt(np.sum(deviations**2))) / len(of_runs)
    return frequency, quantity(known.name, known.joint, value, known.unit, deviation, lambda end: max(end, 0.0))


class _Fit:
    """Waves in what the twin left of one joint in one run, beside what may follow the motion."""

    def __init__(self, motion: Motion, left: np.ndarray, joint: int, frequencies: Sequence[float]):
        """Fit waves of some frequencies, Hz, to what was left (N,), NaN where undecided."""
        seen = [as_filtered(motion, np.column_stack(waves(motion.time, frequency))) for frequency in frequencies]
        self._passed = [float(np.mean(wave**2)) > _NO_MORE for wave in seen]  # else the filter takes the wave away
        self._waves = [wave * passed for wave, passed in zip(seen, self._passed, strict=True)]
        known = np.isfinite(left)
        columns = np.column_stack([following(motion, joint), *self._waves])[known]
        values = np.linalg.lstsq(columns, left[known], rcond=1e-8)[0]
        self._values = values[-2 * len(seen) :].reshape(-1, 2)
        rest = left[known] - columns @ values
        self._known, self._before = known, float(np.sum(left[known] ** 2))
        self._variance = float(np.mean(rest**2)) * correlation_samples(rest) / len(rest)

    def wave(self, k: int) -> np.ndarray:
        """Return the k-th wave as the filter leaves it, (N,)."""
        return np.asarray(self._waves[k] @ self._values[k])

    def amplitude(self, k: int) -> tuple[float, float]:
        """Return the k-th wave's amplitude and its deviation; NaN where the filter takes it away."""
        if not self._passed[k]:
            return np.nan, np.nan
        power = float(np.mean(self._waves[k][self._known] ** 2))
        return float(np.linalg.norm(self._values[k])), float(np.sqrt(self._variance / power))

    def squares(self, k: int) -> tuple[float, float]:
        """Return the squares of the k-th wave, and those of what the twin left."""
        return float(np.sum(self.wave(k)[self._known] ** 2)), self._before


def _load(case: Case, effect: Effect, disturbance: Disturbance) -> Removed:
    """Return the load that switches, as the filter leaves it in each run."""
    load = disturbance.shape
    parts = {
        motion.run: as_filtered(motion, load.level * load.states[motion.run])
        for motion in case.with_power
        if motion.run in load.states
    }
    return Removed(disturbance, effect, disturbance.quantities, parts, float(load.explained))


def _without(case: Case, taken: Sequence[Removed]) -> Case:
    """Return the case with what was taken subtracted from its signals."""
    robot, given = case.given
    motions = {name: _less(case, motion, taken) for name, motion in case.motions.items()}
    return replace(case, motions=motions, given=(robot, {n: _less(case, m, taken) for n, m in given.items()}))


def _less(case: Case, motion: Motion, taken: Sequence[Removed]) -> Motion:
    torque, power = motion.torque, motion.power
    for removal in taken:
        part = removal.parts.get(motion.run)
        if part is None:
            continue
        if removal.disturbance.joint is None:
            power = None if power is None else power - part
        elif torque is not None:
            torque = torque.copy()
            torque[:, case.robot.index(removal.disturbance.joint)] -= part
    return replace(motion, torque=torque, power=power)

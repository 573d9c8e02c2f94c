"""Disturbances taken out: what an effect of the catalogue explains of what does not repeat, run by run.

No run tells another when it acts, so it is fitted in each run, and judged on stretches of time left out.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from irtwin.effects.catalogue import catalogue
from irtwin.effects.effect import Effect, Quantity
from irtwin.effects.stack import Stack
from irtwin.gap.data.case import Case
from irtwin.gap.regression.correlation import correlation_samples
from irtwin.gap.regression.moments import summed
from irtwin.gap.regression.normal_equations import System, noise_before, twin_values
from irtwin.gap.regression.residuals import as_filtered, torque_residual
from irtwin.gap.repeats.disturbances import LINE, SWITCHING, Disturbance
from irtwin.gap.repeats.series import waves
from irtwin.signals.motion import Motion

_STRETCHES = 8  # of a run, each left out in turn
_SLOW_SPEED = 0.02  # rad/s, across which friction changes its sign
_NORMAL = 1.96


@dataclass(frozen=True)
class Removed:
    """A disturbance that an `effect` explains: `parts`, what each run shows of it, (N,) N m or W, as filtered.

    `gain`: its part of the mean square of what the twin leaves, on stretches left out; `t` of it between these.
    """

    disturbance: Disturbance
    effect: Effect
    quantities: tuple[Quantity, ...]
    parts: Mapping[str, np.ndarray]
    gain: float
    t: float

    @property
    def joints(self) -> tuple[str, ...]:
        """The joint that it acts on; none for the whole robot."""
        return () if self.disturbance.joint is None else (self.disturbance.joint,)

    def mean_square(self, runs: Sequence[str]) -> float:
        """Return its mean square over some runs, 0 where it shows in none."""
        seen = [self.parts[run] for run in runs if run in self.parts]
        return float(np.mean(np.concatenate(seen) ** 2)) if seen else 0.0


def removed(case: Case, stack: Stack, plain: System | None, found: Sequence[Disturbance]) -> tuple[Case, list[Removed]]:
    """Return the case without the disturbances that effects explain, and these; `plain`: the twin's equations."""
    effects = {effect.disturbance: effect for effect in catalogue().values() if effect.disturbance}
    taken: list[Removed] = []
    if plain is not None:
        values = twin_values(plain, plain.solution((), summed(plain.moments(noise_before(plain)))))
        steady = [one for one in found if one.kind == LINE and one.channel == "torque"]
        if steady:
            left = {motion.run: torque_residual(stack, motion, values) for motion in case.with_torque}
            for joint in dict.fromkeys(one.joint for one in steady):
                own = [one for one in steady if one.joint == joint]
                taken += _waves(case, effects[LINE], own, left)
    taken += [_load(case, effects[SWITCHING], one) for one in found if one.kind == SWITCHING]
    return _without(case, taken), taken


def _waves(case: Case, effect: Effect, found: Sequence[Disturbance], left: Mapping[str, np.ndarray]) -> list[Removed]:
    """Return the waves of one joint's lines, fitted to what the twin leaves of each run."""
    joint = case.robot.index(str(found[0].joint))
    fits = {m.run: _Fit.of(m, left[m.run][:, joint], joint, [one.shape.frequency for one in found])
            for m in case.with_torque}  # fmt: skip
    seen = [fit for run, fit in fits.items() if run in case.observed]
    taken = []
    for k, one in enumerate(found):
        judged = [fit.judged(k) for fit in seen]
        before = np.concatenate([before for before, _ in judged])
        after = np.concatenate([after for _, after in judged])
        taken.append(
            Removed(
                one,
                replace(effect, f=one.shape.frequency, joints=(str(one.joint),)),  # type: ignore[call-arg]
                _amplitude(one, [fit.amplitude(k) for fit in seen]),
                {run: fit.wave(k) for run, fit in fits.items()},
                float(np.clip(1 - after.sum() / max(before.sum(), 1e-300), 0.0, 1.0)),
                _t(before - after),
            )
        )
    return taken


def _amplitude(one: Disturbance, each: Sequence[tuple[float, float]]) -> tuple[Quantity, ...]:
    """Return the line's frequency, and its amplitude over the runs where the filter lets it through."""
    amplitudes, deviations = np.array(each).T
    if not np.isfinite(amplitudes).all():
        return one.quantities
    frequency, known = one.quantities
    value = float(np.sqrt(np.mean(amplitudes**2)))
    half = _NORMAL * float(np.sqrt(np.sum(deviations**2))) / len(each)
    return frequency, Quantity(known.name, known.joint, value, known.unit, max(value - half, 0.0), value + half)


@dataclass(frozen=True)
class _Fit:
    """Waves in what the twin left of one joint in one run, beside what may follow the motion."""

    columns: np.ndarray  # (N, m), cosine and sine of each wave last
    left: np.ndarray  # (N,), NaN where undecided
    passed: np.ndarray  # (L,) whether the filter lets a wave through

    @classmethod
    def of(cls, motion: Motion, left: np.ndarray, joint: int, frequencies: Sequence[float]) -> _Fit:
        dq, ddq = motion.dq[:, joint], motion.ddq[:, joint]
        beside = [np.ones_like(dq), motion.time - motion.time.mean(), dq, np.tanh(dq / _SLOW_SPEED), ddq]
        seen = [as_filtered(motion, np.column_stack(waves(motion.time, one))) for one in frequencies]
        passed = np.array([float(np.mean(one**2)) > _NO_MORE for one in seen])
        return cls(np.column_stack([*beside, *(one * ok for one, ok in zip(seen, passed, strict=True))]), left, passed)

    def _values(self, kept: np.ndarray) -> np.ndarray:
        found: np.ndarray = np.linalg.lstsq(self.columns[kept], self.left[kept], rcond=1e-8)[0]
        return found

    def _own(self, k: int) -> slice:
        first = self.columns.shape[1] - 2 * len(self.passed) + 2 * k
        return slice(first, first + 2)

    def wave(self, k: int) -> np.ndarray:
        """Return the k-th wave as the filter leaves it, (N,)."""
        return np.asarray(self.columns[:, self._own(k)] @ self._values(np.isfinite(self.left))[self._own(k)])

    def amplitude(self, k: int) -> tuple[float, float]:
        """Return the k-th wave's amplitude and its deviation; NaN where the filter takes it away."""
        if not self.passed[k]:
            return np.nan, np.nan
        kept = np.isfinite(self.left)
        values = self._values(kept)
        rest = self.left[kept] - self.columns[kept] @ values
        memory = correlation_samples(rest)
        gain = 2 * float(np.mean(self.columns[kept][:, self._own(k)] ** 2))
        deviation = float(np.sqrt(2 * np.mean(rest**2) * memory / len(rest) / gain))
        return float(np.linalg.norm(values[self._own(k)])), deviation

    def judged(self, k: int) -> tuple[np.ndarray, np.ndarray]:
        """Return the squares in stretches without the k-th wave, and with it as fitted to the others, (S,) each."""
        known = np.isfinite(self.left)
        stretch = np.arange(len(known)) * _STRETCHES // len(known)
        before, after = np.zeros((2, _STRETCHES))
        for one in range(_STRETCHES):
            test = known & (stretch == one)
            values = self._values(known & (stretch != one))
            rest = self.left[test] - self.columns[test] @ values
            wave = self.columns[test][:, self._own(k)] @ values[self._own(k)]
            before[one], after[one] = float(np.sum((rest + wave) ** 2)), float(np.sum(rest**2))
        return before, after


_NO_MORE = 0.005  # mean square of a wave of one: the filter has taken nine tenths of it


def _load(case: Case, effect: Effect, one: Disturbance) -> Removed:
    """Return the load that switches, as the filter leaves it in each run."""
    load = one.shape
    parts = {
        motion.run: as_filtered(motion, load.level * load.states[motion.run])
        for motion in case.with_power
        if motion.run in load.states
    }
    return Removed(one, effect, one.quantities, parts, float(load.explained), load.level / max(load.deviation, 1e-12))


def _without(case: Case, taken: Sequence[Removed]) -> Case:
    """Return the case with what was taken subtracted from its signals."""
    robot, given = case.given
    motions = {name: _less(case, motion, taken) for name, motion in case.motions.items()}
    return replace(case, motions=motions, given=(robot, {n: _less(case, m, taken) for n, m in given.items()}))


def _less(case: Case, motion: Motion, taken: Sequence[Removed]) -> Motion:
    torque, power = motion.torque, motion.power
    for one in taken:
        part = one.parts.get(motion.run)
        if part is None:
            continue
        if one.disturbance.joint is None:
            power = None if power is None else power - part
        elif torque is not None:
            torque = torque.copy()
            torque[:, case.robot.index(one.disturbance.joint)] -= part
    return replace(motion, torque=torque, power=power)


def _t(gains: np.ndarray) -> float:
    root = np.sign(gains) * np.sqrt(np.abs(gains))
    return float(root.mean() / max(root.std(ddof=1) / np.sqrt(len(root)), 1e-12))

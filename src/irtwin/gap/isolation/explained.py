"""What the twin says a run takes: without the run, and with the causes found."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from irtwin.effects.effect import Predicted
from irtwin.effects.stack import Stack
from irtwin.gap.data.case import Case
from irtwin.gap.data.noise_floor import REPEATS, Floor, noise_floor
from irtwin.gap.isolation.cause import FoundCause
from irtwin.gap.isolation.finding import ChannelFinding
from irtwin.gap.regression.candidate_columns import Below
from irtwin.gap.regression.channel_equations import Torque
from irtwin.gap.regression.cross_fitted import PowerOf
from irtwin.gap.regression.residuals import as_filtered
from irtwin.signals.motion import Motion

_LOWER = 0.95  # of the floor: by less it may be lower by chance


class Explained:
    """What the causes found in a channel add to its signal, and what the twin is beside them."""

    def __init__(self, stack: Stack, finding: ChannelFinding, below: Below):
        """Take what a channel showed, and what candidates were built on: what the twin predicts `below` them."""
        self.stack, self.finding, self._below = stack, finding, below
        self._places = {k: place for place, k in enumerate(finding.used)}

    @property
    def values(self) -> np.ndarray:
        """(K,) the twin's coefficients."""
        return self.finding.estimate.values[: self.finding.system.base]

    def added(self, cause: FoundCause, whole: Motion, *, real: bool = False) -> np.ndarray:
        """Return what a cause adds over a whole run, (N, n) N m or (N,) W; `real` torque and power alone, or all."""
        robot, below = self.stack.robot, self._below(whole)
        total = np.zeros(whole.dq.shape if self.finding.name == "torque" else len(whole.time))
        for variant in cause.variants:
            if (real and variant.effect.channel == "measurement") or not variant.effect.acts_in(whole):
                continue
            columns = variant.effect.columns(robot, whole, below)
            for k in variant.columns:
                if k < self.finding.system.changed or whole.run in self.finding.observed:
                    total += self._column(columns, k) * self.finding.estimate.values[self._places[k]]
        return total

    def off(self, motion: Motion, power_of: PowerOf | None = None) -> Motion:
        """Return a run without what the causes add to its signal, and without what that takes of power, `power_of`.

        None: of power nothing is taken off for causes of torque.
        """
        if motion.power is None:
            return motion
        return replace(motion, power=motion.power - as_filtered(motion, self._all(motion)))

    def _all(self, whole: Motion, *, real: bool = False) -> np.ndarray:
        """Return what all causes add over a whole run, as `added` does."""
        return np.asarray(sum(self.added(cause, whole, real=real) for cause in self.finding.causes))

    def _column(self, columns: np.ndarray, k: int) -> np.ndarray:
        """Return the candidate column k of an effect's columns (..., m)."""
        own = self.finding.system.column(k)
        if own.index is not None:
            return np.asarray(columns[..., own.index])
        return np.asarray(columns @ np.array([term.expected for term in own.effect.terms(self.stack.robot)]))


class ExplainedTorque(Explained):
    """The joint torque of the twin refitted with the causes, and what each cause adds to the torque."""

    def __init__(self, stack: Stack, finding: ChannelFinding, below: Below):
        """Take what torque showed, and what candidates were built on."""
        super().__init__(stack, finding, below)
        self._held: tuple[str, np.ndarray] | None = None
        self._logged: tuple[str, np.ndarray] | None = None

    def __call__(self, motion: Motion) -> np.ndarray:
        """Return the real joint torque, (N, n) N m, of a run or a part of one."""
        whole = motion.whole or motion
        if self._held is None or self._held[0] != whole.run:
            torque, told = self.stack.borne_torque(whole, self.values), self.stack.told_by_log(whole)
            for cause in self.finding.causes:
                torque = torque + np.where(told, 0.0, self.added(cause, whole, real=True))
            self._held = whole.run, torque
        return self._held[1][motion.start : motion.start + len(motion.time)]

    def logged(self, motion: Motion) -> np.ndarray:
        """Return the real joint torque, (N, n) N m, as the log shows it, less what sensors add by the causes, too."""
        whole = motion.whole or motion
        if self._logged is None or self._logged[0] != whole.run:
            sensors = self._all(whole) - self._all(whole, real=True) if whole.torque is not None else 0.0
            real = self.stack.logged_torque(whole, self.values) if whole.torque is not None else self(whole)
            self._logged = whole.run, real - sensors
        return self._logged[1][motion.start : motion.start + len(motion.time)]

    def off(self, motion: Motion, power_of: PowerOf | None = None) -> Motion:
        """Return a run without the causes, as above."""
        torque = None if motion.torque is None else motion.torque - as_filtered(motion, self._all(motion))
        if power_of is None or motion.power is None:
            return replace(motion, torque=torque)
        whole = self(motion)
        taken = power_of(motion, whole)[0] - power_of(motion, whole - self._all(motion, real=True))[0]
        return replace(motion, torque=torque, power=motion.power - as_filtered(motion, taken))


def explained_power(stack: Stack, finding: ChannelFinding, torque: Torque, power_of: PowerOf) -> Explained:
    """Return what the causes found in power add to it, built on the joint torque and the power that it takes."""

    def below(whole: Motion) -> Predicted:
        taken = torque(whole)
        return Predicted(taken, *power_of(whole, taken))

    return Explained(stack, finding, below)


def floor_left(case: Case, floor: Floor, explained: Explained, power_of: PowerOf | None = None) -> Floor:
    """Return the floor that the causes of a channel leave; itself where that is no lower.

    A cause that acts in one run and not in its repeat, a payload for one, is in the difference of the two. `power_of`
    says what joint torque takes; None: causes of torque leave the power as it is.
    """
    if floor.source != REPEATS:
        return floor
    motions = {run: explained.off(motion, power_of) for run, motion in case.motions.items()}
    left = noise_floor(case.runs, motions, case.thresholds.data)
    before = _together(floor)
    lower = replace(floor, torque=_least(floor.torque, left.torque), power=_least(floor.power, left.power))
    return lower if (_together(lower) < _LOWER * before).any() else floor


def _least(before: Any, after: Any) -> Any:
    return before if before is None or after is None else np.minimum(before, after)


def _together(floor: Floor) -> np.ndarray:
    return np.append([] if floor.torque is None else floor.torque, [] if floor.power is None else floor.power)

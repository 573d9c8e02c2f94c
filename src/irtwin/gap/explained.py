"""What the twin says a run takes: without the run, and with the causes found."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from irtwin.effects.effect import Predicted
from irtwin.effects.stack import Stack
from irtwin.gap.candidates import Below
from irtwin.gap.cause import Cause
from irtwin.gap.channels import Grouping, Torque, power_system
from irtwin.gap.finding import Finding, noise_before, twin_values
from irtwin.gap.system import System
from irtwin.signals.motion import Motion

_PIECE = 32768  # samples whose columns are held at once

PowerOf = Callable[[Motion, np.ndarray], tuple[np.ndarray, np.ndarray]]


class LeftOut:
    """What the twin says of a run, fitted without that run's group; of a run it was not fitted to, by all groups."""

    def __init__(self, stack: Stack, system: System):
        """Fit the twin's terms to the equations of torque without each group in turn."""
        moments = system.moments(noise_before(system))
        total = np.sum(moments, axis=0)
        self._stack = stack
        self._all = twin_values(system, system.solution((), total))
        self._without: dict[str, np.ndarray] = {}
        for run in {block.run for block in system.blocks}:
            groups = {int(g) for g, block in zip(system.group, system.blocks, strict=True) if block.run == run}
            rest = total - moments[groups.pop()] if len(groups) == 1 and system.groups > 1 else total
            self._without[run] = twin_values(system, system.solution((), rest))
        self._held: dict[str, tuple[Motion, np.ndarray]] = {}  # each run's: every pass over them asks for it

    def torque(self, motion: Motion) -> np.ndarray:
        """Return the real joint torque, (N, n) N m, of a run or a part of one."""
        if motion.run not in self._without:
            return self._stack.real_torque(motion, self._all)
        run = motion.whole or motion
        if run.run not in self._held or self._held[run.run][0] is not run:
            self._held[run.run] = run, self._stack.real_torque(run, self._without[run.run])
        return self._held[run.run][1][motion.start : motion.start + len(motion.time)]

    def below(self, whole: Motion) -> Predicted:
        """Return what further effects on torque are built on: the torque, and the bodies that were identified."""
        bodies = self._stack.bodies(whole, self._without.get(whole.run, self._all))
        return Predicted(self.torque(whole), bodies=bodies)


def twin_power(stack: Stack, motions: Sequence[Motion], grouping: Grouping, torque: Torque) -> PowerOf:
    """Return the power that the twin predicts for a run, (N,) W, and the part that its axes take."""

    def none(motion: Motion, torque: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return np.zeros(len(torque)), np.zeros(len(torque))

    system = power_system(stack, motions, grouping, (), torque, none)
    values = np.array([term.expected for _, term in stack.power_terms])
    total = np.sum(system.moments(noise_before(system)), axis=0)
    values[~stack.fixed] = twin_values(system, system.solution((), total))
    standing = np.array([effect.id == "standby_power" for effect, _ in stack.power_terms], dtype=bool)

    def power_of(motion: Motion, torque: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        both = []
        for piece in motion.pieces(_PIECE):
            start = piece.start - motion.start
            columns = stack.power_columns(piece, torque[start : start + len(piece.time)])
            both.append((columns @ values, columns @ np.where(standing, 0.0, values)))
        power, axes = zip(*both, strict=True)
        return np.concatenate(power), np.concatenate(axes)

    return power_of


class Explained:
    """What the causes found in a channel add to its signal, and what the twin is beside them."""

    def __init__(self, stack: Stack, finding: Finding, below: Below):
        """Take what a channel showed, and what candidates were built on: what the twin predicts `below` them."""
        self.stack, self.finding, self._below = stack, finding, below
        self._places = {k: place for place, k in enumerate(finding.used)}

    @property
    def values(self) -> np.ndarray:
        """(K,) the twin's coefficients."""
        return self.finding.estimate.values[: self.finding.system.base]

    def added(self, cause: Cause, whole: Motion, *, real: bool = False) -> np.ndarray:
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

    def _column(self, columns: np.ndarray, k: int) -> np.ndarray:
        """Return the candidate column k of an effect's columns (..., m)."""
        system = self.finding.system
        own = system.columns[(k - len(system.columns) if k >= system.changed else k) - system.base]
        if own.index is not None:
            return np.asarray(columns[..., own.index])
        return np.asarray(columns @ np.array([term.expected for term in own.effect.terms(self.stack.robot)]))


class ExplainedTorque(Explained):
    """The joint torque of the twin refitted with the causes, and what each cause adds to the torque."""

    def __init__(self, stack: Stack, finding: Finding, below: Below):
        """Take what torque showed, and what candidates were built on."""
        super().__init__(stack, finding, below)
        self._held: tuple[str, np.ndarray] | None = None

    def __call__(self, motion: Motion) -> np.ndarray:
        """Return the real joint torque, (N, n) N m, of a run or a part of one."""
        whole = motion.whole or motion
        if self._held is None or self._held[0] != whole.run:
            torque = self.stack.real_torque(whole, self.values)
            for cause in self.finding.causes:
                torque = torque + self.added(cause, whole, real=True)
            self._held = whole.run, torque
        return self._held[1][motion.start : motion.start + len(motion.time)]


def explained_power(stack: Stack, finding: Finding, torque: Torque, power_of: PowerOf) -> Explained:
    """Return what the causes found in power add to it, built on the joint torque and the power that it takes."""

    def below(whole: Motion) -> Predicted:
        taken = torque(whole)
        return Predicted(taken, *power_of(whole, taken))

    return Explained(stack, finding, below)

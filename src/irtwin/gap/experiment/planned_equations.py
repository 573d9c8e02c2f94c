"""Planned equations: what one channel's equations would say of motions that nobody has made yet."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cache, cached_property

import numpy as np

from irtwin.effects.effect import Predicted
from irtwin.effects.stack import Stack
from irtwin.gap.data.case import Case
from irtwin.gap.experiment.programmes import Programme
from irtwin.gap.experiment.separation import dispersion, projected
from irtwin.gap.isolation.finding import Finding
from irtwin.gap.regression.candidate_columns import Below
from irtwin.gap.regression.channel_equations import Torque
from irtwin.gap.regression.cross_fitted import PowerOf, TwinPower
from irtwin.gap.regression.hypotheses import Column
from irtwin.gap.regression.moments import Moments, summed
from irtwin.gap.regression.normal_equations import System, least_noise
from irtwin.gap.thresholds import Thresholds
from irtwin.identification.accumulate import Rows, accumulate_any
from irtwin.identification.progress import Tell, with_progress
from irtwin.robot.description import Robot
from irtwin.signals.motion import Motion


@dataclass(frozen=True)
class Products:
    """Products of [twin's columns | columns tried | measurement]: in the data, and with a programme beside them.

    `at`: the place of each column tried, by its index in the system or, where the system lacks it, by itself.
    """

    existing: np.ndarray
    total: np.ndarray
    at: dict[int | Column, int]
    system: System

    def left(self, causes: Sequence[int]) -> tuple[np.ndarray, np.ndarray]:
        """Return what the twin and some causes' columns, refitted, leave: now and then."""
        fitted, prior = [*range(self.system.base), *(self.at[k] for k in causes)], self.system.prior(causes)
        return projected(self.existing, fitted, prior), projected(self.total, fitted, prior)


class PlannedEquations:
    """The equations of one channel, with what was found in it, on motions of one's choice."""

    def __init__(self, finding: Finding, stack: Stack, below: Callable[[Motion], Predicted], thresholds: Thresholds):
        """Take a channel's finding, the twin's effects, and what these predict over a whole run."""
        self.finding, self._stack, self._predict = finding, stack, below
        self.thresholds = thresholds
        self._last: tuple[Motion, Predicted] | None = None

    @property
    def robot(self) -> Robot:
        """The robot."""
        return self._stack.robot

    @cached_property
    def per_second(self) -> float:
        """How many samples a second of motion has, after the filter."""
        return self.rows / max(sum(block.stop - block.start for block in self.finding.system.blocks), 1e-9)

    @cached_property
    def dispersion(self) -> float:
        """How many times more than with independent samples what the fit leaves counts."""
        finding = self.finding
        return dispersion(finding.system, self._moments, finding.attribution.noise, finding.chosen)

    @cached_property
    def rows(self) -> float:
        """How many samples the equation that has the most has."""
        return max(1.0, float(self.finding.system.rows.sum(axis=0).max(initial=0.0)))

    @cached_property
    def _moments(self) -> list[Moments]:
        return self.finding.system.moments(self.finding.attribution.noise)

    @cached_property
    def _total(self) -> Moments:
        return summed(self._moments)

    def products(self, programme: Programme, tried: Sequence[int | Column], tell: Tell | None = None) -> Products:
        """Return the products of the twin's columns and those tried.

        A column that the system lacks is zero in its data: nothing that it depends on was measured. What a programme
        will measure is yet to come: zero. `tell` is told how far that has come, where it takes long.
        """
        system, base = self.finding.system, self.finding.system.base
        inside = [k for k in tried if isinstance(k, int)]
        into = np.append([*range(base), *(base + p for p, k in enumerate(tried) if isinstance(k, int))], -1)
        places = np.array([*range(base), *inside, self._total.size - 1])
        existing = np.zeros((base + len(tried) + 1,) * 2)
        existing[np.ix_(into, into)] = self._total.among(places, places)
        at = {column: base + place for place, column in enumerate(tried)}
        return Products(existing, existing + self._planned(programme, tried, tell), at, system)

    def _planned(self, programme: Programme, tried: Sequence[int | Column], tell: Tell | None) -> np.ndarray:
        system, base = self.finding.system, self.finding.system.base
        columns = [system.columns[self._plain(k) - base] if isinstance(k, int) else k for k in tried]
        pattern = np.ones((len(system.pattern), base + len(columns)), dtype=bool)
        pattern[:, :base] = system.pattern[:, :base]
        for place, k in enumerate(tried):
            if isinstance(k, int):
                pattern[:, base + place] = system.pattern[:, self._plain(k)]
        motions = [
            replace(motion, run=f"{programme.kind} {k} {' '.join(programme.joints)}")
            for k, motion in enumerate(programme.motions)
        ]

        def equations(part: Motion) -> Rows:
            return self._of_joints(part, columns, programme, pattern)

        blocks = accumulate_any(motions, with_progress(equations, motions, tell), pattern)
        scale = np.append([*system.scale[:base], *(column.term.spread for column in columns)], 0.0)
        found = np.zeros((len(scale), len(scale)))
        places = [np.append(np.flatnonzero(row), len(scale) - 1) for row in pattern]
        squares = np.sum([[_largest(b.factors[e] * scale[at]) for e, at in enumerate(places)] for b in blocks], axis=0)
        least = [least_noise(each) for each in np.broadcast_to(squares, len(places))]
        levels = np.maximum(self.finding.attribution.noise, least)
        for block in blocks:
            for equation, (used, level) in enumerate(zip(places, levels, strict=True)):
                factor = block.factors[equation] * scale[used] / level
                found[np.ix_(used, used)] += factor.T @ factor
        return found

    def _of_joints(self, part: Motion, columns: Sequence[Column], programme: Programme, pattern: np.ndarray) -> Rows:
        """Return a part's equations, each with the columns alone that it has: of many joints all would be large."""
        stack, base = self._stack, self.finding.system.base
        if self.finding.name != "torque":
            return self._equations(part, columns, programme.without)
        own, made = stack.columns_by_joint(part), self._tried(part, columns, programme.without)
        both: list[list[np.ndarray]] = [
            [first, *(made[k][:, joint, None] for k in np.flatnonzero(used[base:]))]
            for joint, (first, used) in enumerate(zip(own, pattern, strict=True))
        ]
        return Rows(both, np.zeros(part.dq.shape), np.zeros(part.dq.shape), stack.undecided(part))

    def _load(self, part: Motion) -> np.ndarray:
        """Return the joint torque that the twin predicts for a part of a run, (N, n) N m."""
        return self._below(part.whole or part).torque[part.start : part.start + len(part.time)]

    def _tried(self, part: Motion, columns: Sequence[Column], without: Sequence[str]) -> list[np.ndarray]:
        """Return the columns tried over a part, (N, n) or (N,) each; zero for effects that are taken off."""
        below, held = self._below(part.whole or part), dict[int, np.ndarray]()
        return [self._made(column, part, below, held) * (column.effect.id not in without) for column in columns]

    def _plain(self, index: int) -> int:
        """Return the index of a column as it is, where that of its change is given."""
        system = self.finding.system
        return index if index < system.changed else index - len(system.columns)

    def _equations(self, part: Motion, columns: Sequence[Column], without: Sequence[str]) -> Rows:
        stack, made = self._stack, self._tried(part, columns, without)
        if self.finding.name == "torque":
            own, undecided = stack.torque_columns(part), stack.undecided(part)
        else:
            own, undecided = stack.power_columns(part, self._load(part))[:, None, ~stack.fixed], None
            made = [values[:, None] for values in made]
        joined = np.concatenate([own, *(values[..., None] for values in made)], axis=2)
        return Rows(joined, np.zeros(joined.shape[:2]), np.zeros(joined.shape[:2]), undecided)

    def _made(self, column: Column, part: Motion, below: Predicted, held: dict[int, np.ndarray]) -> np.ndarray:
        """Return one column over a part; the columns of an effect are computed once for all that it has."""
        effect = column.effect
        if id(effect) not in held:
            held[id(effect)] = self._stack.columns(effect, part, below)
        values = held[id(effect)]
        if column.index is None:
            return np.asarray(values @ np.array([term.expected for term in effect.terms(self._stack.robot)]))
        return np.asarray(values[..., column.index])

    def _below(self, whole: Motion) -> Predicted:
        if self._last is None or self._last[0] is not whole:
            self._last = whole, self._predict(whole)
        return self._last[1]


def _largest(factor: np.ndarray) -> float:
    """Return the sum of squares of the largest column."""
    return float((factor**2).sum(axis=0).max(initial=0.0))


def planned_equations(
    case: Case,
    stacks: tuple[Stack, Stack],
    findings: Sequence[Finding],
    below: Below,
    torque: Torque,
) -> tuple[PlannedEquations, ...]:
    """Return the planned equations of each channel.

    stacks: the effects that explain torque and power; `below` is what candidates for torque are built on, `torque` the
    joint torque for those of power.
    """

    @cache
    def power() -> PowerOf:
        return TwinPower(stacks[1], case.with_power, case.grouping, torque)

    def below_power(whole: Motion) -> Predicted:
        real = torque(whole)
        return Predicted(real, *power()(whole, real))

    return tuple(
        PlannedEquations(finding, stacks[0], below, case.thresholds)
        if finding.name == "torque"
        else PlannedEquations(finding, stacks[1], below_power, case.thresholds)
        for finding in findings
    )

"""Planned equations: what one channel's equations would say of motions that nobody has made yet."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cache, cached_property

import numpy as np

from irtwin.effects.effect import Effect
from irtwin.effects.stack import Stack
from irtwin.errors import InputError
from irtwin.gap.data.case import Case
from irtwin.gap.experiment.programmes import Programme
from irtwin.gap.isolation.finding import Finding
from irtwin.gap.regression.candidate_columns import Below
from irtwin.gap.regression.channel_equations import Torque, power_system, torque_system
from irtwin.gap.regression.cholesky import factored, solved
from irtwin.gap.regression.cross_fitted import TwinPower
from irtwin.gap.regression.groups import Grouping
from irtwin.gap.regression.hypotheses import Column
from irtwin.gap.regression.moments import Moments, Summed
from irtwin.gap.regression.normal_equations import System
from irtwin.gap.regression.projection import scores
from irtwin.gap.thresholds import Thresholds
from irtwin.robot.description import Robot
from irtwin.signals.motion import Motion

Build = Callable[[Sequence[Motion], Sequence[Effect]], System]
_LEAST = 1.0  # squares of a column in units of its prior: with less the prior decides


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

    def __init__(self, finding: Finding, robot: Robot, equations: Build, thresholds: Thresholds):
        """Take a channel's finding, and what gives its equations of some motions and effects."""
        self.finding, self.robot, self._equations = finding, robot, equations
        self.thresholds = thresholds

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
        return Summed(self._moments)

    def products(self, programme: Programme, tried: Sequence[int | Column]) -> Products:
        """Return the products of the twin's columns and those tried.

        A column that the system lacks is zero in its data: nothing that it depends on was measured. What a programme
        will measure is yet to come: zero.
        """
        system, base = self.finding.system, self.finding.system.base
        inside = [k for k in tried if isinstance(k, int)]
        into = np.append([*range(base), *(base + p for p, k in enumerate(tried) if isinstance(k, int))], -1)
        places = np.array([*range(base), *inside, self._total.size - 1])
        existing = np.zeros((base + len(tried) + 1,) * 2)
        existing[np.ix_(into, into)] = self._total.among(places, places)
        at = {column: base + place for place, column in enumerate(tried)}
        return Products(existing, existing + self._planned(programme, tried), at, system)

    def _planned(self, programme: Programme, tried: Sequence[int | Column]) -> np.ndarray:
        base, found = self.finding.system.base, np.zeros((self.finding.system.base + len(tried) + 1,) * 2)
        columns = [self.finding.system.column(k) if isinstance(k, int) else k for k in tried]
        effects = {id(one.effect): one.effect for one in columns if one.effect.id not in programme.without}
        named = f"{programme.kind} {{}} {' '.join(programme.joints)}"
        nothing = [np.zeros(motion.dq.shape) for motion in programme.motions]
        motions = [
            replace(motion, run=named.format(k), torque=none, power=none[:, 0])
            for k, (motion, none) in enumerate(zip(programme.motions, nothing, strict=True))
        ]
        try:
            planned = self._equations(motions, list(effects.values()))
        except InputError:  # too short to say anything
            return found
        made = {(id(one.effect), one.index): base + k for k, one in enumerate(planned.columns)}
        at = {base + p: made.get((id(one.effect), one.index)) for p, one in enumerate(columns)}
        places = dict.fromkeys(range(base)) | {place: k for place, k in at.items() if k is not None}
        asked = np.array([place if k is None else k for place, k in places.items()])
        into = np.array(list(places))
        found[np.ix_(into, into)] = Summed(planned.moments(self.finding.attribution.noise)).among(asked, asked)
        return found


def planned_equations(
    case: Case, stacks: tuple[Stack, Stack], findings: Sequence[Finding], below: Below, torque: Torque
) -> tuple[PlannedEquations, ...]:
    """Return the planned equations of each channel.

    stacks: the effects that explain torque and power; `below` is what candidates for torque are built on, `torque` the
    joint torque for those of power.
    """

    @cache
    def power_of() -> TwinPower:
        return TwinPower(stacks[1], case.with_power, case.grouping, torque)

    def of_torque(motions: Sequence[Motion], effects: Sequence[Effect]) -> System:
        return torque_system(stacks[0], motions, _each_alone(motions), effects, below)

    def of_power(motions: Sequence[Motion], effects: Sequence[Effect]) -> System:
        return power_system(stacks[1], motions, _each_alone(motions), effects, torque, power_of())

    builds = {"torque": of_torque, "power": of_power}
    return tuple(PlannedEquations(one, case.robot, builds[one.name], case.thresholds) for one in findings)


def _each_alone(motions: Sequence[Motion]) -> Grouping:
    runs = [motion.run for motion in motions]
    return Grouping({run: run for run in runs}, frozenset(runs))


def projected(total: np.ndarray, inside: Sequence[int], prior: np.ndarray | None = None) -> np.ndarray:
    """Return the products of what the columns `inside` (c), refitted, leave of all columns; `prior`: its products."""
    kept = np.array(inside, dtype=int)
    return np.asarray(total - total[:, kept] @ solved(factored(total[np.ix_(kept, kept)], prior), total[kept]))


def fitted(left: np.ndarray, own: Sequence[int]) -> np.ndarray:
    """Return the values (k,) of columns in their fit to projected products, and nothing else in it."""
    part = list(own)
    return np.asarray(np.linalg.solve(left[np.ix_(part, part)] + np.eye(len(part)), left[part, -1]))


def unimitated(left: np.ndarray, own: Sequence[int], values: np.ndarray, by: Sequence[int]) -> float:
    """Return the squares that columns `by`, refitted, leave of the columns `own` with their values (k,)."""
    part, rival = list(own), list(by)
    squares = float(values @ left[np.ix_(part, part)] @ values)
    if rival:
        cross = left[np.ix_(rival, part)] @ values
        squares -= float(cross @ np.linalg.solve(left[np.ix_(rival, rival)] + np.eye(len(rival)), cross))
    return max(squares, 0.0)


def dispersion(system: System, moments: Sequence[Moments], noise: np.ndarray, chosen: Sequence[int]) -> float:
    """Return how many times more than with independent samples the scores of columns vary.

    Samples of one run are not independent, so what a fit leaves counts by this the less: the median over all candidate
    columns, between blocks of time or between groups of runs, whichever is the larger, and at least one.
    moments, noise: as of `System.moments`; chosen: the columns fitted beside the twin's.
    """
    by_block, products = scores(system, moments, noise, chosen)
    sizes = products.squares(range(by_block.shape[1]))
    judged = np.arange(system.base, len(sizes))
    judged = np.setdiff1d(judged[sizes[judged] > _LEAST], chosen)
    if not len(judged):
        return 1.0
    by_group = np.array([by_block[system.group == group].sum(axis=0) for group in range(system.groups)])
    return max(1.0, *(float(np.median((s[:, judged] ** 2).sum(axis=0) / sizes[judged])) for s in (by_block, by_group)))

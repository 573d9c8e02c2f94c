"""The causes of torque where power was measured too: what is real has to explain both."""

from __future__ import annotations

from collections.abc import Set
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from irtwin.effects.stack import Stack
from irtwin.gap.data.case import Case
from irtwin.gap.data.noise_floor import Floor
from irtwin.gap.isolation.cause import FoundCause
from irtwin.gap.isolation.explained import ExplainedTorque, floor_left
from irtwin.gap.isolation.finding import BesidePower, ChannelFinding, attributed, finding_of
from irtwin.gap.isolation.shortlist import NO_SEARCH, Shortlist, Tried
from irtwin.gap.isolation.steadied import Steadied
from irtwin.gap.isolation.structure_search import Attribution, Without
from irtwin.gap.regression.candidate_columns import Below
from irtwin.gap.regression.channel_equations import Pairs, Torque
from irtwin.gap.regression.cross_fitted import TwinPower
from irtwin.gap.regression.joint_equations import JointEquations, joint_equations
from irtwin.identification.accumulate import part_read
from irtwin.identification.power_line import power_slope

_STRAIGHT = 0.3  # of what is left of power: by less a slope may be off, a tenth of its square


@dataclass(frozen=True)
class SearchBesidePower:
    """The search for the causes of torque that explain power, too.

    effects: candidates of torque and of power. Those of power compete, so that none of torque stands for one of them;
    they are found anew on the torque that is explained here. `below` is what candidates of torque are built on,
    `predicted` the joint torque by the twin, `before` the power that it takes; `shortlist`: what a search before tried;
    `part`: the equations of a part of the log, if that proposes.
    """

    case: Case
    stack: Stack
    effects: Tried
    below: Below
    predicted: Torque
    before: TwinPower
    floor: Floor
    shortlist: Shortlist = NO_SEARCH
    part: JointEquations | None = None

    def proposed(self, without: Set[Without] = frozenset()) -> SearchBesidePower:
        """Return the search in the shapes for which a part of the log speaks; itself where the log is not so long."""
        every = part_read(self.case.measured)
        if every == 1 or self.shortlist.tried:
            return self
        part = self._about(self.effects, self.predicted, self.before, self.case.shaken, every)
        steadied = Steadied.of(self.case, part.whole)
        shortlist = attributed(self.case, part.whole, steadied, _level(part, self.floor), without).shortlist
        return replace(self, effects=shortlist.among_both(self.effects), shortlist=shortlist, part=part)

    @cached_property
    def equations(self) -> JointEquations:
        """Both equations, power linear about the twin's torque: worked out once, however often is searched."""
        if self.part is None:
            return self._about(self.effects, self.predicted, self.before, self.case.shaken)
        return self._about(self.effects, self.predicted, self.before).with_noise_of(self.part)

    def find(self, without: Set[Without] = frozenset()) -> tuple[ChannelFinding, Floor]:
        """Find the causes of torque, `without` some effects; return them with the floor that they leave.

        Where real torque was found, the search is repeated with the floor that is left, and with power linear about
        that torque if losses, which grow with its square, make a difference.
        """
        case, stack = self.case, self.stack
        first = _find(case, self.equations, self.floor, without, self.shortlist)
        if not any(cause.carries_power for cause in first.causes):
            return first, self.floor
        explained = ExplainedTorque(stack, first, self.below)
        power = TwinPower(stack, case.with_power, case.grouping, explained)
        left = floor_left(case, self.floor, explained, power)
        if (
            _bend(case, stack, (self.predicted, self.before), (explained, power))
            > _STRAIGHT * power.system.noise_before[0]
        ):
            shortlist = first.attribution.shortlist
            again = self._about(shortlist.among_both(self.effects), explained, power).with_noise_of(self.equations)
            return _find(case, again, left, without, shortlist), left
        return replace(first, signal_floor=left.torque), left

    def _about(
        self, effects: Tried, torque: Torque, power: TwinPower, shaken: Pairs = (), every: int = 1
    ) -> JointEquations:
        about = self.stack, self.case.measured, self.case.grouping
        return joint_equations(*about, effects, self.below, torque, power, shaken, every)


def _bend(case: Case, stack: Stack, before: tuple[Torque, TwinPower], after: tuple[Torque, TwinPower]) -> float:
    """Return by how much power, linear about the torque before, misses what it is with the torque after: RMS, W."""
    squares, rows = 0.0, 0
    for motion in case.with_power:
        former, latter = before[0](motion), after[0](motion)
        slope = power_slope(stack, motion, former, before[1].values)
        missed = after[1](motion, latter)[0] - after[1](motion, former)[0] - (slope * (latter - former)).sum(axis=1)
        squares, rows = squares + float(missed @ missed), rows + len(missed)
    return float(np.sqrt(squares / max(rows, 1)))


def _find(
    case: Case, equations: JointEquations, floor: Floor, without: Set[Without], before: Shortlist
) -> ChannelFinding:
    """Return what both equations show of torque."""
    whole, torque = equations.whole, equations.torque
    level, steadied = _level(equations, floor), Steadied.of(case, whole)
    both = attributed(case, whole, steadied, level, without, before)
    of_torque = _causes_of_torque(both)
    of_power = [k for cause in both.causes if cause not in of_torque for k in cause.columns]
    known = floor.torque is not None and floor.power is not None
    within = steadied.within(level) if known else None
    beside = BesidePower(replace(equations, whole=steadied.system), tuple(of_power), within)
    where = "torque", case.robot.joint_names, case.observed, torque, steadied.of_torque(torque)
    return finding_of(*where, _of_torque(both, equations), floor.torque, beside=beside)


def _level(equations: JointEquations, floor: Floor) -> np.ndarray:
    """Return the floor of both, (n + 1,) RMS, 0 where it is unknown."""
    of_torque = np.zeros(len(equations.torque.pattern)) if floor.torque is None else floor.torque
    return np.append(of_torque, floor.power or 0.0)


def _causes_of_torque(attribution: Attribution) -> list[FoundCause]:
    return [cause for cause in attribution.causes if cause.variants[0].effect.signal == "torque"]


def _of_torque(both: Attribution, equations: JointEquations) -> Attribution:
    """Return what concerns torque of an attribution of both, in the columns of torque's equations alone."""
    inside = [k for k, hypothesis in enumerate(both.hypotheses) if hypothesis.variants[0].effect.signal == "torque"]
    mine = [both.hypotheses[k] for k in inside]
    return Attribution(
        tuple(
            replace(cause, variants=tuple(map(equations.in_torque, cause.variants)))
            for cause in _causes_of_torque(both)
        ),
        both.noise[:-1],
        tuple(
            replace(hypothesis, variants=tuple(map(equations.in_torque, hypothesis.variants))) for hypothesis in mine
        ),
        both.visible[inside],
        both.log_odds[inside],
        both.shortlist,
    )

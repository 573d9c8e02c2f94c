"""The causes of torque where power was measured too: what is real has to explain both."""

from __future__ import annotations

from collections.abc import Sequence, Set
from dataclasses import replace

import numpy as np

from irtwin.effects.effect import Effect
from irtwin.effects.stack import Stack
from irtwin.gap.data.case import Case
from irtwin.gap.data.noise_floor import Floor
from irtwin.gap.isolation.cause import Cause
from irtwin.gap.isolation.explained import ExplainedTorque
from irtwin.gap.isolation.finding import Finding, Without, attributed, estimate_of
from irtwin.gap.isolation.floor_left import floor_left
from irtwin.gap.isolation.forward_selection import Attribution
from irtwin.gap.isolation.shares import closed_squares
from irtwin.gap.regression.candidate_columns import Below
from irtwin.gap.regression.channel_equations import Torque
from irtwin.gap.regression.cross_fitted import TwinPower
from irtwin.gap.regression.held_out import held_out
from irtwin.gap.regression.joint_equations import JointEquations, joint_equations
from irtwin.gap.regression.normal_equations import noise_before
from irtwin.gap.regression.progress import Tell
from irtwin.gap.regression.transient import Transient
from irtwin.identification.estimators import Estimate


def find_beside_power(
    case: Case,
    stack: Stack,
    effects: tuple[Sequence[Effect], Sequence[Effect]],
    below: Below,
    predicted: Torque,
    floor: Floor,
    seed: int,
    *,
    transient: Transient | None = None,
    without: Set[Without] = frozenset(),
    tell: Tell | None = None,
) -> tuple[Finding, Floor]:
    """Find the causes of torque, `without` some effects; return them with the floor that they leave.

    effects: candidates of torque and of power. Those of power compete, so that none of torque stands for one of them;
    they are found anew on the torque that is explained here. `below` is what candidates of torque are built on,
    `predicted` the joint torque by the twin. Where real torque was found, the search is repeated with the floor that is
    left, and with power linear about that torque if the twin has losses that grow with its square.
    """

    def about(torque: Torque, power: TwinPower) -> JointEquations:
        found = joint_equations(stack, case.measured, case.grouping, effects, below, torque, power, tell)
        return replace(found, whole=replace(found.whole, transient=transient))

    equations = about(predicted, TwinPower(stack, case.with_power, case.grouping, predicted))
    first = _find(case, equations, floor, seed, without)
    if not any(cause.variants[0].effect.channel == "torque" for cause in first.causes):
        return first, floor
    explained = ExplainedTorque(stack, first, below)
    power = TwinPower(stack, case.with_power, case.grouping, explained)
    left = floor_left(case, floor, explained, power)
    if any(effect.needs == "torque" and not effect.carries_torque for effect, _ in stack.power_terms):
        equations = about(explained, power)
    elif left is floor:
        return first, floor
    return _find(case, equations, left, seed, without), left


def _find(case: Case, equations: JointEquations, floor: Floor, seed: int, without: Set[Without]) -> Finding:
    whole, torque = equations.whole, equations.torque
    n = len(torque.pattern)
    levels = [np.zeros(n) if floor.torque is None else floor.torque, [floor.power or 0.0]]
    both = attributed(case, whole, np.concatenate(levels), seed, without)
    found = _of_torque(both, equations)
    chosen = [k for cause in found.causes for k in cause.columns]
    judged = held_out(torque, noise_before(torque), found.noise, chosen)
    closed = closed_squares(torque, found, seed)
    mine = _causes_of_torque(both)
    beside = [cause for cause in both.causes if cause not in mine]
    fitted = estimate_of(whole, [k for cause in (*mine, *beside) for k in cause.columns])
    used = [*range(torque.base), *range(whole.base, whole.base + len(chosen))]
    fitted = Estimate(fitted.values[used], fitted.covariance[np.ix_(used, used)], fitted.noise[:n], fitted.blocks)
    names = case.robot.joint_names
    return Finding("torque", names, case.observed, torque, found, judged, floor.torque, fitted, closed)


def _causes_of_torque(found: Attribution) -> list[Cause]:
    return [cause for cause in found.causes if cause.variants[0].effect.signal == "torque"]


def _of_torque(both: Attribution, equations: JointEquations) -> Attribution:
    """Return what concerns torque of an attribution of both, in the columns of torque's equations alone."""
    inside = [k for k, one in enumerate(both.hypotheses) if one.variants[0].effect.signal == "torque"]
    mine = [both.hypotheses[k] for k in inside]
    return Attribution(
        tuple(
            replace(cause, variants=tuple(map(equations.in_torque, cause.variants)))
            for cause in _causes_of_torque(both)
        ),
        both.noise[:-1],
        tuple(replace(one, variants=tuple(map(equations.in_torque, one.variants))) for one in mine),
        both.visible[inside],
        both.share_visible[inside],
    )

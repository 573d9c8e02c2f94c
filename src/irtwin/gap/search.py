"""The search for causes, channel by channel: what a twin stands on, and which effects are likely beside it."""

from __future__ import annotations

from collections.abc import Callable, Sequence, Set
from dataclasses import replace

import numpy as np

from irtwin.effects.catalogue import catalogue
from irtwin.effects.effect import Effect, Predicted
from irtwin.effects.stack import Stack
from irtwin.errors import InputError
from irtwin.gap.data.case import Case
from irtwin.gap.data.noise_floor import Floor
from irtwin.gap.data.same_robot import check_same_robot
from irtwin.gap.isolation.beside_power import find_beside_power
from irtwin.gap.isolation.detectability import can_show
from irtwin.gap.isolation.explained import Explained, ExplainedTorque, explained_power
from irtwin.gap.isolation.finding import Finding, Without, find
from irtwin.gap.isolation.floor_left import floor_left
from irtwin.gap.isolation.refusal import Refusals, find_possible
from irtwin.gap.regression.candidate_columns import Below
from irtwin.gap.regression.channel_equations import Torque, power_system, torque_system
from irtwin.gap.regression.cross_fitted import LeftOut, TwinPower
from irtwin.gap.regression.normal_equations import System
from irtwin.gap.regression.torque_from_power import ThroughPower
from irtwin.identification.progress import Tell


def twin_equations(case: Case, stack: Stack, tell: Tell) -> System | None:
    """Return the equations of torque of the twin alone; None where no torque is known."""
    return torque_system(stack, case.with_torque, case.grouping, (), None, tell) if case.with_torque else None


def check_observed(system: System) -> None:
    """Raise InputError where no sample of an observed run is left."""
    if not system.observed.any():
        raise InputError("in no observed run does a joint move for longer than the filter; log longer runs")


def torque_source(case: Case, stack: Stack, plain: System | None, tell: Tell) -> tuple[Stack, Torque, Below]:
    """Return the effects that explain power, the joint torque that they are given, and what those of torque stand on.

    It is that of a fit to torque (`plain`: the twin's equations) without the run's group; where no run shows torque,
    that of a fit to power.
    """
    if plain is None:
        through_power = ThroughPower(stack, case.with_power)
        return through_power, through_power.torque, lambda whole: Predicted(through_power.torque(whole))
    if case.shows("torque"):
        check_same_robot(case.runs, stack, plain, case.thresholds.data)
    left_out = LeftOut(stack, plain, tell)
    return stack, left_out.torque, left_out.below


def torque_causes(
    case: Case,
    stack: Stack,
    plain: System,
    floor: Floor,
    below: Below,
    predicted: Torque,
    before: Callable[[], TwinPower],
    tried: tuple[Sequence[Effect], Sequence[Effect]],
    unknown: Set[Without],
    seed: int,
    tell: Tell,
) -> tuple[Finding, Floor, Refusals]:
    """Find the causes of torque, and the floor that they leave; where power was measured too, they explain both.

    tried: effects on torque, and on power; `unknown` are not known to the search. `before` gives the power that the
    twin takes by the joint torque `predicted`.
    """
    if case.shows("power"):

        def beside_power(without: Set[Without]) -> tuple[Finding, Floor]:
            return find_beside_power(
                case, stack, tried, below, predicted, before(), floor, seed, without=without, tell=tell
            )

        return find_possible(case, beside_power, unknown)
    system = torque_system(stack, case.with_torque, case.grouping, tried[0], below, tell, case.shaken)

    def alone(without: Set[Without]) -> tuple[Finding, Floor]:
        first = find("torque", case, system, floor.torque, seed, without, tell=tell)
        left = floor_left(case, floor, ExplainedTorque(stack, first, below)) if first.causes else floor
        return replace(first, floor=left.torque), left

    return find_possible(case, alone, unknown)


def power_causes(
    case: Case,
    stack: Stack,
    floor: Floor,
    before: Callable[[], TwinPower] | None,
    torque: Torque,
    tried: Sequence[Effect],
    unknown: Set[Without],
    seed: int,
    tell: Tell,
) -> tuple[Explained, Refusals]:
    """Find the causes of power on the joint torque that is explained; `before`: power on that of the twin, if other."""
    power_of = TwinPower(stack, case.with_power, case.grouping, torque)
    system = power_system(stack, case.with_power, case.grouping, tried, torque, power_of, tell)
    check_observed(system)
    level = None if floor.power is None else np.array([floor.power])
    plain = before().system if before else None

    def search(without: Set[Without]) -> tuple[Finding, Floor]:
        found = find("power", case, system, level, seed, without, plain, tell)
        left = floor_left(case, floor, explained_power(stack, found, torque, power_of)) if found.causes else floor
        return replace(found, floor=None if left.power is None else np.array([left.power])), left

    finding, _, refusals = find_possible(case, search, unknown)
    return explained_power(stack, finding, torque, power_of), refusals


def variants(case: Case, signal: str) -> list[Effect]:
    """Return every effect that shows in a signal, in every shape that is to be tried.

    A robot keeps its bodies; those of a simulator are as drawn, and may be off.
    """
    bodies = any(run.role == "simulated" for run in case.runs)
    return [
        shape
        for effect in catalogue().values()
        if effect.signal == signal
        and not effect.disturbance
        and (bodies or not effect.bodies)
        and can_show(effect, case.seen)
        for shape in (*effect.candidates(case.robot), *(effect.changes() if case.others else ()))
    ]

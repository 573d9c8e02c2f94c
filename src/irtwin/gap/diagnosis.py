"""The diagnosis of a gap: where it lies, which effect causes it, how far it shrinks once that is added."""

from __future__ import annotations

from collections.abc import Callable, Sequence, Set
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np

from irtwin.effects.catalogue import catalogue
from irtwin.effects.effect import Effect, Predicted
from irtwin.effects.stack import Stack
from irtwin.errors import InputError
from irtwin.gap import writing
from irtwin.gap.closed_twin import closed_twin
from irtwin.gap.data.case import Case, case_of
from irtwin.gap.data.noise_floor import Floor, noise_floor
from irtwin.gap.data.same_robot import check_same_robot
from irtwin.gap.document.cause_ids import cause_ids
from irtwin.gap.document.curves import Curves
from irtwin.gap.document.document import Closeable, Document
from irtwin.gap.document.experiment import Experiment
from irtwin.gap.energy_errors import EnergyErrors, energy_errors
from irtwin.gap.experiment.flexible_regression import flexible_regression
from irtwin.gap.experiment.next_experiment import next_experiment
from irtwin.gap.experiment.planned_equations import planned_equations
from irtwin.gap.isolation.beside_power import find_beside_power
from irtwin.gap.isolation.cause import Cause
from irtwin.gap.isolation.detectability import Untestable, can_show, untestable
from irtwin.gap.isolation.explained import Explained, ExplainedTorque, explained_power
from irtwin.gap.isolation.finding import Finding, find
from irtwin.gap.isolation.floor_left import floor_left
from irtwin.gap.isolation.power_consistency import PowerBalance, filtered
from irtwin.gap.isolation.power_evidence import power_balances
from irtwin.gap.isolation.verdict import NO_GAP, verdict_of
from irtwin.gap.localisation.channel_residuals import channel_residual, places
from irtwin.gap.localisation.evidence import drawn
from irtwin.gap.localisation.locations import Location
from irtwin.gap.regression.candidate_columns import Below
from irtwin.gap.regression.channel_equations import Torque, power_system, torque_system
from irtwin.gap.regression.cross_fitted import LeftOut, TwinPower
from irtwin.gap.regression.normal_equations import System
from irtwin.gap.regression.torque_from_power import ThroughPower
from irtwin.gap.screening.screen import screen
from irtwin.gap.thresholds import DEFAULT, Thresholds
from irtwin.identification.threads import one_blas_thread
from irtwin.robot.description import Robot
from irtwin.signals.log import DataSet
from irtwin.twin.twin import Twin

Progress = Callable[[str], None]


@dataclass(frozen=True)
class Diagnosis:
    """The diagnosis: its `document`, what that stands on, and the `curves` that a page draws."""

    description: Robot
    verdict: str
    channels: tuple[Finding, ...]
    floor: Floor
    locations: tuple[Location, ...]
    untestable: tuple[Untestable, ...]
    runs: tuple[str, ...]
    curves: Curves
    seed: int = 0
    experiment: Experiment | None = None
    twin: Twin | None = None  # with the causes added, fitted to all runs in which it holds
    energies: EnergyErrors | None = None
    against: str | None = None  # the role of the runs that the observed ones are held against
    thresholds: Thresholds = DEFAULT
    yardstick: dict[str, Closeable] = field(default_factory=dict)  # each channel's, what could be closed at all

    @property
    def causes(self) -> tuple[tuple[Finding, Cause], ...]:
        """Every cause with its channel, the largest first."""
        pairs = [(finding, cause) for finding in self.channels for cause in finding.causes]
        return tuple(sorted(pairs, key=lambda pair: -pair[1].gain))

    @cached_property
    def document(self) -> Document:
        """The diagnosis as it is handed out: in JSON, in the graph, on a page."""
        robot, gains = self.description, [cause.gain for _, cause in self.causes]
        acted_on = [(cause.effect, writing.acted_on(robot, cause)) for _, cause in self.causes]
        ids = cause_ids(acted_on, robot.joint_names)
        named = [(finding, cause, name) for (finding, cause), name in zip(self.causes, ids, strict=True)]
        return Document(
            verdict=self.verdict,
            robot=robot.name,
            gap=writing.gap(robot.joint_names, self.channels, self.energies),
            locations=tuple(map(writing.location, self.locations)),
            causes=tuple(writing.cause(robot, *one, gains, self.verdict, self.thresholds.confidence) for one in named),
            not_testable=tuple(map(writing.untestable, self.untestable)),
            shrink=writing.shrink(
                robot, self.runs, self.channels, self.floor, self.energies, named, self.yardstick, self.seed
            ),
            next_experiment=self.experiment,
        )

    @property
    def evidence(self) -> dict[str, Any]:
        """The curves as JSON."""
        return self.curves.to_json()

    def to_json(self) -> dict[str, Any]:
        """Return the document in the form of its schema, `irtwin.gap.document.document.schema()`."""
        return self.document.to_json()


@one_blas_thread()
def diagnose(
    data_set: DataSet,
    *,
    withhold: Sequence[str] = (),
    unknown: Sequence[str] = (),
    thresholds: Thresholds = DEFAULT,
    seed: int = 0,
    progress: Progress | None = None,
) -> Diagnosis:
    """Diagnose the gap between a robot's twin and its runs.

    `withhold` takes effects out of the twin and leaves them in the catalogue; `unknown` are those that the search is
    not to know; `thresholds` decide what is said; `progress` is told each step. Raises InputError on an effect that the
    catalogue lacks or the twin has not, and where the data set cannot be diagnosed.
    """
    tell = progress or (lambda line: None)
    tell(f"Filtering {len(data_set.runs)} runs")
    case = case_of(data_set, withhold, thresholds)
    floor = noise_floor(case.runs, case.motions, thresholds.repeats)
    stack = Stack(case.robot, [*case.effects, *case.run_offsets])
    tell("Fitting the twin")
    plain = torque_system(stack, case.with_torque, case.grouping, (), None, tell) if case.with_torque else None
    if case.shows("torque") and plain is not None:
        _check_observed(plain)
    power_stack, predicted, below = _torque_source(case, stack, plain)
    explained: list[Explained] = []
    torque = predicted
    if case.shows("torque") and plain is not None:
        tell("Trying every effect on torque")
        found, floor = _torque(case, stack, plain, floor, below, predicted, frozenset(unknown), seed, tell)
        torque = ExplainedTorque(stack, found, below)
        if case.shows("power"):
            torque = ExplainedTorque(stack, _weighed(found, power_balances(case, power_stack, torque)), below)
        explained.append(torque)
    energies: EnergyErrors | None = None
    if case.shows("power"):
        tell("Trying every effect on power")
        explained.append(_power(case, power_stack, floor, predicted, torque, frozenset(unknown), seed, tell))
        energies = energy_errors(explained[-1].finding, case.with_power)
    findings = [one.finding for one in explained]
    verdict = verdict_of(findings, floor, thresholds.verdict)
    tell("Identifying the twin with its causes")
    causes = [cause for finding in findings for cause in finding.causes]
    blamed = {cause.effect for cause in causes}
    silent = [effect for effect in catalogue().values() if effect.id not in blamed]
    lacking = untestable(
        silent, case.effects, [(f.name, f.attribution) for f in findings], case.seen, thresholds.detectability
    )
    left = [channel_residual(case, one, predicted if one.finding.name == "torque" else torque) for one in explained]
    located = places(left, seed)
    tell("Designing the next experiment")
    planned = planned_equations(case, (stack, power_stack), findings, below, torque)
    measures = {channel.finding.name: flexible_regression(channel, case.seen, seed) for channel in planned}
    proposal = next_experiment(
        case.robot, planned, [catalogue()[one.effect] for one in lacking], case.seen, thresholds.experiment
    )
    return Diagnosis(
        description=case.robot,
        verdict=verdict,
        channels=tuple(findings),
        floor=floor,
        locations=tuple(located if verdict != NO_GAP else ()),
        untestable=tuple(lacking),
        runs=tuple(sorted(case.observed)),
        seed=seed,
        experiment=None if proposal is None else proposal.experiment,
        curves=drawn(left, located, None if proposal is None else proposal.curve),
        twin=closed_twin(case, causes),
        energies=energies,
        against=case.against,
        thresholds=thresholds,
        yardstick={name: one.shares() for name, one in measures.items() if one is not None},
    )


def _check_observed(system: System) -> None:
    if not system.observed.any():
        raise InputError("in no observed run does a joint move for longer than the filter; log longer runs")


def _torque_source(case: Case, stack: Stack, plain: System | None) -> tuple[Stack, Torque, Below]:
    """Return the effects that explain power, the joint torque that they are given, and what those of torque stand on.

    It is that of a fit to torque (`plain`: the twin's equations) without the run's group; where no run shows torque,
    that of a fit to power.
    """
    if plain is None:
        through_power = ThroughPower(stack, case.with_power)
        return through_power, through_power.torque, lambda whole: Predicted(through_power.torque(whole))
    if case.shows("torque"):
        check_same_robot(case.runs, stack, plain, case.thresholds.same_robot)
    left_out = LeftOut(stack, plain)
    return stack, left_out.torque, left_out.below


def _torque(
    case: Case,
    stack: Stack,
    plain: System,
    floor: Floor,
    below: Below,
    predicted: Torque,
    unknown: Set[str],
    seed: int,
    tell: Progress,
) -> tuple[Finding, Floor]:
    """Find the causes of torque, and the floor that they leave; where power was measured too, they explain both."""
    found = screen(case, stack, plain, seed)
    tried = found.shapes(_variants(case, "torque"))
    if not case.shows("power"):
        system = torque_system(stack, case.with_torque, case.grouping, tried, below, tell)
        system = replace(system, transient=found.contact)
        first = find("torque", case, system, floor.torque, seed, without=unknown)
        left = floor_left(case, floor, ExplainedTorque(stack, first, below), None) if first.causes else floor
        if left is floor:
            return first, floor
        return find("torque", case, system, left.torque, seed, without=unknown), left
    both = (tried, _variants(case, "power"))
    return find_beside_power(
        case, stack, both, below, predicted, floor, seed, transient=found.contact, without=unknown, tell=tell
    )


def _weighed(found: Finding, balances: tuple[PowerBalance, ...]) -> Finding:
    """Return what torque showed with what power says of each cause, without the rivals that it refutes."""
    pairs = zip(found.causes, balances, strict=True)
    causes = tuple(filtered(cause, balance, catalogue()) for cause, balance in pairs)
    return replace(found, attribution=replace(found.attribution, causes=causes), power_balances=balances)


def _power(
    case: Case,
    stack: Stack,
    floor: Floor,
    predicted: Torque,
    torque: Torque,
    unknown: Set[str],
    seed: int,
    tell: Progress,
) -> Explained:
    """Find the causes of power on the joint torque that is explained; `predicted` is that of the twin as it is."""
    power_of = TwinPower(stack, case.with_power, case.grouping, torque)
    tried = _variants(case, "power")
    system = power_system(stack, case.with_power, case.grouping, tried, torque, power_of, tell)
    _check_observed(system)
    level = None if floor.power is None else np.array([floor.power])
    plain = None if torque is predicted else TwinPower(stack, case.with_power, case.grouping, predicted).system
    found = find("power", case, system, level, seed, without=unknown, plain=plain)
    return explained_power(stack, found, torque, power_of)


def _variants(case: Case, signal: str) -> list[Effect]:
    """Return every effect that shows in a signal, in every shape that is to be tried.

    A robot keeps its bodies; those of a simulator are as drawn, and may be off.
    """
    bodies = any(run.role == "simulated" for run in case.runs)
    return [
        shape
        for effect in catalogue().values()
        if effect.signal == signal and (bodies or not effect.bodies) and can_show(effect, case.seen)
        for shape in effect.candidates(case.robot)
    ]

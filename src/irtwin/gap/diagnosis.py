"""The diagnosis of a gap: where it lies, which effect causes it, how far it shrinks once that is added."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Any

from irtwin.document.curves import Curves
from irtwin.document.document import Cutoff, Document, GapLocation, Untestable, cause_ids
from irtwin.document.experiment import Experiment
from irtwin.effects.catalogue import catalogue
from irtwin.effects.local import LocalEffect
from irtwin.gap import writing
from irtwin.gap.beside_file import Simulator, alone_in_file, beside, of_simulated_runs, with_bodies
from irtwin.gap.closed_twin import closed_twin, friction
from irtwin.gap.data.baseline import said_of_twin
from irtwin.gap.data.case import case_of
from irtwin.gap.data.noise_floor import Floor
from irtwin.gap.energy_errors import EnergyErrors, energy_errors
from irtwin.gap.forecast import forecast
from irtwin.gap.isolation.cause import FoundCause
from irtwin.gap.isolation.detectability import untestable
from irtwin.gap.isolation.explained import Explained, ExplainedTorque
from irtwin.gap.isolation.finding import ChannelFinding
from irtwin.gap.isolation.refusal import NOTHING_REFUSED, Refusals
from irtwin.gap.isolation.shortlist import Tried
from irtwin.gap.isolation.verdict import (
    IMPOSSIBLE_NUMBER,
    MUCH_IS_LEFT,
    NO_GAP,
    UNEXPLAINED,
    UNSURE,
    left_open,
    verdict_of,
)
from irtwin.gap.localisation.channel_residuals import channel_residual, drawn, places
from irtwin.gap.next_experiment import next_experiment
from irtwin.gap.not_repeating import DifferingRepeats, with_removed
from irtwin.gap.rehearsal import channel_equations
from irtwin.gap.repeats.disturbances import Disturbance, disturbances
from irtwin.gap.repeats.removal import Removed, removed
from irtwin.gap.screening.screen import screen
from irtwin.gap.search import Search, check_observed, variants
from irtwin.gap.thresholds import DEFAULT, Thresholds
from irtwin.identification.progress import tell, tell_step
from irtwin.identification.two_processes import begun, one_blas_thread
from irtwin.robot.description import Robot
from irtwin.signals.log import DataSet
from irtwin.signals.motion import Motion
from irtwin.twin.torque_scale import FittedTorqueScale, torque_scale
from irtwin.twin.twin import Twin


@dataclass(frozen=True)
class Diagnosis:
    """The diagnosis: its `document`, what that stands on, and the `curves` that a page draws.

    `left_open`: why the gap stays unexplained, however sure its causes are; None where it does not.
    """

    description: Robot
    left_open: str | None
    channels: tuple[ChannelFinding, ...]
    floor: Floor
    locations: tuple[GapLocation, ...]
    untestable: tuple[Untestable, ...]
    runs: tuple[str, ...]
    curves: Curves
    experiment: Experiment | None = None
    planned: Motion | None = None  # of the experiment's programme; each of its runs makes this motion
    twin: Twin | None = None  # with the causes added, fitted to all runs in which it holds
    energies: EnergyErrors | None = None
    not_repeating: tuple[Disturbance, ...] = ()  # what differs between repeats, beyond noise
    removed: tuple[Removed, ...] = ()  # what of it an effect explains
    against: str | None = None  # the role of the runs that the observed ones are held against
    thresholds: Thresholds = DEFAULT
    refusals: Refusals = NOTHING_REFUSED
    scale: FittedTorqueScale | None = None  # of torque, where it was measured
    cutoff: Cutoff | None = None  # of the filter that all runs passed
    simulator: Simulator | None = None
    mended: tuple[str, ...] = ()  # what was done with the logs as they were read

    @property
    def verdict(self) -> str:
        """The verdict, as in the document."""
        return self.document.verdict

    @property
    def causes(self) -> tuple[tuple[ChannelFinding, FoundCause], ...]:
        """Every cause with its channel, that which closes most first."""
        pairs = [(finding, cause) for finding in self.channels for cause in finding.causes]
        return tuple(sorted(pairs, key=lambda pair: -pair[0].closing([pair[1]]).size))

    @cached_property
    def document(self) -> Document:
        """The diagnosis as it is handed out: in JSON, in the graph, on a page."""
        robot = self.description
        acted_on = [(cause.effect, cause.touched(robot)) for _, cause in self.causes]
        ids = cause_ids(acted_on, robot.joint_names)
        ids_of = {id(cause): name for (_, cause), name in zip(self.causes, ids, strict=True)}
        written = tuple(
            writing.cause(robot, finding, cause, ids_of[id(cause)], self.scale, self.thresholds.criterion)
            for finding, cause in self.causes
        )
        findings = writing.findings(robot, self.channels, ids_of, written, self.thresholds.matters)
        unknown_is_there = self.left_open in (MUCH_IS_LEFT, IMPOSSIBLE_NUMBER)
        doubted = set(ids) if unknown_is_there else writing.closing_nothing(findings)
        written = tuple(
            writing.doubted(cause, self.thresholds.criterion) if cause.id in doubted else cause for cause in written
        )
        apart = DifferingRepeats(self.removed, self.not_repeating, self.floor, self.channels, robot.joint_names)
        if self.against == "simulated":
            numbers = of_simulated_runs(self.channels) if self.simulator is None else self.simulator.numbers
            alone = {} if self.simulator is None else alone_in_file(self.causes, self.scale)
            written = tuple(beside(numbers, cause, alone) for cause in written)
        causes = apart.causes(written)
        findings = writing.findings(robot, self.channels, ids_of, written, self.thresholds.matters)
        between = self.against == "simulated" and any(finding.matters for finding in findings)
        if between:
            findings = writing.between_sides(findings, self.channels, ids_of)
        findings = apart.findings(findings, causes, self.thresholds.matters)
        causes = writing.folded(causes, findings)
        if self.simulator is not None and self.twin is not None:
            causes = with_bodies(causes, self.simulator, self.twin)
        judged = verdict_of(findings)
        verdict, why = (UNEXPLAINED, self.left_open) if self.left_open else (judged, None)
        shrink = writing.shrink(robot, self.runs, self.channels, self.floor, self.energies, ids_of, between=between)
        return Document(
            verdict=verdict,
            unexplained_because=why or (UNSURE if verdict == UNEXPLAINED else None),
            robot=robot.name,
            gap=apart.gap(writing.gap(robot.joint_names, self.channels, self.energies)),
            locations=() if verdict == NO_GAP else self.locations,
            findings=findings,
            causes=causes,
            not_testable=self.untestable,
            shrink=apart.shrink(shrink, between=between),
            next_experiment=self.experiment,
            not_repeating=apart.listed(),
            refused=self.refusals.refused or None,
            torque_scale=None if self.scale is None else writing.torque_scale(self.scale),
            cutoff=self.cutoff,
            simulator=None if self.simulator is None else self.simulator.name,
            odd_stretches=(self.twin and self.twin.odd_stretches) or None,
            mended="\n".join(self.mended) or None,
            friction_spread=writing.friction_spread(self.channels),
        )

    @property
    def evidence(self) -> dict[str, Any]:
        """The curves as JSON."""
        return self.curves.to_json()

    def to_json(self) -> dict[str, Any]:
        """Return the document in the form of its schema, `irtwin.document.document.schema()`."""
        return self.document.to_json()


@one_blas_thread()
def diagnose(
    data_set: DataSet,
    *,
    twin: Twin | None = None,
    simulator: Simulator | None = None,
    withhold: Sequence[str] = (),
    unknown: Sequence[str] = (),
    thresholds: Thresholds = DEFAULT,
    seed: int = 0,
) -> Diagnosis:
    """Diagnose the gap between a robot's twin and its runs.

    `twin` is what the gap is held against: its effects in their shapes, and its numbers as the prior; None: the effects
    that the data set names. `withhold` takes effects out of it and leaves them in the catalogue; `unknown` are those
    that the search is not to know. `simulator` is the model whose runs are among those of the data set: its numbers
    stand beside the robot's. `thresholds` decide what is said. Raises InputError on an effect that the catalogue lacks
    or the twin has not, on a twin of another robot, and where the data set cannot be diagnosed.
    """
    expected = forecast(data_set)
    if expected.long:
        tell(expected.line)
    tell(f"Filtering {len(data_set.runs)} runs")
    case = case_of(data_set, withhold, thresholds, twin)
    for line in said_of_twin(data_set, twin) if twin else ():
        tell(line)
    tell("Fitting the twin")
    search = Search(case, frozenset(unknown))
    plain, differ = search.plain, disturbances(case)
    case, taken = removed(case, search.stack, plain, differ)
    if taken:
        case = case.with_friction_near_zero()
        search = replace(search, case=case)
        plain = search.plain
    tell_step("  the noise floor")
    floor = search.floor
    if case.shows("torque") and plain is not None:
        check_observed(plain)
    twin_torque = search.twin.torque
    explained: list[Explained] = []
    refusals = NOTHING_REFUSED
    scale: FittedTorqueScale | None = None
    torque: ExplainedTorque | None = None
    if case.shows("torque") and plain is not None:
        tell("Trying every effect on torque")
        search, torque, floor, refusals = search.causes_of_torque(_tried(search))
        case, twin_torque = search.case, search.twin.torque
        explained.append(torque)
        scale = torque_scale(data_set, case.seen, torque)
    energies: EnergyErrors | None = None
    causes = [cause for channel in explained for cause in channel.finding.causes]
    twin_with_causes = begun(partial(closed_twin, case, causes), worth=case.long)
    if case.shows("power"):
        tell("Trying every effect on power")
        of_power, wrong = search.power_causes(variants(case, "power"), floor, torque)
        explained.append(of_power)
        refusals += wrong
        energies = energy_errors(explained[-1].finding, case.with_power)
    findings = [channel.finding for channel in explained]
    tell("Identifying the twin with its causes")
    if len(every := [cause for finding in findings for cause in finding.causes]) > len(causes):
        twin_with_causes.drop()
        causes = every
        twin_with_causes = begun(partial(closed_twin, case, causes), worth=case.long)
    blamed = {cause.effect for cause in causes}
    screened = (LocalEffect,) if case.shows("torque") else ()
    silent = [
        effect
        for effect in catalogue().values()
        if effect.id not in blamed and not effect.disturbance and not isinstance(effect, screened)
    ]
    lacking = untestable(
        silent, case.stack.ids, [(f.name, f.attribution) for f in findings], case.seen, thresholds.criterion
    )
    left = [
        channel_residual(case, channel, twin_torque if channel is torque else torque or twin_torque)
        for channel in explained
    ]
    open_because, place = left_open(
        findings,
        thresholds,
        unmatched=refusals.unmatched,
        alike=case.alike,
        between=case.against == "simulated",
        differing=differ,
        explained=[removal.disturbance for removal in taken],
    )
    located = places(left, seed, place)
    tell("Designing the next experiment")
    stacks = {"torque": search.stack, "power": search.power_stack}
    equations = channel_equations(stacks, case, search.below, torque or twin_torque)
    proposal = next_experiment(
        case.robot,
        [(finding, equations[finding.name]) for finding in findings],
        [untestable.effect for untestable in lacking],
        case.seen,
        thresholds,
    )
    identified = twin_with_causes(lambda: tell_step("  waiting for the twin with its causes"))
    return Diagnosis(
        description=case.robot,
        left_open=open_because,
        channels=tuple(with_removed(finding, taken) for finding in findings),
        floor=floor,
        locations=tuple(located),
        untestable=lacking,
        runs=tuple(sorted(case.observed)),
        experiment=None if proposal is None else proposal.experiment,
        planned=None if proposal is None or proposal.programme is None else proposal.programme.motions[0],
        curves=drawn(left, located, None if proposal is None else proposal.curve, friction(case, causes, identified)),
        twin=replace(identified, torque_scale=scale),
        energies=energies,
        not_repeating=tuple(differ),
        removed=tuple(taken),
        against=case.against,
        thresholds=thresholds,
        refusals=refusals,
        scale=scale,
        cutoff=case.cutoff,
        simulator=simulator,
        mended=data_set.repairs,
    )


def _tried(search: Search) -> Callable[[Search], Tried]:
    """Return what says which effects a search tries; what some of them are is screened once, by the search given."""
    case = search.case
    assert search.plain is not None
    screened = screen(case, search.stack, search.plain)
    if case.long:  # what is needed next is worked out beside the search for contacts
        for motion in case.measured:
            search.below(motion)
        if case.shows("power"):
            _ = search.before
    return lambda of: (screened.shapes(variants(of.case, "torque")), variants(of.case, "power"))

"""Writing the document of a diagnosis: its parts, from what was found."""

from __future__ import annotations

from collections.abc import Container, Mapping, Sequence
from dataclasses import replace

import numpy as np

from irtwin.document import document
from irtwin.document.document import cause_ids
from irtwin.effects.catalogue import catalogue
from irtwin.effects.effect import Quantity
from irtwin.gap.data.noise_floor import Floor
from irtwin.gap.energy_errors import EnergyErrors
from irtwin.gap.isolation.cause import FoundCause
from irtwin.gap.isolation.closing import closed_fraction, half_width
from irtwin.gap.isolation.finding import ChannelFinding, branches, quantities
from irtwin.gap.regression.held_out import held_out
from irtwin.gap.screening.screen import acting
from irtwin.gap.thresholds import Criterion, Matters
from irtwin.robot.description import Robot
from irtwin.twin.torque_scale import FittedTorqueScale

_TOLD = 0.01  # probability of a rival that is listed
_APART = "the gap above what the twin leaves of the simulator's own runs"


def gap(joints: Sequence[str], findings: Sequence[ChannelFinding], energies: EnergyErrors | None) -> document.Gap:
    """Return the gap before anything is added."""
    sizes = {finding.name: _sizes(finding) for finding in findings}
    return document.Gap(
        energy_error_percent=energies.mean[0] if energies else None,
        torque=dict(zip(joints, sizes["torque"], strict=True)) if "torque" in sizes else None,
        power=sizes["power"][0] if "power" in sizes else None,
    )


def friction_spread(findings: Sequence[ChannelFinding]) -> document.FrictionSpread | None:
    """Return by how much friction differs from run to run; None where that is not known."""
    shares = next((finding.steadied.shares for finding in findings if finding.name == "torque"), {})
    return document.FrictionSpread(dry=shares.get("dry"), viscous=shares.get("viscous")) if shares else None


def _sizes(finding: ChannelFinding) -> list[document.Size]:
    judged = finding.held_out.rows.sum(axis=0)
    return [
        document.Size(
            rmse=float(rmse),
            noise_floor=None if finding.floor is None else float(finding.floor[k]),
            excess=None if finding.excess is None or not judged[k] else float(finding.excess[k]),
        )
        for k, rmse in enumerate(finding.rmse)
    ]


def cause(
    robot: Robot,
    finding: ChannelFinding,
    found_cause: FoundCause,
    name: str,
    scale: FittedTorqueScale | None,
    limits: Criterion,
) -> document.Cause:
    """Return a cause, `name` its id, with its parameters and evidence."""
    return document.Cause(
        id=name,
        effect=found_cause.effect,
        joints=found_cause.touched(robot),
        scope=found_cause.scope,
        confidence=found_cause.probability,
        parameters=parameters(robot, finding, found_cause, scale),
        indistinguishable_from=found_cause.not_told_from(limits.unknown),
        evidence=_evidence(finding, found_cause),
    )


def doubted(cause: document.Cause, limits: Criterion) -> document.Cause:
    """Return a cause that an effect which is none of the catalogue's may stand behind, as sure as that leaves it."""
    part = (1 - limits.unknown_there) / (1 - limits.unknown)
    rivals = {rival: part * chance for rival, chance in cause.evidence.probability_of_rivals.items()}
    evidence = replace(cause.evidence, probability_of_rivals=rivals)
    return replace(cause, confidence=part * cause.confidence, evidence=evidence)


def closing_nothing(findings: Sequence[document.Finding]) -> set[str]:
    """Return the ids of causes that are little, and of which left out groups do not say that they close anything."""
    return {
        cause
        for finding in findings
        if not finding.matters and finding.share_interval95[0] <= 0
        for cause in finding.causes
    }


def findings(
    robot: Robot,
    channels: Sequence[ChannelFinding],
    ids_of: Mapping[int, str],
    causes: Sequence[document.Cause],
    limits: Matters,
) -> tuple[document.Finding, ...]:
    """Return the causes as a tree, the branch that closes most first; `ids_of`: the id of each, by its object's."""
    of_all = [(channel, branch) for channel in channels for branch in branches(channel)]
    of_all.sort(key=lambda pair: -pair[1].closing.size)
    written = {cause.id: cause for cause in causes}
    own_of_all = [[written[ids_of[id(each)]] for each in branch.causes] for _, branch in of_all]
    joints = [_joints(robot, of_branch) for of_branch in own_of_all]
    ids = cause_ids([(branch.family, on) for (_, branch), on in zip(of_all, joints, strict=True)], robot.joint_names)
    findings = []
    for (channel, branch), of_branch, on, name in zip(of_all, own_of_all, joints, ids, strict=True):
        members = [_members(cause) for cause in of_branch]
        classes = [sum(member.confidence for member in some) for some in members]
        of_family = [sum(member.confidence for member in some if member.family == branch.family) for some in members]
        findings.append(
            document.Finding(
                id=name,
                family=branch.family,
                joints=on,
                scope=branch.scope,
                channel=channel.name,
                confidence=max(of_family),
                share=branch.closing.share,
                share_interval95=branch.closing.interval,
                share_of=branch.closing.share_of,
                matters=branch.closing.matters(limits, likely=max(classes) >= document.LIKELY)
                or (branch.closing.interval[0] > 0 and any(number_is_off(cause, limits) for cause in of_branch)),
                members=tuple(member for some in members for member in some),
            )
        )
    return tuple(findings)


def between_sides(
    findings: Sequence[document.Finding], channels: Sequence[ChannelFinding], ids_of: Mapping[int, str]
) -> tuple[document.Finding, ...]:
    """Return findings with their shares of what sets a simulator apart; `ids_of` as in `findings`.

    What the twin leaves of the simulator's own runs, too, is between no sides.
    """
    found = {ids_of[id(each)]: (channel, each) for channel in channels for each in channel.causes}
    told = []
    for finding in findings:
        own = [found[name] for name in finding.causes]
        if closed := own[0][0].closed_between([each for _, each in own]):
            finding = replace(finding, share=closed[0], share_interval95=closed[1], share_of=_APART)
        told.append(finding)
    return tuple(told)


def number_is_off(cause: document.Cause, limits: Matters) -> bool:
    """Return whether a likely cause has a number of the simulator's model that is off by much, and for sure.

    One joint's rotor can be a hundredth of the gap, and half of what it should be: who mends the model would miss it.
    """
    return cause.likely and any(
        number.simulator is not None and least_change(number) > limits.number * abs(number.simulator)
        for number in cause.parameters
    )


def least_change(number: document.CauseParameter) -> float:
    """Return the least magnitude of a change within its 95 % interval."""
    low, high = number.interval95 or (number.value, number.value)
    return max(low, -high, 0.0)


def folded(causes: Sequence[document.Cause], findings: Sequence[document.Finding]) -> tuple[document.Cause, ...]:
    """Return the causes, those marked that no finding that matters has: sure as they may be, no verdict counts them."""
    told = {cause for finding in findings if finding.matters for cause in finding.causes}
    return tuple(cause if cause.id in told else replace(cause, folded_away=True) for cause in causes)


def _joints(robot: Robot, causes: Sequence[document.Cause]) -> tuple[str, ...]:
    """Return the joints of the causes that are likely; of all, where none is."""
    told = [cause for cause in causes if cause.likely] or causes
    touched = {joint for cause in told for joint in cause.joints}
    return tuple(joint for joint in robot.joint_names if joint in touched)


def _members(cause: document.Cause) -> list[document.Member]:
    """Return a cause and what the data cannot tell from it."""
    rivals = {rival: cause.evidence.probability_of_rivals[rival] for rival in cause.indistinguishable_from}
    return [
        document.Member(cause=cause.id, effect=effect, family=catalogue()[effect].family, confidence=sure)
        for effect, sure in {cause.effect: cause.confidence, **rivals}.items()
    ]


def _evidence(finding: ChannelFinding, found_cause: FoundCause) -> document.Evidence:
    runs, window = acting(found_cause.variants) or (None, None)
    return document.Evidence(
        channel=finding.name,
        share_of_what_is_closed=finding.share(found_cause),
        closed_where_it_acts=finding.closed(found_cause),
        gain=found_cause.gain,
        log_odds=found_cause.log_odds,
        probability_of_rivals={rival: chance for rival, chance in found_cause.rivals.items() if chance >= _TOLD},
        runs=runs,
        window=window,
    )


def parameters(
    robot: Robot, finding: ChannelFinding, found_cause: FoundCause, scale: FittedTorqueScale | None
) -> tuple[document.CauseParameter, ...]:
    """Return a cause's parameters as the catalogue states them, with 95 % intervals that hold the torque's scale."""
    stated = [
        parameter(quantity if scale is None else scale.widened(quantity))
        for quantity in quantities(robot, finding, found_cause)
    ]
    if found_cause.of_bodies:  # most of a body's numbers do not show: those that do
        stated = [number for number in stated if number.interval95 and number.interval95[0] * number.interval95[1] > 0]
    return tuple(stated)


def torque_scale(scale: FittedTorqueScale) -> document.TorqueScale:
    """Return how sure the scale of torque is, and why."""
    return document.TorqueScale(
        uncertainty95=scale.uncertainty, source=scale.source, low=scale.low, high=scale.high, why=scale.why
    )


def shrink(
    robot: Robot,
    runs: Sequence[str],
    findings: Sequence[ChannelFinding],
    floor: Floor,
    energies: EnergyErrors | None,
    ids_of: Mapping[int, str],
    *,
    between: bool,
) -> document.Shrink:
    """Return how far the gap shrinks on runs that took no part in the fit; `ids_of` as in `findings`.

    What is closed of it together is left out where causes act in a channel whose floor nobody knows; it is of what lies
    `between` sides, or of what the twin leaves.
    """
    changes = {finding.name: _change(finding) for finding in findings}
    torque_too = any(finding.causes for finding in findings if finding.name == "torque")
    changed = [finding.name for finding in findings if finding.causes or (torque_too and finding.plain is not None)]
    return document.Shrink(
        held_out_runs=tuple(runs),
        noise_floor_from=floor.source,
        torque_rmse=changes.get("torque"),
        power_rmse=changes.get("power"),
        energy_error_percent=energies.change if energies else None,
        closed_fraction=fraction_closed(findings, changed, between=between),
        by_cause=tuple(
            _by_cause(robot, finding, each, ids_of[id(each)]) for finding in findings for each in finding.causes
        ),
    )


def fraction_closed(
    findings: Sequence[ChannelFinding], changed: Container[str], *, between: bool
) -> document.ClosedFraction | None:
    """Return what closes in the channels that are `changed`, whose floor is known; None as `shrink` leaves it out."""
    floors = [finding.floor_between if between else finding.floor for finding in findings]
    with_floor = [
        (finding.held_out, floor)
        for finding, floor in zip(findings, floors, strict=True)
        if floor is not None and finding.name in changed
    ]
    if not with_floor or any(finding.floor is None for finding in findings if finding.causes):
        return None
    closed = closed_fraction(with_floor)
    return closed and document.ClosedFraction(value=closed[0], interval95=closed[1])


def _change(finding: ChannelFinding) -> document.Change:
    judged = finding.held_out
    squares, rows = judged.after.sum(axis=1), judged.rows.sum(axis=1)
    after = float(squares.sum() / rows.sum())
    half = half_width(after, squares, rows, rows)
    return document.Change(
        before=float(np.sqrt(judged.before.sum() / rows.sum())),
        after=float(np.sqrt(after)),
        noise_floor=None if finding.floor is None else float(np.sqrt(np.mean(finding.floor**2))),
        interval95_after=(float(np.sqrt(max(after - half, 0.0))), float(np.sqrt(after + half))),
    )


def _by_cause(robot: Robot, finding: ChannelFinding, found_cause: FoundCause, name: str) -> document.CauseChange:
    """Return what a cause closes alone, and what is lost without it."""
    system, noise = finding.system, finding.system.noise_before
    alone = held_out(system, noise, noise, found_cause.columns)
    others = [k for other in finding.causes if other is not found_cause for k in other.columns]
    without = held_out(system, noise, finding.attribution.noise, others)
    return document.CauseChange(
        cause=name,
        effect=found_cause.effect,
        joints=found_cause.touched(robot),
        scope=found_cause.scope,
        channel=finding.name,
        share=finding.share(found_cause),
        rmse_before=numbers(alone.rmse(alone.before)),
        rmse_alone=numbers(alone.rmse(alone.after)),
        rmse_when_left_out=numbers(without.rmse(without.after)),
        rmse_with_all=numbers(finding.held_out.rmse(finding.held_out.after)),
    )


def numbers(values: np.ndarray) -> tuple[float, ...]:
    """Return (g,) values of equations as plain numbers."""
    return tuple(float(value) for value in values)


def parameter(quantity: Quantity) -> document.CauseParameter:
    """Return a quantity as the document has it."""
    ends = None if quantity.lower is None or quantity.upper is None else (quantity.lower, quantity.upper)
    return document.CauseParameter(
        name=quantity.name, joint=quantity.joint, value=quantity.value, unit=quantity.unit, interval95=ends
    )

"""Where the gap lies, over all channels: each channel's residual, held against its floor or the reference runs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from irtwin.effects.stack import Stack
from irtwin.gap.case import Case
from irtwin.gap.channels import Torque
from irtwin.gap.excess_map import Map, joint_maps, level_of, robot_maps
from irtwin.gap.finding import Finding
from irtwin.gap.follows import followed
from irtwin.gap.hypotheses import CHANGED
from irtwin.gap.locate import Location, locate, standing_out
from irtwin.gap.residuals import Trace, fitted_values, power_traces, torque_traces


@dataclass(frozen=True)
class Left:
    """What the twin left of one channel: the observed runs' traces and map, and the level (g, R) of a gap.

    `joints`: the names of the g places, None for the whole robot; `reference`: the map of the other runs, where the
    twin is the one that fits these.
    """

    channel: str
    joints: tuple[str | None, ...]
    traces: list[Trace]
    seen: Map
    reference: Map | None
    level: np.ndarray


def left_of_torque(case: Case, stack: Stack, finding: Finding, predicted: Torque, *, reference: bool) -> Left:
    """Return what the twin left of torque; `reference`: as it fits the runs beside the observed ones."""
    values = fitted_values(finding, reference=reference)
    traces = torque_traces(stack, case.seen, values, predicted)
    others = torque_traces(stack, case.others, values, predicted) if reference else []
    seen, known = joint_maps(traces, others, case.grouping.label)
    return Left("torque", stack.robot.joint_names, traces, seen, known, level_of(finding.floor, seen, known))


def left_of_power(case: Case, stack: Stack, finding: Finding, torque: Torque, *, reference: bool) -> Left:
    """Return what the twin left of power, given the joint torque."""
    values = fitted_values(finding, reference=reference)
    traces = power_traces(stack, case.seen, values, torque)
    others = power_traces(stack, case.others, values, torque) if reference else []
    seen, known = robot_maps(traces, others, case.grouping.label)
    return Left("power", (None,), traces, seen, known, level_of(finding.floor, seen, known))


def against_reference(finding: Finding) -> bool:
    """Return whether to hold the observed runs against the others: there are some, and the gap is not in both."""
    return finding.system.both and (not finding.causes or any(cause.scope == CHANGED for cause in finding.causes))


def places(left: Sequence[Left], first: str | None, seed: int) -> list[Location]:
    """Return the ranked places of the gap: of the channel `first`, else of that with the largest excess, first."""
    found = {one.channel: _places(one, seed) for one in left}

    def order(channel: str) -> tuple[bool, float]:
        return channel != first, -max((place.excess for place in found[channel]), default=0.0)

    return [place for channel in sorted(found, key=order) for place in found[channel]]


def _places(left: Left, seed: int) -> list[Location]:
    best = [followed(left.traces, None if joint is None else k) for k, joint in enumerate(left.joints)]
    follows = [found[0] if found else None for found in best]
    located = locate(left.channel, left.joints, follows, left.seen, left.level, left.reference, seed)
    return [replace(place, runs=_standing_out(left, place)) for place in located]


def _standing_out(left: Left, place: Location) -> tuple[str, ...]:
    k = left.joints.index(place.joint)
    return standing_out(left.traces, k, float(left.level[k].min()))

"""What a page draws of a diagnosis: the map of the gap, each cause's curve, and each run before and after."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from irtwin.effects.stack import Stack
from irtwin.gap.channels import Torque
from irtwin.gap.excess_map import heat_map
from irtwin.gap.explained import ExplainedTorque
from irtwin.gap.finding import Finding
from irtwin.gap.follows import curve, followed
from irtwin.gap.locate import Location
from irtwin.gap.residuals import Trace, as_filtered, torque_residual
from irtwin.gap.where import Left
from irtwin.signals.motion import Motion

Json = dict[str, Any]

_UNNAMED = 3  # places that no cause explains, drawn


def drawn(
    findings: Sequence[Finding], left: Sequence[Left], places: Sequence[Location], curves: Sequence[Json]
) -> Json:
    """Return the arrays that a page draws; curves: those of causes, which come before what none explains."""
    found: Json = {"follows": [*curves], "runs": [line for finding in findings for line in _per_run(finding)]}
    for one in left:
        if one.channel == "torque":
            found["heat_map"] = heat_map(one.joints, one.seen, one.level)
    named = {line["joint"] for line in curves}
    found["follows"] += _unnamed(left, [place for place in places if place.joint not in named])
    return found


def cause_curves(stack: Stack, finding: Finding, motions: Sequence[Motion], predicted: Torque) -> list[Json]:
    """Return each torque cause's curve on the residual that all the others leave; motions: the observed ones."""
    joints = stack.robot.joint_names
    shown = [motion for motion in motions if motion.torque is not None]
    explained = ExplainedTorque(stack, finding, predicted)
    left = {motion.run: torque_residual(stack, motion, explained.values) for motion in shown}
    lines = []
    for cause in finding.causes:
        others = [other for other in finding.causes if other is not cause]
        added = [as_filtered(motion, explained.added(cause, motion)) for motion in shown]
        traces = []
        for motion in shown:
            rest = sum((explained.added(other, motion) for other in others), np.zeros(motion.dq.shape))
            traces.append(Trace(motion, left[motion.run] - as_filtered(motion, rest), predicted(motion)))
        alone = [Trace(trace.motion, part, trace.torque) for trace, part in zip(traces, added, strict=True)]
        for joint in cause.joints or joints:
            k = joints.index(joint)
            if best := followed(alone, k):
                lines.append({"joint": joint} | curve(traces, k, best[0], cause.effect, added))
    return lines


def _unnamed(left: Sequence[Left], places: Sequence[Location]) -> list[Json]:
    """Return the residual against what it follows, at the foremost joints of torque that no cause explains."""
    lines: list[Json] = []
    for one in left:
        for joint in list(dict.fromkeys(p.joint for p in places if p.channel == one.channel == "torque"))[:_UNNAMED]:
            k = one.joints.index(joint)
            if best := followed(one.traces, k):
                lines.append({"joint": joint} | curve(one.traces, k, best[0]))
    return lines


def _per_run(finding: Finding) -> list[Json]:
    judged = finding.held_out
    lines = []
    for group, runs in enumerate(finding.groups):
        for k, joint in enumerate(finding.places):
            rows = max(float(judged.rows[group, k]), 1.0)
            lines += [
                {
                    "run": run,
                    "joint": joint,
                    "before": float(np.sqrt(judged.before[group, k] / rows)),
                    "after": float(np.sqrt(judged.after[group, k] / rows)),
                    "floor": None if finding.floor is None else float(finding.floor[k]),
                }
                for run in runs
            ]
    return lines

"""What a page draws of a diagnosis: the map of the gap, each cause's curve, and each run before and after."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from irtwin.effects.stack import Stack
from irtwin.gap.channels import Torque
from irtwin.gap.explained import ExplainedTorque, residual
from irtwin.gap.finding import Finding, twin_values
from irtwin.gap.locate import Location, curves, heat_map, locate, locate_power
from irtwin.signals.motion import Motion


def where(
    findings: Sequence[Finding], stack: Stack, motions: Sequence[Motion], predicted: Torque | None
) -> tuple[list[Location], dict[str, Any]]:
    """Return the ranked locations of the gap, and the arrays that a page draws; motions are the observed ones."""
    joints = stack.robot.joint_names
    locations: list[Location] = []
    drawn: dict[str, Any] = {"follows": [], "runs": [line for f in findings for line in _per_run(f, joints)]}
    for finding in findings:
        if finding.name == "power":
            judged = finding.held_out
            locations.extend(locate_power(judged.before, judged.rows, finding.floor, finding.groups))
            continue
        assert predicted is not None
        noise = finding.rmse if finding.floor is None else finding.floor
        total = np.sum(finding.system.moments(finding.rmse), axis=0)
        plain = twin_values(finding.system, finding.system.solution((), total))
        with_torque = [motion for motion in motions if motion.torque is not None]
        residuals = [(motion, residual(stack, motion, plain)) for motion in with_torque]
        locations.extend(locate(joints, residuals, noise))
        drawn["heat_map"] = heat_map(joints, residuals, noise)
        drawn["follows"] += _curves(stack, finding, with_torque, predicted)
    return sorted(locations, key=lambda location: -location.share), drawn


def _curves(stack: Stack, finding: Finding, motions: Sequence[Motion], predicted: Torque) -> list[dict[str, Any]]:
    """Return each cause's curve on the residual that all the others leave."""
    joints = stack.robot.joint_names
    explained = ExplainedTorque(stack, finding, predicted)
    drawn = []
    for cause in finding.causes:
        others = [other for other in finding.causes if other is not cause]
        partial = [
            (
                motion,
                residual(stack, motion, explained.values)
                - sum((explained.added(other, motion) for other in others), np.zeros(motion.dq.shape)),
            )
            for motion in motions
        ]
        added = [explained.added(cause, motion) for motion in motions]
        drawn += curves(cause.effect, cause.joints or joints, joints, partial, added)
    return drawn


def _per_run(finding: Finding, joints: Sequence[str]) -> list[dict[str, Any]]:
    judged = finding.held_out
    lines = []
    for group, runs in enumerate(finding.groups):
        for k in range(judged.rows.shape[1]):
            rows = max(float(judged.rows[group, k]), 1.0)
            lines += [
                {
                    "run": run,
                    "joint": joints[k] if finding.name == "torque" else None,
                    "before": float(np.sqrt(judged.before[group, k] / rows)),
                    "after": float(np.sqrt(judged.after[group, k] / rows)),
                    "floor": None if finding.floor is None else float(finding.floor[k]),
                }
                for run in runs
            ]
    return lines

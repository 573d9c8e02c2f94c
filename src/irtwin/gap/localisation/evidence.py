"""What a page draws of a diagnosis: the map of the gap, each cause's curve, and each run before and after."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from irtwin.gap.isolation.finding import Finding
from irtwin.gap.localisation.channel_residuals import ChannelResidual, cause_curves, unnamed_curves
from irtwin.gap.localisation.excess_map import heat_map
from irtwin.gap.localisation.locations import Location

_UNNAMED = 3  # places that no cause explains, drawn


def drawn(left: Sequence[ChannelResidual], located: Sequence[Location]) -> dict[str, Any]:
    """Return the arrays that a page draws of what the twin left of each channel, and of where that lies."""
    found: dict[str, Any] = {
        "follows": cause_curves(left) + unnamed_curves(left, located, _UNNAMED),
        "runs": [line for one in left for line in _per_run(one.finding)],
    }
    for one in left:
        if one.finding.name == "torque":
            found["heat_map"] = heat_map(one.finding.places, one.seen, one.level)
    return found


def _per_run(finding: Finding) -> list[dict[str, Any]]:
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

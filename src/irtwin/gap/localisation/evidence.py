"""What a page draws of a diagnosis: the map of the gap, each cause's curve, and each run before and after."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from irtwin.document.curves import Curves, FrictionCurve, PlannedMotion, RunError
from irtwin.gap.isolation.finding import Finding
from irtwin.gap.localisation.channel_residuals import ChannelResidual, cause_curves, unnamed_curves
from irtwin.gap.localisation.excess_map import heat_map
from irtwin.gap.localisation.locations import Location

_UNNAMED = 3  # places that no cause explains, drawn


def drawn(
    left: Sequence[ChannelResidual],
    located: Sequence[Location],
    planned: PlannedMotion | None,
    friction: tuple[FrictionCurve, ...],
) -> Curves:
    """Return what a page draws: of what the twin left of each channel, where that lies, what is planned, friction."""
    maps = [
        heat_map([joint for joint in one.finding.places if joint is not None], one.seen, one.level)
        for one in left
        if one.finding.name == "torque"
    ]
    return Curves(
        follows=(*cause_curves(left), *unnamed_curves(left, located, _UNNAMED)),
        runs=tuple(line for one in left for line in _per_run(one.finding)),
        heat_map=next(iter(maps), None),
        experiment=planned,
        friction=friction or None,
    )


def _per_run(finding: Finding) -> Iterator[RunError]:
    judged = finding.held_out
    for group, runs in enumerate(finding.groups):
        for k, joint in enumerate(finding.places):
            rows = max(float(judged.rows[group, k]), 1.0)
            for run in runs:
                yield RunError(
                    run=run,
                    joint=joint,
                    before=float(np.sqrt(judged.before[group, k] / rows)),
                    after=float(np.sqrt(judged.after[group, k] / rows)),
                    floor=None if finding.floor is None else float(finding.floor[k]),
                )

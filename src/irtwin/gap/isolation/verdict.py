"""The verdict: whether there is a gap, and whether anything explains it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from irtwin.gap.data.noise_floor import REPEATS, Floor
from irtwin.gap.isolation.branches import branches
from irtwin.gap.isolation.finding import Finding
from irtwin.gap.regression.normal_equations import noise_before, reference_rms
from irtwin.gap.repeats.disturbances import Disturbance
from irtwin.gap.thresholds import Thresholds

NO_GAP, ATTRIBUTED, AMBIGUOUS, UNEXPLAINED = "no_gap", "attributed", "ambiguous", "unexplained"


def verdict_of(findings: Sequence[Finding], floor: Floor, limits: Thresholds, *, unmatched: bool = False) -> str:
    """Return the verdict on all channels: `unexplained` where much of an excess is left at any place, named or not.

    Causes that close nothing that matters make no gap. `unmatched`: a cause that cannot be true explains the data far
    better than those that were named instead.
    """
    if unmatched:
        return UNEXPLAINED
    causes = [
        cause
        for finding in findings
        for branch in branches(finding)
        if branch.closing.matters(limits.matters)
        for cause in branch.causes
    ]
    if floor.source == REPEATS:
        before, after = max((_largest(finding) for finding in findings), default=(0.0, 0.0))
        if after > max(limits.verdict.excess, (1 - limits.verdict.closed) * before):
            return UNEXPLAINED
    if not causes:
        return NO_GAP
    return AMBIGUOUS if any(cause.rivals for cause in causes) else ATTRIBUTED


def beside(verdict: str, found: Sequence[Disturbance], explained: Sequence[Disturbance]) -> str:
    """Return the verdict beside what differs between repeats, the largest share first: where there is any, a gap is.

    It is `attributed` where effects explain the largest of it, `unexplained` where that is located only.
    """
    if verdict != NO_GAP or not found:
        return verdict
    return ATTRIBUTED if any(found[0] is one for one in explained) else UNEXPLAINED


def _largest(finding: Finding) -> tuple[float, float]:
    """Return the largest excess of a channel's equations without causes, and the largest that these leave.

    Over the floor, and over what the reference runs show, if there are any. The two may lie at different joints.
    """
    if finding.floor is None:
        return 0.0, 0.0
    level = finding.floor
    if finding.system.both:
        level = np.maximum(level, reference_rms(finding.system, noise_before(finding.system)))
    before, after = ((rms / level) ** 2 - 1 for rms in finding.fitted)
    return float(before.max()), float(after.max())

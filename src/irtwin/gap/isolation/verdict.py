"""The verdict: whether there is a gap, and whether anything explains it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from irtwin.gap.data.noise_floor import REPEATS, Floor
from irtwin.gap.isolation.finding import Finding
from irtwin.gap.regression.normal_equations import noise_before, reference_rms
from irtwin.gap.thresholds import Verdict

NO_GAP, ATTRIBUTED, AMBIGUOUS, UNEXPLAINED = "no_gap", "attributed", "ambiguous", "unexplained"


def verdict_of(findings: Sequence[Finding], floor: Floor, limits: Verdict, *, unmatched: bool = False) -> str:
    """Return the verdict on all channels: `unexplained` where much of an excess is left at any place, named or not.

    `unmatched`: a cause that cannot be true explains the data far better than those that were named instead.
    """
    if unmatched:
        return UNEXPLAINED
    causes = [cause for finding in findings for cause in finding.causes]
    if floor.source == REPEATS:
        before, after = max((_largest(finding) for finding in findings), default=(0.0, 0.0))
        if after > max(limits.excess, (1 - limits.closed) * before):
            return UNEXPLAINED
    if not causes:
        return NO_GAP
    return AMBIGUOUS if any(cause.rivals for cause in causes) else ATTRIBUTED


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

"""The verdict: whether there is a gap, and whether anything explains it.

First what is left of the gap, before anybody asks how sure a cause is; then, of causes with their confidence, the rest.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from irtwin.gap.data.noise_floor import REPEATS, Floor
from irtwin.gap.document import document
from irtwin.gap.isolation.branches import branches
from irtwin.gap.isolation.finding import Finding
from irtwin.gap.regression.normal_equations import noise_before, reference_rms
from irtwin.gap.repeats.disturbances import Disturbance
from irtwin.gap.thresholds import Thresholds, Verdict

NO_GAP, ATTRIBUTED, AMBIGUOUS, UNEXPLAINED = "no_gap", "attributed", "ambiguous", "unexplained"
MUCH_IS_LEFT, IMPOSSIBLE_NUMBER, DOES_NOT_REPEAT, UNSURE = (
    "much_is_left", "impossible_number", "does_not_repeat", "unsure",
)  # fmt: skip


def left_open(
    findings: Sequence[Finding],
    floor: Floor,
    limits: Thresholds,
    *,
    unmatched: bool = False,
    differing: Sequence[Disturbance] = (),
    explained: Sequence[Disturbance] = (),
) -> str | None:
    """Return why the gap stays unexplained, however sure its causes are; None where it does not.

    `unmatched`: a cause that cannot be true explains the data far better than those that were named instead.
    `differing`: what differs between repeats, the largest share first; `explained`: those of it that effects explain.
    """
    if unmatched:
        return IMPOSSIBLE_NUMBER
    if floor.source == REPEATS:
        before, after = max((_largest(finding) for finding in findings), default=(0.0, 0.0))
        if after > max(limits.verdict.excess, (1 - limits.verdict.closed) * before):
            return MUCH_IS_LEFT
    named = any(branch.closing.matters(limits.matters) for finding in findings for branch in branches(finding))
    if differing and not named and not any(differing[0] is one for one in explained):
        return DOES_NOT_REPEAT
    return None


def verdict_of(findings: Sequence[document.Finding], limits: Verdict) -> str:
    """Return the verdict on a gap that is not left open: `unexplained` where no cause that matters is likely.

    A cause is likely where it is, or one of the effects that the data cannot tell from it.
    """
    classes: dict[str, list[float]] = {}
    for member in (one for finding in findings if finding.matters for one in finding.members):
        classes.setdefault(member.cause, []).append(member.confidence)
    if not classes:
        return NO_GAP
    likely = [sure for sure in classes.values() if sum(sure) >= limits.likely]
    if not likely:
        return UNEXPLAINED
    return AMBIGUOUS if any(len(sure) > 1 for sure in likely) else ATTRIBUTED


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

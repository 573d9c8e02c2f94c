"""The verdict: whether there is a gap, and whether anything explains it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from irtwin.gap.finding import Finding
from irtwin.gap.floor import REPEATS, Floor

NO_GAP, ATTRIBUTED, AMBIGUOUS, UNEXPLAINED = "no_gap", "attributed", "ambiguous", "unexplained"
_EXCESS = 3.0  # over a floor from repeats: a gap, though nothing explains it; below lies what differs between runs
_STEADY = 0.75  # of the groups have to show it


def verdict_of(findings: Sequence[Finding], floor: Floor) -> str:
    """Return the verdict on all channels."""
    causes = [cause for finding in findings for cause in finding.causes]
    if causes:
        return AMBIGUOUS if any(cause.rivals for cause in causes) else ATTRIBUTED
    return UNEXPLAINED if any(_above(finding, floor) for finding in findings) else NO_GAP


def _above(finding: Finding, floor: Floor) -> bool:
    """Return whether a gap is there: above a floor from repeats, and above what the reference runs show, if any."""
    if finding.floor is None or floor.source != REPEATS:
        return False
    system, judged = finding.system, finding.held_out
    level = finding.floor
    if system.both:
        groups = np.flatnonzero(~system.group_observed)
        vector = system.solution((), np.sum(system.moments(finding.rmse), axis=0))
        squares = np.sum([system.squares(vector, int(group)) for group in groups], axis=0)
        level = np.maximum(level, np.sqrt(squares / np.maximum(system.rows[groups].sum(axis=0), 1)))
    above = judged.before / np.maximum(judged.rows, 1) / level**2 - 1 > _EXCESS
    return bool(np.any(above.mean(axis=0) >= _STEADY))

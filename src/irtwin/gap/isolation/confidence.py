"""How sure a cause is, from its evidence."""

from __future__ import annotations

import math

from irtwin.gap.thresholds import Confidence


def confidence(
    t: float, gain: float, closed: float, share: float, count: int, weights: Confidence, *, unexplained: bool
) -> float:
    """Return the chance that a cause is right.

    t: of its gain, between groups of runs; gain: of weighted squares, a row; closed: the part of the gap that all
    causes close where it acts, 0 to 1; share: its gain over that of the largest cause, above 0 to 1; count: of all
    causes; `unexplained`: the verdict on all causes together.
    """
    logit = weights.constant + weights.per_t * min(max(t, 0.0), weights.most_t) + weights.per_closed * closed
    logit += (
        weights.per_gain * math.log(min(max(gain, weights.least_gain), 1.0))
        + weights.per_share * math.log(share)
        + weights.per_count * math.log(count)
    )
    return 1 / (1 + math.exp(-logit - weights.unexplained * unexplained))

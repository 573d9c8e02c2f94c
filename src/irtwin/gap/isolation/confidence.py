"""How sure a cause is, from its evidence."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from irtwin.gap.thresholds import Confidence


def confidence(
    t: float, gain: float, closed: float, share: float, count: float, weights: Confidence, *, unexplained: bool
) -> float:
    """Return the chance that a cause is right.

    t: of its gain, between groups of runs; gain: of weighted squares, a row; closed: the part of the gap that all
    causes close where it acts, 0 to 1; share: its gain over that of the largest cause, above 0 to 1; count: of all
    causes, as `as_large_as` counts them; `unexplained`: what all leave together is a gap without a cause.
    """
    logit = weights.constant + weights.per_t * min(max(t, 0.0), weights.most_t) + weights.per_closed * closed
    logit += (
        weights.per_gain * math.log(min(max(gain, weights.least_gain), 1.0))
        + weights.per_share * math.log(share)
        + weights.per_count * math.log(count)
    )
    return 1 / (1 + math.exp(-logit - weights.unexplained * unexplained))


def as_large_as(gain: float, gains: Sequence[float]) -> float:
    """Return how many causes there are beside which one of this gain stands: lesser ones count in part.

    So crumbs do not unsay the cause that explains nearly everything, while it unsays them.
    """
    return sum(min(one / gain, 1.0) if gain > 0 else 1.0 for one in gains)


def where_runs_are_few(
    own: float, p: float | None, repeats: float | None, in_halves: Sequence[bool] | None, weights: Confidence
) -> float:
    """Return the chance that a cause is right where its own is `own` in a full set of runs.

    Two things more have to be true. It is no chance: of that a p tells at most 1 / (1 - e p ln p), at even odds
    (Sellke, Bayarri and Berger 2001). And it is there all the time: as the part of it that `repeats`, and with even
    odds at most where one of the halves does not show it by itself. None: not judged.
    """
    if p is not None:
        own *= _beyond_chance(p)
    if repeats is not None:
        own *= max(repeats, weights.least_of_repeats)
    return own if in_halves is None or all(in_halves) else own * weights.not_in_each_half


def _beyond_chance(p: float) -> float:
    against = -math.e * p * math.log(p) if 0 < p < 1 / math.e else float(p > 0)
    return 1 / (1 + against)


def of_rivals(own: float, rivals: Sequence[str], gains: Mapping[str, float], weights: Confidence) -> dict[str, float]:
    """Return the chance of each effect that the data cannot tell from a cause, whose own is given.

    They share a part of what that leaves, by their `gains`; none is more likely than the cause.
    """
    gain = {rival: max(gains.get(rival, 0.0), 0.0) for rival in rivals}
    whole = sum(gain.values())
    return {
        rival: min(own, (1 - own) * weights.of_rivals * (gain[rival] / whole if whole > 0 else 1 / len(rivals)))
        for rival in rivals
    }


def of_family(members: Sequence[float], weights: Confidence) -> float:
    """Return the chance that a family is right: `members`, for each of its causes, that of it or a rival of the family.

    At least the largest of them: causes of one family mostly stand for one another, so they do not add up.
    """
    most = max(members)
    return most if most >= 1 else 1 / (1 + (1 - most) / most * math.exp(-weights.family_more)) if most > 0 else 0.0

"""Refusals: causes whose numbers cannot be true, and the search without them."""

from __future__ import annotations

from collections.abc import Callable, Set
from dataclasses import dataclass

import numpy as np

from irtwin.document.document import Refused
from irtwin.effects.effect import NORMAL, Possible, Quantity, Stated
from irtwin.gap.data.case import Case
from irtwin.gap.data.noise_floor import Floor
from irtwin.gap.isolation.cause import FoundCause
from irtwin.gap.isolation.finding import ChannelFinding, of_variant
from irtwin.gap.isolation.structure_search import Without
from irtwin.gap.regression.hypotheses import CHANGED, Variant, place_of
from irtwin.robot.description import Robot

_SEARCHES = 4  # a search without what was refused may name something else that cannot be


@dataclass(frozen=True)
class Refusals:
    """What was refused, and whether that which is named instead leaves far more: then nothing explains the data."""

    refused: tuple[Refused, ...] = ()
    unmatched: bool = False

    def __add__(self, other: Refusals) -> Refusals:
        return Refusals(self.refused + other.refused, self.unmatched or other.unmatched)


NOTHING_REFUSED = Refusals()


def find_possible(
    case: Case,
    search: Callable[[Set[Without]], tuple[ChannelFinding, Floor]],
    without: Set[Without] = frozenset(),
    before: Refusals = NOTHING_REFUSED,
) -> tuple[ChannelFinding, Floor, Refusals]:
    """Return what a search `without` some effects finds, where each cause can be true, and what was refused.

    What an earlier look at the channel refused, `before`, stays refused: each refusal costs a search.
    """
    refused = {_place(refusal): refusal for refusal in before.refused}
    least = np.inf
    for _ in range(_SEARCHES):
        finding, floor = search(without | refused.keys())
        least = np.minimum(least, finding.attribution.noise)
        wrong = [refusal for cause in finding.causes for refusal in _of(case.robot, finding, cause, case.stated)]
        if not wrong:
            break
        refused |= {_place(refusal): refusal for refusal in wrong}
    else:
        finding, floor = search(without | {effect for effect, _ in refused})
    if len(refused) == len(before.refused):
        return finding, floor, before
    more = (finding.attribution.noise / np.maximum(least, finding.system.quietest)) ** 2 - 1
    return finding, floor, Refusals(tuple(refused.values()), bool(more.max() > case.thresholds.criterion.excess))


def _place(refusal: Refused) -> tuple[str, str | None]:
    return refusal.effect, next(iter(refusal.joints), None)


def _of(robot: Robot, finding: ChannelFinding, cause: FoundCause, stated: Stated) -> list[Refused]:
    refused = []
    for number, variant in enumerate(cause.variants):
        joint = place_of(variant.terms[0]) if cause.joints else None
        limits = (variant.effect if joint is None else variant.effect.on(joint)).possible(robot, stated)
        fitted = of_variant(robot, finding, cause, number) if limits else []
        whys = [_beyond(quantity, limits[quantity.name]) for quantity in fitted if quantity.name in limits]
        if cause.scope == CHANGED:
            whys += [_below_nothing(finding, variant, place) for place in range(len(variant.columns))]
        if why := next(filter(None, whys), None):
            refused.append(Refused(effect=cause.effect, joints=() if joint is None else (joint,), why=why))
    return refused


def _beyond(quantity: Quantity, limits: Possible) -> str | None:
    """Say by how much a quantity misses what is possible; None where its interval reaches that."""
    if (
        quantity.lower is None
        or quantity.upper is None
        or (quantity.upper >= limits.low and quantity.lower <= limits.high)
    ):
        return None
    ends = [f"{end:.3g}" for end in (limits.low, limits.high) if np.isfinite(end)]
    side = "at least" if np.isfinite(limits.low) else "at most"
    allowed = " to ".join(ends) if len(ends) == 2 else f"{side} {ends[0]}"
    return f"{_value(quantity)}; {allowed} is possible: {limits.why}"


def _below_nothing(finding: ChannelFinding, variant: Variant, place: int) -> str | None:
    """Say where a change takes more off a coefficient than there was in the reference runs."""
    term, used, system = variant.terms[place], finding.used, finding.system
    key = (variant.effect.id, term.joint, term.link, term.name)
    before = [k for k, (e, t) in enumerate(system.terms) if (e.id, t.joint, t.link, t.name) == key and e.runs is None]
    if not before or not np.isfinite(term.lowest):
        return None
    pair, estimate = [before[0], used.index(variant.columns[place])], finding.estimate
    total = float(estimate.values[pair].sum())
    half = NORMAL * float(np.sqrt(max(estimate.covariance[np.ix_(pair, pair)].sum(), 0.0)))
    if total + half >= term.lowest:
        return None
    left = Quantity(term.name, term.joint, total, term.unit, total - half, total + half)
    return f"{_value(left)} would be left of it; at least {term.lowest:g} is possible"


def _value(quantity: Quantity) -> str:
    unit = "" if quantity.unit == "1" else f" {quantity.unit}"
    return f"{quantity.name} = {quantity.value:.3g}{unit} ({quantity.lower:.3g} to {quantity.upper:.3g})"

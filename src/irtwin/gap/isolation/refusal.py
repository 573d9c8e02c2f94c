"""Refusals: causes whose numbers cannot be true, and the search without them."""

from __future__ import annotations

from collections.abc import Callable, Sequence, Set
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
    """What was refused, and whether that which is named instead leaves far more: then nothing explains the data.

    `least` (g,): the noise that the best of all searches leaves, whether or not it can be true.
    """

    refused: tuple[Refused, ...] = ()
    unmatched: bool = False
    least: np.ndarray | None = None

    @property
    def places(self) -> dict[tuple[str, str | None], Refused]:
        """What was refused, by effect and joint."""
        return {(refusal.effect, next(iter(refusal.joints), None)): refusal for refusal in self.refused}

    def __add__(self, other: Refusals) -> Refusals:
        return Refusals(self.refused + other.refused, self.unmatched or other.unmatched)

    def beside(self, wrong: Sequence[Refused], finding: ChannelFinding, excess: float) -> Refusals:
        """Return these and what is `wrong` of a finding, and whether that leaves more than the best by `excess`."""
        noise = finding.attribution.noise
        least = noise if self.least is None else np.minimum(self.least, noise)
        more = (noise / np.maximum(least, finding.system.quietest)) ** 2 - 1
        return Refusals((*self.refused, *wrong), bool(more.max() > excess), least)


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
    refusals = before
    for _ in range(_SEARCHES):
        finding, floor = search(without | refusals.places.keys())
        wrong = [refusal for cause in finding.causes for refusal in _of(case.robot, finding, cause, case.stated)]
        refusals = refusals.beside(wrong, finding, case.thresholds.criterion.excess)
        if not wrong:
            return finding, floor, refusals
    finding, floor = search(without | {effect for effect, _ in refusals.places})
    return finding, floor, refusals.beside([], finding, case.thresholds.criterion.excess)


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

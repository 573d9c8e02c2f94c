"""What a search that is repeated tries: the shapes of effects that the data spoke for in the search before."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Self

import numpy as np

from irtwin.effects.effect import Effect
from irtwin.gap.isolation.posterior import SILENT, Posterior
from irtwin.gap.regression.hypotheses import Hypothesis, Place, Variant

_BEHIND = 10.0  # of log odds: so far behind the likeliest shape of a look, one is nobody's rival

Tried = tuple[Sequence[Effect], Sequence[Effect]]
"""Effects on torque, and on power, that a search tries."""


@dataclass(frozen=True)
class Shortlist:
    """Of the shapes that searches `tried`, wherever, those `kept`; `counts`: how many each hypothesis had, by place.

    Kept is what some look spoke for, and of nothing much more, beside whatever had been found then. Of each hypothesis
    one shape is kept at least, so that none is missing, and what was tried is paid for.
    """

    tried: frozenset[Effect] = frozenset()
    kept: frozenset[Effect] = frozenset()
    counts: Mapping[Place, int] = field(default_factory=dict)

    @classmethod
    def of(cls, looks: Sequence[Posterior], hypotheses: Sequence[Hypothesis], before: Self) -> Self:
        """Take it from the looks of a search at its hypotheses, the first at all of them, after those `before`."""
        kept = {_anywhere(variant.effect) for look in looks for variant in _spoken_for(look)}
        first = looks[0]
        by_odds = [first.evidence.variants[k].effect for k in np.argsort(-first.spoken)]
        likeliest = list(dict.fromkeys(map(_anywhere, by_odds)))
        shapes = {h.place: {_anywhere(variant.effect) for variant in h.variants} for h in hypotheses}
        for own in shapes.values():
            if kept.isdisjoint(own):  # the same of all joints, if they have it: columns are worked out together
                kept.add(next(shape for shape in likeliest if shape in own))
        counts = {place: max(len(own), before.counts.get(place, 0)) for place, own in shapes.items()}
        return cls(before.tried.union(*shapes.values()), frozenset(kept), {**before.counts, **counts})

    def among(self, effects: Iterable[Effect]) -> list[Effect]:
        """Return the effects that are worth trying: those kept, and those that were not tried."""
        dropped = self.tried - self.kept
        return [effect for effect in effects if _anywhere(effect) not in dropped]

    def among_both(self, tried: Tried) -> Tried:
        """Do as `among` does, of torque and of power."""
        return self.among(tried[0]), self.among(tried[1])


NO_SEARCH = Shortlist()


def _spoken_for(look: Posterior) -> Iterator[Variant]:
    least = max(SILENT, float(look.spoken.max(initial=0.0)) - _BEHIND)
    return (look.evidence.variants[k] for k in np.flatnonzero(look.spoken > least))


def _anywhere(effect: Effect) -> Effect:
    return replace(effect, joints=None)

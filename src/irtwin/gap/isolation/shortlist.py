"""What a search that is repeated tries: the shapes of effects that the data spoke for in the search before."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Self

import numpy as np

from irtwin.effects.effect import Effect
from irtwin.gap.isolation.posterior import Posterior
from irtwin.gap.regression.hypotheses import Hypothesis

_SILENT = 0.1  # of log odds: data that say less of a shape say nothing
_BEHIND = 10.0  # of log odds: so far behind the likeliest shape of a look, one is nobody's rival

Place = tuple[str, str, str | None]  # as `Hypothesis.place`


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
    def of(cls, looks: Iterable[Posterior], hypotheses: Sequence[Hypothesis], before: Self) -> Self:
        """Take it from the looks of a search at some of its hypotheses, after those `before`."""
        told: dict[Place, dict[Effect, float]] = {
            hypothesis.place: {_anywhere(variant.effect): -np.inf for variant in hypothesis.variants}
            for hypothesis in hypotheses
        }
        kept = set[Effect]()
        for look in looks:
            least = max(_SILENT, float(look.spoken.max(initial=0.0)) - _BEHIND)
            for variant, owner, odds in zip(look.evidence.variants, look.owner, look.spoken.tolist(), strict=True):
                own, shape = told[look.hypotheses[owner].place], _anywhere(variant.effect)
                own[shape] = max(own[shape], odds)
                if odds > least:
                    kept.add(shape)
        best: dict[str, dict[Effect, float]] = {}
        for (effect, *_), own in told.items():
            for shape, odds in own.items():
                of_effect = best.setdefault(effect, {})
                of_effect[shape] = max(of_effect.get(shape, -np.inf), odds)
        for (effect, *_), own in told.items():
            if kept.isdisjoint(own):
                kept.add(max(own, key=lambda shape, all_joints=best[effect]: all_joints[shape]))  # type: ignore[misc]
        counts = {place: max(len(own), before.counts.get(place, 0)) for place, own in told.items()}
        return cls(before.tried.union(*told.values()), frozenset(kept), {**before.counts, **counts})

    def among(self, effects: Iterable[Effect]) -> list[Effect]:
        """Return the effects that are worth trying: those kept, and those that were not tried."""
        dropped = self.tried - self.kept
        return [effect for effect in effects if _anywhere(effect) not in dropped]


NO_SEARCH = Shortlist()


def _anywhere(effect: Effect) -> Effect:
    return replace(effect, joints=None)

"""The search for the likeliest structure: which effects, at which joints, explain what the twin leaves."""

from __future__ import annotations

from collections.abc import Sequence, Set
from dataclasses import dataclass, field, replace
from itertools import chain, combinations, repeat

import numpy as np

from irtwin.gap.isolation.cause import FoundCause
from irtwin.gap.isolation.posterior import SILENT, HypothesisPrior, Posterior, overlap
from irtwin.gap.isolation.shortlist import NO_SEARCH, Shortlist
from irtwin.gap.regression.hypotheses import Hypothesis, Variant, in_scope
from irtwin.gap.regression.normal_equations import System
from irtwin.gap.regression.projection import Projection
from irtwin.gap.thresholds import Criterion
from irtwin.identification.progress import track

_MOST = 16  # hypotheses of a structure
_HOPELESS = -4.0  # log odds: what has less is not tried further
_KEPT = 2  # projections, each by another noise: a look by what is left, and one back
_SWEEPS = 3  # over a structure, each of its hypotheses looked for anew

Member = tuple[Hypothesis, Variant]
Without = str | tuple[str, str | None]
"""What a search is not to name: an effect, or an effect at a joint (None: of the whole robot)."""


@dataclass(frozen=True)
class Attribution:
    """The causes found, ranked by gain; `noise` (g,) what they leave; `visible` (H, 2) of each hypothesis before any:
    what it adds beyond what the twin imitates, as a mean square in units of the noise, and as a part of all it adds;
    `log_odds` (H,) that it is there beside the causes; `shortlist`: what to try where the search is repeated.
    """

    causes: tuple[FoundCause, ...]
    noise: np.ndarray
    hypotheses: tuple[Hypothesis, ...]
    visible: np.ndarray
    log_odds: np.ndarray
    shortlist: Shortlist = NO_SEARCH


def attribute(
    system: System,
    candidates: Sequence[Hypothesis],
    limits: Criterion,
    floor: np.ndarray | None = None,
    without: Set[Without] = frozenset(),
    before: Shortlist = NO_SEARCH,
) -> Attribution:
    """Find the effects that the data show beyond the twin's: the likeliest structure, and how sure each of it is.

    Hypotheses are added one by one, everything refitted; what is less likely than nothing is dropped; then each in turn
    is taken out and looked for anew, and so are two of one joint together. floor: (g,) RMS, 0 or None where unknown;
    what is tried `without` some effects, or in few shapes as a search `before` says, is no likelier for that.
    """
    every = in_scope(candidates, both=system.both)
    candidates = [
        candidate for candidate in every if not {candidate.effect, (candidate.effect, candidate.joint)} & without
    ]
    search = _Search(system, candidates, HypothesisPrior.of(every, before.counts), limits, floor)
    noise = np.ones(len(system.pattern))
    for _ in track(range(2), "looks at what the twin leaves"):
        noise = system.residual_rms((), noise)
    first = search.beside((), noise)
    shapes = [first.variant(place) for place in range(len(first.hypotheses))]
    visible = search.projection(noise).visible(shapes)
    structure, noise = search.settled(*search.pruned(*search.forward(first, noise)))
    structure, noise = search.likeliest(*search.pruned(*search.paired(structure, noise)))
    after = search.beside(structure, noise)
    odds = {hypothesis.place: float(after.log_odds[k]) for k, hypothesis in enumerate(after.hypotheses)}
    # what was found is at no place twice
    beside = np.array([odds.get(candidate.place, -np.inf) for candidate in candidates])
    named = [k for k, candidate in enumerate(candidates) if not candidate.nuisance]
    hypotheses = tuple(candidates[k] for k in named)
    causes = search.causes(structure, noise)
    shortlist = Shortlist.of([first, *search.tried.values()], candidates, before)
    return Attribution(causes, noise, hypotheses, visible[named], beside[named], shortlist)


def judged(
    system: System,
    structure: Sequence[Hypothesis],
    candidates: Sequence[Hypothesis],
    limits: Criterion,
    floor: np.ndarray | None,
    noise: np.ndarray,
) -> tuple[FoundCause, ...]:
    """Return the causes of a structure, hypotheses of one shape each, as sure as a system makes them among candidates.

    floor, noise: (g,) RMS, 0 or None where unknown, and what the structure leaves.
    """
    search = _Search(system, candidates, HypothesisPrior.of(candidates), limits, floor)
    return search.causes([(hypothesis, hypothesis.variants[0]) for hypothesis in structure], noise)


@dataclass(frozen=True)
class _Search:
    """The search on one system; floor: (g,) RMS."""

    system: System
    candidates: Sequence[Hypothesis]
    prior: HypothesisPrior
    limits: Criterion
    floor: np.ndarray | None
    tried: dict[tuple[object, ...], Posterior] = field(default_factory=dict)
    leaves: dict[tuple[tuple[int, ...], bytes], np.ndarray] = field(default_factory=dict)
    bounded: dict[tuple[tuple[int, ...], bytes], list[int]] = field(default_factory=dict)
    projections: dict[bytes, Projection] = field(default_factory=dict)  # by the noise of the last looks

    def beside(self, structure: Sequence[Member], noise: np.ndarray) -> Posterior:
        """Try what may stand beside a structure, once; equations are weighed by `noise` (g,)."""
        asked = np.sort(_columns(structure)).tobytes(), noise.tobytes()
        if asked not in self.tried:
            self.tried[asked] = self._beside(structure, noise)
        return self.tried[asked]

    def instead(
        self, member: Member, structure: Sequence[Member], noise: np.ndarray, *, bounded: bool = False
    ) -> Posterior:
        """Try what may stand in the place of one hypothesis of a structure, beside the others, once.

        `bounded`: the others without columns of nuisances that would be below their bounds.
        """
        rest = [other for other in structure if other is not member]
        columns = self.fitted(rest, noise) if bounded else sorted(_columns(rest))
        asked = np.sort(_columns(rest)).tobytes(), np.array(columns).tobytes(), noise.tobytes(), member[0].place
        if asked not in self.tried:
            near = [candidate for candidate in self.candidates if overlap(candidate, member[0])]
            self.tried[asked] = self._beside(rest, noise, near, columns)
        return self.tried[asked]

    def _beside(
        self,
        structure: Sequence[Member],
        noise: np.ndarray,
        some: Sequence[Hypothesis] | None = None,
        columns: Sequence[int] | None = None,
    ) -> Posterior:
        """Try all candidates, or some of them, beside a structure, or those `columns` of it."""
        taken = set(_columns(structure))
        left = [
            candidate
            for candidate in (self.candidates if some is None else some)
            if not any(set(variant.columns) & taken for variant in candidate.variants)
            and not any(_same_place(candidate, member) for member, _ in structure)
        ]
        found = [hypothesis for hypothesis, _ in structure], _columns(structure) if columns is None else columns
        misfit = self.misfit(noise, noise), self.misfit(noise, self.left(structure, noise))
        return Posterior.beside(self.projection(noise), found, left, self.prior, self.limits, misfit)

    def fitted(self, structure: Sequence[Member], noise: np.ndarray) -> list[int]:
        """Return the columns of a structure, in order, without those of nuisances that would be below their bounds."""
        columns = sorted(_columns(structure))
        if not any(hypothesis.nuisance for hypothesis, _ in structure):
            return columns
        asked = tuple(columns), noise.tobytes()
        if asked not in self.bounded:
            self.bounded[asked] = self.system.within_bounds(columns, noise)
        return self.bounded[asked]

    def projection(self, noise: np.ndarray) -> Projection:
        """Return what the twin leaves of all variants by `noise`; most looks are by that of the two looks before."""
        asked = noise.tobytes()
        projection = self.projections.pop(asked, None)
        if len(self.projections) == _KEPT:
            del self.projections[next(iter(self.projections))]
        if projection is None:
            projection = Projection(
                self.system, noise, [shape for candidate in self.candidates for shape in candidate.variants]
            )
        self.projections[asked] = projection
        return projection

    def misfit(self, noise: np.ndarray, turning: np.ndarray) -> np.ndarray:
        """Return (g,) the misfit along any effect, squared, as a part of the mean square that is left, `noise`.

        It is larger by what no floor explains, and where dry friction turns by all that is left beyond other rows by
        the noise `turning`: of an effect about reversals that is what it leaves itself, of others what is left without
        them, as what the unknown law of friction leaves is not theirs to explain.
        """
        limits, floor = self.limits, np.zeros_like(noise) if self.floor is None else self.floor
        unexplained = 1 - np.minimum((1 + limits.excess) * (floor / noise) ** 2, 1.0)
        misfit = limits.misfit**2 + limits.misfit_unexplained**2 * unexplained
        fast = turning[self.system.halves[0]]
        for half in self.system.halves[1:]:
            misfit[half] += 1 - np.minimum(fast / turning[half], 1.0) ** 2
        return np.asarray(misfit)

    def forward(self, posterior: Posterior, noise: np.ndarray) -> tuple[list[Member], np.ndarray]:
        """Add what explains most while that is not hopeless; return it and what it leaves, (g,).

        Two effects of one joint hide each other: neither is likely until both are there.
        """
        structure: list[Member] = []
        for _ in track(range(_MOST), f"{len(self.candidates)} hypotheses tried for the next cause"):
            if (member := self.likely(posterior, structure, noise, _HOPELESS)) is None:
                break
            structure.append(member)
            noise = self.left(structure, noise)
            posterior = self.beside(structure, noise)
        return structure, noise

    def likely(
        self, posterior: Posterior, structure: Sequence[Member], noise: np.ndarray, least: float = 0.0
    ) -> Member | None:
        """Return what explains most beside a structure, or is likelier in its place; None below the `least` log odds.

        All are judged by what the first leaves: noise that holds its own effect would hide it. Where that is hopeless,
        what explains less may be likely. What the data speak against is not tried, nor what they say nothing of: it
        would hide others.
        """
        for member, enough in zip(posterior.promising(least), chain([least], repeat(0.0)), strict=False):
            judged = self.beside(structure, self.left([*structure, member], noise))
            place = judged.likeliest_at(member[0])
            if judged.log_odds[place] > max(enough, judged.log_prior[place] + SILENT):
                return judged.hypotheses[place], judged.variant(place)
        return None

    def pruned(self, structure: list[Member], noise: np.ndarray) -> tuple[list[Member], np.ndarray]:
        """Drop what is less likely than nothing beside the others, the least likely first."""
        while structure:
            odds = [self.odds(member, structure, noise) for member in track(structure, "whether each cause is needed")]
            worst = int(np.argmin(odds))
            if odds[worst] > 0:
                break
            structure = [*structure[:worst], *structure[worst + 1 :]]
            noise = self.left(structure, noise)
        return structure, noise

    def odds(self, member: Member, structure: Sequence[Member], noise: np.ndarray) -> float:
        """Return the log odds of one hypothesis of a structure beside the others.

        Nuisances keep to their bounds: what they imitate beyond these would be dropped, and then the nuisance.
        """
        posterior = self.instead(member, structure, noise, bounded=True)
        return float(posterior.log_odds[posterior.index(member[0])])

    def settled(self, structure: list[Member], noise: np.ndarray) -> tuple[list[Member], np.ndarray]:
        """Take each hypothesis out and look for it anew: what came first may have stood for two still unknown."""
        for _ in range(_SWEEPS):
            before = list(structure)
            for member in track(before, "each cause taken out and looked for anew"):
                rest = [other for other in structure if other is not member]
                instead = self.likely(self.beside(rest, noise), rest, noise)
                structure = rest if instead is None else [*rest, instead]
            if sorted(_columns(structure)) == sorted(_columns(before)):
                break
            noise = self.left(structure, noise)
            if _places(structure) == _places(before):
                break
        return structure, noise

    def paired(self, structure: list[Member], noise: np.ndarray) -> tuple[list[Member], np.ndarray]:
        """Look anew for two effects of one joint together: what explains most by itself may be neither of them."""
        for _ in range(_SWEEPS):
            pairs = [(a, b) for a, b in combinations(structure, 2) if a[0].joint and a[0].joint == b[0].joint]
            for first, second in track(pairs, "two causes of one joint looked for anew"):
                rest = [member for member in structure if member is not first and member is not second]
                pair = self.likeliest_pair(rest, noise, first[0])
                if pair and _places(pair) != _places([first, second]):
                    break
            else:
                break
            before, structure = _places(structure), [*rest, *pair]
            structure, noise = self.settled(structure, self.left(structure, noise))
            if _places(structure) == before:
                break
        return structure, noise

    def likeliest(self, structure: list[Member], noise: np.ndarray) -> tuple[list[Member], np.ndarray]:
        """Put what is likelier in the place of one hypothesis there: it was judged by what fewer had left."""
        for _ in range(_SWEEPS):
            for place, member in enumerate(structure):
                posterior = self.instead(member, structure, noise)
                rival = posterior.likeliest_at(member[0])
                if posterior.log_odds[rival] > 0 and posterior.hypotheses[rival].place != member[0].place:
                    structure = [*structure]
                    structure[place] = posterior.hypotheses[rival], posterior.variant(rival)
                    noise = self.left(structure, noise)
                    break
            else:
                break
        return structure, noise

    def likeliest_pair(self, rest: Sequence[Member], noise: np.ndarray, like: Hypothesis) -> list[Member]:
        """Return the two likeliest hypotheses at the place of one, beside the rest of a structure.

        As in `Posterior.weights` each pair is judged by what it leaves of what the best explains.
        """
        pairs: list[list[Member]] = []
        explained, costs, scales = [], [], []
        there = [candidate for candidate in self.candidates if candidate.joint == like.joint]
        alone = self._beside(rest, noise, there)
        firsts = [(hypothesis, alone.variant(place)) for place, hypothesis in enumerate(alone.hypotheses)]
        self.projection(noise).prepare(_columns(firsts))
        for place, first in enumerate(firsts):
            beside = self._beside([*rest, first], noise, there)
            second = beside.explains_most()
            if second is not None:
                pairs.append([first, (beside.hypotheses[second], beside.variant(second))])
                explained.append(alone.explained(place) + beside.explained(second))
                costs.append(alone.cost(place) + beside.cost(second))
                scales.append(beside.scale(second))
        if not pairs:
            return []
        best = int(np.argmax(explained))
        behind = np.log1p((explained[best] - np.array(explained)) / scales[best])
        count = self.limits.certainty + len(_columns(pairs[best]))
        return pairs[int(np.argmax(-0.5 * count * behind - costs))]

    def left(self, structure: Sequence[Member], noise: np.ndarray) -> np.ndarray:
        """Return what a structure leaves of each equation, (g,) RMS; `noise` weighs the equations.

        Whichever way a structure was come by, it is the same to the last digit, and so are looks by it.
        """
        asked = tuple(sorted(_columns(structure))), noise.tobytes()
        if asked not in self.leaves:
            self.leaves[asked] = self.system.residual_rms(asked[0], noise)
        return self.leaves[asked]

    def causes(self, structure: Sequence[Member], noise: np.ndarray) -> tuple[FoundCause, ...]:
        """Join what was found of one effect and scope into causes, and rank them by what they explain."""
        parts: dict[tuple[str, str], list[FoundCause]] = {}
        for member in track(structure, "what could be in each cause's place"):
            parts.setdefault((member[0].effect, member[0].scope), []).append(
                _cause(member, self.instead(member, structure, noise))
            )
        return tuple(sorted(map(_joined, parts.values()), key=lambda cause: -cause.gain))


def _cause(member: Member, posterior: Posterior) -> FoundCause:
    """Return one hypothesis of a structure as a cause, with what could stand in its place.

    What the catalogue lacks could, too, and a nuisance: their part is no effect's.
    """
    hypothesis, variant = member
    own = posterior.index(hypothesis)
    near = posterior.near(hypothesis)
    weights, none = posterior.weights(near)
    whole = np.logaddexp.reduce([*weights, none]) - np.log1p(-posterior.limits.unknown)
    sure: dict[tuple[str, str], float] = {}
    for k, weight in zip(near, weights, strict=True):
        key = posterior.hypotheses[k].effect, posterior.hypotheses[k].scope
        sure[key] = sure.get(key, 0.0) + float(np.exp(weight - whole))
    probability = sure.pop((hypothesis.effect, hypothesis.scope))
    nameless = {candidate.effect for candidate in posterior.hypotheses if candidate.nuisance}
    rivals: dict[str, float] = {}
    for (effect, _), chance in sure.items():
        if effect not in nameless:
            rivals[effect] = rivals.get(effect, 0.0) + chance
    rivals.pop(hypothesis.effect, None)
    return FoundCause(
        effect=hypothesis.effect,
        scope=hypothesis.scope,
        joints=(hypothesis.joint,) if hypothesis.joint else (),
        variants=(variant,),
        gain=float(posterior.evidence.explained[posterior.shape[own]] / posterior.evidence.rows.sum()),
        log_odds=float(posterior.log_odds[own]),
        probability=probability,
        rivals=rivals,
        shapes=(posterior.shapes_of(own),),
    )


def _joined(parts: Sequence[FoundCause]) -> FoundCause:
    """Return causes of one effect at several joints as one: as sure as at the joint where it is most."""
    first = max(parts, key=lambda part: part.probability)
    return replace(
        first,
        joints=tuple(joint for part in parts for joint in part.joints),
        variants=tuple(variant for part in parts for variant in part.variants),
        shapes=tuple(shapes for part in parts for shapes in part.shapes),
        gain=sum(part.gain for part in parts),
    )


def _columns(structure: Sequence[Member]) -> list[int]:
    return [k for _, variant in structure for k in variant.columns]


def _places(structure: Sequence[Member]) -> set[tuple[str, str, str | None]]:
    return {hypothesis.place for hypothesis, _ in structure}


def _same_place(first: Hypothesis, second: Hypothesis) -> bool:
    """Return whether both are one effect at one place, in any scope or shape."""
    return first.effect == second.effect and overlap(first, second)

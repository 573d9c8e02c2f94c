"""The posterior of structures: how likely hypotheses are beside others, by what they explain.

What a structure leaves along a hypothesis' columns is noise, disagreement between groups, and a misfit that no effect
names. Its variance, a row, is `v = misfit^2 + disagreement / rows`, known as from `certainty` earlier looks; what is
left is then Student's, and what explains it has a Gaussian prior. What is explained, `told`, is squares of rows, in
units of v, and of the prior, in units of the disagreement. The odds of k coefficients of the information `A` that miss
a size s of them by `missed` are

    prior * (1 + told / certainty) ** ((certainty + k) / 2) * exp(-missed / 2) / sqrt(det(1 + s^2 A / (rows v)))

over the shapes and sizes of an effect, each as likely. An effect is at one of its joints as likely as at another; that
it is at one more has even odds, whichever that is. In words: `docs/how-it-decides.md`.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from irtwin.effects.effect import Effect
from irtwin.gap.regression.evidence import HypothesisEvidence, evidence
from irtwin.gap.regression.hypotheses import Hypothesis, Place, Variant
from irtwin.gap.regression.normal_equations import System
from irtwin.gap.regression.projection import Projection
from irtwin.gap.thresholds import Criterion

SILENT = 0.1  # of log odds: data that say less of a hypothesis say nothing

_TRIED = 3  # of those that explain most
_HIDDEN = 6.0  # of log odds, where what is left counts as unexplained
_OTHERS = 1e-3  # of the noise at least is not what a hypothesis explains
_SIZES = tuple(4.0**-k for k in range(-1, 5))  # in units of what is expected, alike for a base and a wrist
_SURE = 0.95  # of the posterior of shapes
_SCREENED = 128  # places, or choices of runs, out of which a screening takes one: as many as tell anything apart


@dataclass(frozen=True)
class HypothesisPrior:
    """The prior of hypotheses: `effects` in each scope are as likely as others, at any of their `joints`, so many.

    `shapes`: how many a hypothesis was tried in, by its place, where these are more than it has.
    """

    effects: int
    joints: Mapping[tuple[str, str], int]
    shapes: Mapping[Place, int] = field(default_factory=dict)

    @classmethod
    def of(cls, candidates: Sequence[Hypothesis], shapes: Mapping[Place, int] | None = None) -> HypothesisPrior:
        """Take it from all candidates of a search."""
        effects = {(candidate.effect, candidate.scope) for candidate in candidates}
        joints = Counter((candidate.effect, candidate.scope) for candidate in candidates if candidate.joint)
        return cls(len(effects), joints, shapes or {})

    def tried(self, hypothesis: Hypothesis) -> int:
        """Return in how many shapes a hypothesis was tried, each as likely."""
        return max(self.shapes.get(hypothesis.place, 0), len(hypothesis.variants))

    def log_odds(self, hypothesis: Hypothesis, structure: Sequence[Hypothesis]) -> float:
        """Return the log odds of a hypothesis beside those that were found; a nuisance's are even."""
        if hypothesis.nuisance:
            return 0.0
        places = self.joints[hypothesis.effect, hypothesis.scope] if hypothesis.joint else 1
        count = (
            sum((hypothesis.effect, hypothesis.scope) == (other.effect, other.scope) for other in structure)
            if hypothesis.joint
            else 0
        )
        if count:  # sets of so many joints are as likely as one another
            return float(np.log((count + 1) / (2 * max(places - count, 1))))
        return -float(np.log(self.effects * places))


@dataclass(frozen=True)
class Posterior:
    """H hypotheses beside a structure; V variants of the `evidence`, each of its `owner`, with `prior` and `misfit`.

    `prior` (V,): log odds of each; `misfit` (V, `System.kinds`): RMS, where each acts; `acting` (V,): in how many
    equations.
    """

    hypotheses: tuple[Hypothesis, ...]
    owner: np.ndarray
    prior: np.ndarray
    evidence: HypothesisEvidence
    misfit: np.ndarray
    acting: np.ndarray
    limits: Criterion

    @classmethod
    def beside(
        cls,
        projection: Projection,
        found: tuple[Sequence[Hypothesis], Sequence[int]],
        candidates: Sequence[Hypothesis],
        prior: HypothesisPrior,
        limits: Criterion,
        misfit: tuple[np.ndarray, np.ndarray],
    ) -> Posterior:
        """Try candidates beside what was `found`, by its columns, everything refitted.

        `misfit` (g,): of effects that act about reversals, and of others, as `_Search` has it.
        """
        variants = [variant for candidate in candidates for variant in candidate.variants]
        owner = np.repeat(np.arange(len(candidates)), [len(candidate.variants) for candidate in candidates])
        known, chosen = found
        shapes = [prior.tried(candidate) for candidate in candidates]
        odds = [
            prior.log_odds(candidate, known) - np.log(count)
            for candidate, count in zip(candidates, shapes, strict=True)
        ]
        screened = [variant.effect.screened for variant in variants]
        log_prior = np.array(odds)[owner] - np.where(screened, np.log(_SCREENED), 0.0)
        stand_for = np.round(np.array(shapes) / [len(candidate.variants) for candidate in candidates]).astype(int)
        seen = evidence(projection, chosen, variants, stand_for[owner])
        about = np.array([variant.effect.about_reversals for variant in variants], dtype=bool)[:, None]
        system = projection.system
        of_kinds = np.where(about, *(_of_kinds(system, variants, each) for each in misfit))
        acts = system.equations([variant.columns for variant in variants])[:, system.halves[0]].sum(axis=1)
        return cls(tuple(candidates), owner, log_prior, seen, np.sqrt(of_kinds), np.maximum(acts, 1), limits)

    @cached_property
    def variance(self) -> np.ndarray:
        """(V,) of what is left along a variant's columns, a row, in units of the noise.

        What a variant explains in one kind of equations counts by the misfit there. Power may tell of torque what
        torque does not: that a sensor is off is said by power alone, and no surer than power is explained.
        """
        seen = self.evidence
        of_kinds = self.misfit**2 + ((seen.disagreement + seen.unnamed) / seen.rows_that_speak)[:, None]
        explained = seen.by_kind.clip(min=0.0)
        explained[explained.sum(axis=1) <= 0] = 1.0
        return np.asarray(explained.sum(axis=1) / (explained / of_kinds).sum(axis=1))

    @cached_property
    def log_odds(self) -> np.ndarray:
        """(H,) log odds that a hypothesis is true beside the structure, against that nothing more is."""
        return np.asarray(np.logaddexp.reduceat(self._by_shape, self._firsts))

    @cached_property
    def log_prior(self) -> np.ndarray:
        """(H,) log odds that a hypothesis is true before the data speak."""
        return np.asarray(np.logaddexp.reduceat(self.prior, self._firsts))

    @cached_property
    def shape(self) -> np.ndarray:
        """(H,) the index of each hypothesis' likeliest variant."""
        weights, _ = self._beside_best(np.arange(len(self.owner)), self._firsts)
        return _largest(weights, self._firsts)

    @property
    def spoken(self) -> np.ndarray:
        """(V,) by how much the data speak for each variant, against nothing: log odds less those before the data."""
        return np.asarray(self._by_shape - self.prior)

    @cached_property
    def _by_shape(self) -> np.ndarray:
        """(V,) log odds of each variant against nothing."""
        explained = self._explaining(self._told, self._counts)
        return np.asarray(self.prior + explained - self._sizes(np.arange(len(self.owner)), self._scale))

    @cached_property
    def _told(self) -> np.ndarray:
        """(V,) what each variant explains, in units of what is left along its columns.

        That the twin's numbers are nearer to what is known of them has no misfit, but groups disagree on it.
        """
        every = np.arange(len(self.evidence.explained))
        return self._in_units_of(every, every)

    def _in_units_of(self, like: np.ndarray | int, places: np.ndarray) -> np.ndarray:
        """Return what some variants explain, (P,), in units of what is left along those that they are `like`."""
        seen = self.evidence
        rows, known = (seen.rows_that_speak * self.variance)[like], seen.of_prior[places]
        return np.asarray((seen.explained[places] - known) / rows + known / (seen.disagreement + seen.unnamed)[like])

    @cached_property
    def _scale(self) -> np.ndarray:
        """(V,) the squares that are left along a variant's columns."""
        every, shown = self.evidence.rows_that_speak * self.variance, self._told > 0
        return np.asarray(np.where(shown, self.evidence.explained / np.where(shown, self._told, 1.0), every))

    def variant(self, place: int) -> Variant:
        """Return the shape of a hypothesis that explains most."""
        return self.evidence.variants[int(self.shape[place])]

    def promising(self, least: float) -> Iterator[tuple[Hypothesis, Variant]]:
        """Yield the hypotheses that explain most, then the likeliest, each in its shape.

        These are as if the noise did not hold what a shape explains; what is below the `least` log odds then is left
        out.
        """
        rows = self.acting * self.evidence.rows_that_speak
        others = np.maximum(1 - self.evidence.explained / rows, _OTHERS)
        more = self._explaining(self._told / others, self._counts) - self._explaining(self._told, self._counts)
        odds = self._by_shape + more + _HIDDEN
        shapes = _largest(self._beside_best(np.arange(len(self.owner)), self._firsts, others)[0], self._firsts)
        shown = self.evidence.explained[shapes]
        kept = np.flatnonzero((odds[shapes] > least) & (shown > 0))
        if len(kept):
            most = kept[np.argsort(-shown[kept])[:_TRIED]]
            for place in dict.fromkeys([*most, kept[np.argmax(self.log_odds[kept])]]):
                yield self.hypotheses[place], self.evidence.variants[shapes[place]]

    def explains_most(self) -> int | None:
        """Return the place of the hypothesis that explains most in its likeliest shape; None where none does."""
        shown = self.evidence.explained[self.shape]
        return int(np.argmax(shown)) if shown.max(initial=0.0) > 0 else None

    def shapes_of(self, place: int) -> tuple[Effect, ...]:
        """Return the likeliest shapes of a hypothesis, as many as hold 95 % of what all of them have."""
        own = np.flatnonzero(self.owner == place)
        weights, _ = self._beside_best(own, np.zeros(1, dtype=int))
        order = np.argsort(-weights)
        held = np.cumsum(np.exp(weights[order] - np.logaddexp.reduce(weights)))
        few = order[: np.searchsorted(held, _SURE) + 1]
        return tuple(self.evidence.variants[k].effect for k in own[few])

    def explained(self, place: int) -> float:
        """Return the squares that a hypothesis explains in its best shape."""
        return float(self.evidence.explained[self.shape[place]])

    def scale(self, place: int) -> float:
        """Return the squares that count as one: those of its misfit, as often as that is known."""
        return float(self.limits.certainty * self._scale[self.shape[place]])

    def cost(self, place: int) -> float:
        """Return how much less likely a hypothesis is than what it explains: its prior, and its freedom."""
        shape = int(self.shape[place])
        own = self._explaining(self._told[shape], self._counts[shape])
        return float(own - self.log_odds[place])

    def index(self, hypothesis: Hypothesis) -> int:
        """Return the place of a hypothesis."""
        return next(k for k, candidate in enumerate(self.hypotheses) if candidate.place == hypothesis.place)

    def near(self, hypothesis: Hypothesis) -> list[int]:
        """Return the places of the hypotheses that could be where one is, itself among them.

        What power shows beside torque says nothing of what torque shows: it is explained otherwise, and less well.
        """
        seen, shapes = self.evidence, self.shape
        of_power = 2 * seen.of_power[shapes] > seen.explained[shapes]
        own = of_power[self.index(hypothesis)]
        over = [k for k, other in enumerate(self.hypotheses) if overlap(other, hypothesis)]
        return [k for k in over if of_power[k] == own]

    def likeliest_at(self, hypothesis: Hypothesis) -> int:
        """Return the place of the likeliest hypothesis of those that could be where one is, and have data for them.

        Where the data speak against all of them, of all.
        """
        near = self.near(hypothesis)
        near = [k for k in near if self.log_odds[k] > self.log_prior[k]] or near
        return near[int(np.argmax(self.weights(near)[0]))]

    def weights(self, near: Sequence[int]) -> tuple[np.ndarray, float]:
        """Return the log weights of hypotheses that compete for one place, and of none of them."""
        weights, none = self._beside_best(self.shape[list(near)], np.zeros(1, dtype=int))
        return weights, float(none[0])

    def _beside_best(
        self, places: np.ndarray, firsts: np.ndarray, others: np.ndarray | None = None
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return the log weights of variants, (P,), and that none of them is there, of each lot of those that compete.

        firsts (L,): where lots begin; one of each is there. Each is weighed by what it leaves of what the best of its
        lot explains: the best tells how well that can be explained. others (V,): the part of the noise that is none of
        what each explains; None: all.
        """
        best = places[_largest(self.evidence.explained[places], firsts)]
        lot = np.repeat(np.arange(len(firsts)), np.diff([*firsts, len(places)]))
        part = np.ones(len(lot)) if others is None else others[best[lot]]
        told = self._in_units_of(best[lot], places) / part
        most, counts = np.maximum.reduceat(told, firsts), self._counts[best]
        left = -np.asarray(self._explaining(most[lot] - told, counts[lot]))
        size = self._sizes(places, self._scale[best[lot]] * part)
        return self.prior[places] - size + left, -np.asarray(self._explaining(most, counts))

    def _explaining(self, told: np.ndarray | float, count: np.ndarray | int) -> np.ndarray | float:
        certainty = self.limits.certainty
        return 0.5 * (certainty + count) * np.log1p(told / certainty)

    def _sizes(self, places: np.ndarray, scale: np.ndarray) -> np.ndarray:
        """Return the log of what variants pay, (P,): the room that their coefficients have, and what these miss in it.

        They are off what is expected by one of `_SIZES`, each as likely. Variants of one count are weighed at once.
        """
        paid, (which, row, _) = np.zeros(len(places)), self._index[:, places]
        sizes = np.array(_SIZES)[:, None, None]
        for lot, (squares, off) in enumerate(self._axes):
            own = np.flatnonzero(which == lot)
            known = np.maximum(squares[row[own]] / scale[own, None], 0.0)
            room = 1 + sizes**2 * known
            cost = 0.5 * (np.log(room).sum(axis=-1) + (known * off[row[own]] / room).sum(axis=-1))
            paid[own] = np.log(len(_SIZES)) - np.logaddexp.reduce(-cost, axis=0)
        return paid

    @cached_property
    def _axes(self) -> list[tuple[np.ndarray, np.ndarray]]:
        """Of `evidence.coefficients` the squares of the information along its axes, and of values along these."""
        lots = []
        for _, values, information in self.evidence.coefficients:
            squares, axes = np.linalg.eigh(information)
            lots.append((squares, np.einsum("vij,vi->vj", axes, values) ** 2))
        return lots

    @cached_property
    def _index(self) -> np.ndarray:
        """(3, V) in which of `evidence.coefficients` a variant's are, which of these, and how many they are."""
        index = np.zeros((3, len(self.owner)), dtype=int)
        for lot, (places, values, _) in enumerate(self.evidence.coefficients):
            index[0, places], index[1, places], index[2, places] = lot, range(len(places)), values.shape[1]
        return index

    @property
    def _counts(self) -> np.ndarray:
        return np.asarray(self._index[2])

    @cached_property
    def _firsts(self) -> np.ndarray:
        """(H,) where the variants of each hypothesis begin."""
        return np.flatnonzero(np.diff(self.owner, prepend=-1))


def _largest(values: np.ndarray, firsts: np.ndarray) -> np.ndarray:
    """Return (L,) the place of the largest value of each lot; firsts (L,): where lots begin."""
    ends = [*firsts[1:], len(values)]
    return np.array([first + np.argmax(values[first:end]) for first, end in zip(firsts, ends, strict=False)], dtype=int)


def _of_kinds(system: System, variants: Sequence[Variant], misfit: np.ndarray) -> np.ndarray:
    """Return (V, `System.kinds`) the mean `misfit` (g,) of the equations of a kind in which each variant acts."""
    acts, means = system.equations([variant.columns for variant in variants]), []
    for kind in system.kinds:
        own = np.where(acts[:, kind].any(axis=1, keepdims=True), acts[:, kind], True)
        means.append((own * misfit[kind]).sum(axis=1) / own.sum(axis=1))
    return np.array(means).T.reshape(len(variants), len(system.kinds))


def overlap(first: Hypothesis, second: Hypothesis) -> bool:
    """Return whether two hypotheses are at one joint, or one of them anywhere."""
    return first.joint == second.joint or None in (first.joint, second.joint)

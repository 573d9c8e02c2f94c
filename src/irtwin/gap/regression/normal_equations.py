"""The equations of one channel, reduced once, and the algebra of trying hypotheses on them.

A sample's equations are [columns of the twin | candidate columns] @ coefficients = measured. Blocks of time are reduced
to triangular factors while the samples are read; whatever is asked later works on these.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import product

import numpy as np

from irtwin.effects.effect import Effect, Term
from irtwin.errors import InputError
from irtwin.gap.regression.cholesky import factored, solved
from irtwin.gap.regression.hypotheses import CandidateColumn
from irtwin.gap.regression.moments import Moments, Places, Products, numbers
from irtwin.identification.accumulate import Block

_NO_NOISE = 1e-9  # N m or W: an equation without rows leaves nothing
_MOST_BYTES = 3_000_000_000  # of blocks, of all groups' products, and of what is worked out of them:
_AT_WORK = 6  # products of the twin's columns with all, held at once
MOST_HELD = 20_000_000  # of these in all parts, numbers that each of two projections keeps
_LEAST_NOISE = 1e-7  # of a column as large as expected: with less, rounding of its squares would hide the prior


@dataclass(frozen=True)
class System:
    """g equations a sample, B blocks; K terms of the twin, M candidate columns.

    `pattern` (g, K + M): which columns each equation has; `group` (B,): blocks left out together; `observed` (B,):
    whether the block belongs to an observed run. `prior_rows` (K, K): what is known of the twin's terms, as
    `effects.prior` gives it; None: each by itself, as its spread says. With any that does not, each candidate column
    stands there twice: as it is, and (from index K + M) zero in all but observed runs. `beside_power`: the last
    equation is power's, beside those of torque. `shaken`: the products a row, (k + 1, k + 1) of each equation's columns
    and measurement, that noise of positions makes in fast rows of each equation, then in slow ones; `shaken_twin` those
    of the twin's columns alone; None: of none. `apart`: the second half of the equations are the first half's rows in
    which dry friction turns.
    """

    terms: tuple[tuple[Effect, Term], ...]
    columns: tuple[CandidateColumn, ...]
    pattern: np.ndarray
    blocks: tuple[Block, ...]
    group: np.ndarray
    observed: np.ndarray
    beside_power: bool = False
    prior_rows: np.ndarray | None = None
    shaken: tuple[np.ndarray, ...] | None = None
    shaken_twin: tuple[np.ndarray, ...] | None = None
    apart: bool = False

    @property
    def by_speed(self) -> System:
        """The system with 2 g equations: rows in which a joint's dry friction turns stand apart, in the second half.

        What nobody knows of that law is noise of theirs alone.
        """
        if any(block.slow is None for block in self.blocks):  # as of power alone: no row is slow
            return self
        return replace(
            self,
            pattern=np.concatenate([self.pattern, self.pattern]),
            blocks=tuple(block.apart for block in self.blocks),
            apart=True,
        )

    def with_columns(self, chosen: Sequence[int]) -> tuple[System, list[int]]:
        """Return the system with the twin's terms and the chosen columns alone, and the indices of these in it."""
        own = [k - len(self.columns) if k >= self.changed else k for k in chosen]
        kept = sorted(set(own))
        inside = np.isin(np.arange(self.pattern.shape[1]), [*range(self.base), *kept])
        held = [np.append(inside[row], True) for row in self.pattern]
        blocks = (
            replace(block, factors=tuple(f[:, some] for f, some in zip(block.factors, held, strict=True)))
            for block in self.blocks
        )
        system = replace(
            self,
            columns=tuple(self.column(k) for k in kept),
            pattern=self.pattern[:, inside],
            blocks=tuple(blocks),
            shaken=None,
        )
        places = [self.base + kept.index(k) for k in own]
        return system, [p + len(kept) * (k >= self.changed) for p, k in zip(places, chosen, strict=True)]

    def with_noise_of(self, other: System) -> System:
        """Return the system with what noise of positions does to another, which has these columns and more."""
        at = {(id(column.effect), column.index): k for k, column in enumerate(other.columns, start=other.base)}
        places = np.array([*range(self.base), *(at[id(column.effect), column.index] for column in self.columns)])
        shaken = []
        for equation, products in enumerate(other.shaken or ()):
            row = equation % len(self.pattern)  # slow rows after fast ones
            held = np.flatnonzero(other.pattern[row])
            kept = np.append(np.searchsorted(held, places[self.pattern[row]]), len(held))
            shaken.append(products[np.ix_(kept, kept)])
        return replace(self, shaken=tuple(shaken) or None, shaken_twin=other.shaken_twin)

    def joined(self, other: System) -> System:
        """Return the system with the blocks of another, of the same columns, as groups of their own."""
        return replace(
            self,
            blocks=(*self.blocks, *other.blocks),
            group=np.concatenate([self.group, other.group + self.groups]),
            observed=np.concatenate([self.observed, other.observed]),
        )

    def measuring(self, values: np.ndarray) -> System:
        """Return the system had it measured what its columns (D,) give with these coefficients."""

        def measured(block: Block, observed: bool) -> Block:
            factors = []
            for factor, places in zip(block.factors, self._places[observed], strict=True):
                own = np.bincount(places.own, np.append(values, 0.0)[places.every])[:-1]
                factors.append(np.column_stack([factor[:, :-1], factor[:, :-1] @ own]))
            return replace(block, factors=tuple(factors))

        return replace(self, blocks=tuple(map(measured, self.blocks, self.observed.tolist())))

    @property
    def halves(self) -> tuple[slice, ...]:
        """The equations of rows alike: all, or those of fast rows and those of slow ones."""
        count = len(self.pattern)
        return (slice(count // 2), slice(count // 2, count)) if self.apart else (slice(count),)

    @property
    def kinds(self) -> tuple[slice, ...]:
        """The equations whose misfit is alike: the halves, power's apart from torque's; it has no slow rows."""
        if not self.beside_power:
            return self.halves
        first, *others = self.halves
        return slice(first.stop - 1), slice(first.stop - 1, first.stop), *others

    @property
    def base(self) -> int:
        """K, how many terms the twin has."""
        return len(self.terms)

    @cached_property
    def both(self) -> bool:
        """Whether there are reference runs beside the observed ones."""
        return not self.observed.all()

    @property
    def changed(self) -> int:
        """The index of the first candidate column that is zero outside observed runs."""
        return self.base + len(self.columns)

    def column(self, k: int) -> CandidateColumn:
        """Return the candidate column of an index, as it is or as a change."""
        return self.columns[(k - self.base) % len(self.columns)]

    def equations(self, columns: Sequence[Sequence[int]]) -> np.ndarray:
        """Return whether an equation of their own signal has any of candidate columns of V effects, (V, g)."""
        if not columns:
            return np.zeros((0, len(self.pattern)), dtype=bool)
        flat, first = np.concatenate(columns), np.cumsum([0, *map(len, columns[:-1])])
        own = np.where(flat >= self.changed, flat - len(self.columns), flat)
        shown: np.ndarray = np.logical_or.reduceat(self.pattern[:, own], first, axis=1).T
        if self.beside_power:
            of_torque = shown[:, : self.halves[0].stop - 1].any(axis=1, keepdims=True)
            shown[:, [half.stop - 1 for half in self.halves]] &= ~of_torque
        return shown

    @property
    def groups(self) -> int:
        """How many groups there are."""
        return int(self.group.max()) + 1

    @cached_property
    def group_observed(self) -> np.ndarray:
        """(G,) whether the group is of observed runs."""
        return np.array([self.observed[self.group == g].all() for g in range(self.groups)])

    @cached_property
    def rows(self) -> np.ndarray:
        """(G, g) how many rows each equation has in each group."""
        counts = np.zeros((self.groups, len(self.pattern)))
        for block, group in zip(self.blocks, self.group, strict=True):
            counts[group] += block.rows
        return counts

    @cached_property
    def quietest(self) -> np.ndarray:
        """(g,) the least noise that an equation is taken to have: exact or dead signals have finite weights, too."""
        return np.array(
            [least_noise(np.sum([products.largest for products in own])) for own in zip(*self._products, strict=True)]
        )

    @cached_property
    def all_terms(self) -> tuple[Term, ...]:
        """The terms of every column, those of changes too: their expectation is no change, without bound."""
        first = [term for _, term in self.terms]
        return (*first, *(column.term for column in self.columns), *(_change(c.term) for c in self.columns))

    @cached_property
    def scale(self) -> np.ndarray:
        """(D,) the prior's standard deviations; factors are taken in units of it."""
        return np.array([term.spread for term in self.all_terms[: self.size]])

    @cached_property
    def expected(self) -> np.ndarray:
        """(K,) what is expected of the twin's terms."""
        return np.array([term.expected for _, term in self.terms])

    def prior(self, chosen: Sequence[int] | np.ndarray = ()) -> np.ndarray:
        """Return the products of the prior's rows of the twin's terms and c chosen columns, (K + c, K + c)."""
        products = np.eye(self.base + len(chosen))
        if self.prior_rows is not None:
            products[: self.base, : self.base] = self._prior_products
        return products

    def told_by_prior(self, values: np.ndarray) -> np.ndarray:
        """Return the prior's rows (..., K) times the twin's coefficients (..., K) of effects whose `prior_tells`."""
        told = values * np.array([effect.prior_tells for effect, _ in self.terms])
        return told if self.prior_rows is None else np.asarray(told @ self.prior_rows.T)

    @cached_property
    def _prior_products(self) -> np.ndarray:
        assert self.prior_rows is not None
        return np.asarray(self.prior_rows.T @ self.prior_rows)

    @property
    def size(self) -> int:
        """D, how many columns there are; the measurement's index."""
        return self.base + len(self.columns) * (2 if self.both else 1)

    @cached_property
    def _units(self) -> np.ndarray:
        """(D + 1,) of all columns and of the measurement."""
        return np.append(self.scale, 1.0)

    @cached_property
    def _expected(self) -> list[np.ndarray]:
        """Of each equation what is expected of the columns that it holds, (k + 1,)."""
        every = np.append(self.expected, np.zeros(len(self.columns)))
        return [np.append(every[row], 0.0) for row in self.pattern]

    def _held(self, equation: int, observed: bool, weights: np.ndarray) -> np.ndarray:
        """Return what (D + 1,) weights of all columns are of those that an equation holds, (k + 1,), unscaled."""
        places = self._places[observed][equation]
        weighed = np.bincount(places.own, (weights * self._units)[places.every])
        return np.asarray(weighed - weights[-1] * self._expected[equation])

    def _among_all(self, equation: int, observed: bool, products: np.ndarray) -> np.ndarray:
        """Return products with what an equation holds, (k + 1,), as those with all columns, (D + 1,)."""
        places = self._places[observed][equation]
        among_all = np.zeros(self.size + 1)
        among_all[places.every] = products[places.own] * self._units[places.every]
        among_all[-1] -= products @ self._expected[equation]
        return among_all

    @cached_property
    def _products(self) -> list[list[Products]]:
        """Per group and equation."""
        self._fits_in_memory()
        return [
            [self._products_of(np.flatnonzero(self.group == group), equation) for equation in range(len(self.pattern))]
            for group in range(self.groups)
        ]

    @cached_property
    def _all_products(self) -> list[list[Products]]:
        """Per equation, over all groups: of runs that are observed and of those that are not, if there are any."""
        kinds = [np.flatnonzero(self.group_observed == observed) for observed in (False, True)]
        return [
            [Products.summed([self._products[group][equation] for group in own]) for own in kinds if len(own)]
            for equation in range(len(self.pattern))
        ]

    def _products_of(self, blocks: np.ndarray, equation: int) -> Products:
        """Return an equation's products over a group's blocks."""
        places = self._places[bool(self.observed[blocks[0]])][equation]
        stacked = np.concatenate([self.blocks[block].factors[equation] for block in blocks])
        stacked[:, -1] -= stacked @ self._expected[equation]
        return Products.of(places, stacked, np.append(self.scale[: self.changed][self.pattern[equation]], 1.0))

    @cached_property
    def _places(self) -> tuple[list[Places], list[Places]]:
        """Of each equation, in runs that are not observed and in observed ones."""
        alone, twice = [], []
        for row in self.pattern:
            used = np.flatnonzero(row)
            own, held = int((used < self.base).sum()), np.arange(len(used) + 1)
            alone.append(Places(np.append(used, self.size), held, self.size + 1))
            every = np.concatenate([used, used[own:] + len(self.columns), [self.size]])
            twice.append(Places(every, np.concatenate([held[:-1], held[own:]]), self.size + 1))
        return alone, twice if self.both else alone

    def _fits_in_memory(self) -> None:
        """Refuse what would take too much, before more is taken."""
        columns = self.pattern.sum(axis=1) + 1
        rows = np.minimum([[len(factor) for factor in block.factors] for block in self.blocks], columns)
        held = float((rows * columns).sum()) + _AT_WORK * self.base * self.size
        held += 2 * min(MOST_HELD, len(self.parts) * self.base * self.size)
        for group in range(self.groups):
            own = rows[self.group == group].sum(axis=0)
            held += sum(numbers(int(count), int(width)) for count, width in zip(own, columns, strict=True))
        for side in (self.observed, ~self.observed):
            if len(np.unique(self.group[side])) > 1:  # over all groups, too
                own = rows[side].sum(axis=0)
                held += sum(numbers(int(count), int(width)) for count, width in zip(own, columns, strict=True))
        taken = 8 * held
        if taken > _MOST_BYTES:
            joints = len(self.pattern[self.halves[0]]) - self.beside_power
            raise InputError(
                f"trying every effect on {joints} joints takes {taken / 1e9:.1f} GB of "
                f"memory, and {_MOST_BYTES / 1e9:.1f} are the most: take fewer joints at once, or fewer runs"
            )

    def moments(self, noise: np.ndarray) -> list[Moments]:
        """Return each part's products of columns, (D + 1, D + 1), equations weighted by their `noise` (g,).

        Raises InputError where they would take too much memory.
        """
        weights = np.maximum(noise, self.quietest) ** -2.0
        return [
            Moments(list(zip(self._products[group][kind], weights[kind].tolist(), strict=True)))
            for kind, group in self.parts
        ]

    def group_moments(self, noise: np.ndarray) -> list[Moments]:
        """Return each group's products of columns, both halves of it together, equations weighted as by `moments`."""
        weights = np.maximum(noise, self.quietest) ** -2.0
        return [Moments(list(zip(own, weights.tolist(), strict=True))) for own in self._products]

    def total(self, noise: np.ndarray) -> Moments:
        """Return the products of columns over all groups, equations weighted as by `moments`."""
        weights = np.maximum(noise, self.quietest) ** -2.0
        return Moments(
            [(own, weight) for both, weight in zip(self._all_products, weights.tolist(), strict=True) for own in both]
        )

    @property
    def parts(self) -> list[tuple[slice, int]]:
        """The kinds of equations of the groups, (P,): of which equations, and of which group."""
        return [(kind, group) for kind in self.kinds for group in range(self.groups)]

    def shaken_products(self, coefficients: np.ndarray, noise: np.ndarray) -> np.ndarray | None:
        """Return the products (P, D + 1) of all columns with what noise of positions seems to explain, in each part.

        That is the noise of all columns times their (D + 1,) coefficients, in units of the prior. Equations are
        weighted by `noise` (g,). None where no noise of positions is known.
        """
        if self.shaken is None or not self.apart:
            return None
        weights = self._shaken_share * np.maximum(noise, self.quietest) ** -2.0
        a_row = np.empty((2, len(weights), self.size + 1))
        for observed, (k, products) in product((False, True), enumerate(self.shaken)):
            explained = _times(products, self._held(k, observed, coefficients))
            a_row[int(observed), k] = weights[k] * self._among_all(k, observed, explained)
        return np.array(
            [self.rows[group, kind] @ a_row[int(self.group_observed[group])][kind] for kind, group in self.parts]
        )

    def products_of(self, first: np.ndarray, second: np.ndarray, noise: np.ndarray) -> np.ndarray:
        """Return in each part the product of each column with another, (N,) indices: (P, N); weighted by `noise`."""
        sums = np.zeros((len(self.kinds), self.groups, len(first)))
        weights = np.maximum(noise, self.quietest) ** -2.0
        kinds = [kind for kind, own in enumerate(self.kinds) for _ in weights[own]]
        for equation, (kind, weight) in enumerate(zip(kinds, weights, strict=True)):
            for observed in (False, True):
                at = self._places[observed][equation].at
                some = np.flatnonzero((at[first] >= 0) & (at[second] >= 0))
                held = at[first[some]], at[second[some]]
                for group in np.flatnonzero(self.group_observed == observed):
                    sums[kind, group, some] += weight * self._products[group][equation].pairs(*held)
        return sums.reshape(-1, len(first))

    def residual_rms(self, chosen: Sequence[int], noise: np.ndarray) -> np.ndarray:
        """Return each equation's residual RMS (g,) of the fit of the twin's terms and the chosen columns.

        Of an equation without rows, a joint that never moves, nothing is known: it is given the largest of the others'.
        """
        weights = np.append(-self.solution(chosen, self.total(noise)), 1.0)
        squares = np.array([sum(own.squares(weights) for own in both) for both in self._all_products])
        left = np.sqrt(np.maximum(squares, 0.0) / np.maximum(self.rows.sum(axis=0), 1))
        left = np.where(self.rows.any(axis=0), left, left.max(initial=0.0))
        if self.apart:  # few rows are fitted easily: no law is known better where friction turns
            fast, slow = np.split(left, 2)
            left = np.concatenate([fast, np.maximum(fast, slow)])
        return np.asarray(np.maximum(left, self.quietest))

    @cached_property
    def noise_before(self) -> np.ndarray:
        """(g,) RMS that the twin alone leaves of each equation, equations weighted alike."""
        return self.residual_rms((), np.ones(len(self.pattern)))

    @property
    def position_noise(self) -> np.ndarray:
        """(g,) RMS that noise of positions makes of what the twin alone leaves; no more than that, 0 where unknown.

        Of rows apart alone: where dry friction turns it makes far more.
        """
        return np.asarray(np.minimum(self._shaken_rms, self.noise_before))

    @cached_property
    def _shaken_rms(self) -> np.ndarray:
        """(g,) the same, as shaking alone says."""
        left = self.noise_before
        if self.shaken_twin is None or not self.apart:
            return np.zeros_like(left)
        solution = self.solution((), self.total(left))
        coefficients = np.append(-solution, 1.0)
        squares = []
        for equation, products in enumerate(self.shaken_twin):
            own = self._held(equation, True, coefficients)
            held = np.append(own[: len(products) - 1], own[-1])
            squares.append(held @ products @ held)
        return np.asarray(np.sqrt(np.maximum(squares, 0.0)))

    @property
    def _shaken_share(self) -> np.ndarray:
        """(g,) of the products that shaking makes: as much as makes no more than what the twin leaves."""
        made, left = self._shaken_rms, self.noise_before
        return np.asarray((left / np.maximum(made, left)) ** 2)

    def rms(
        self,
        chosen: Sequence[int],
        noise: np.ndarray,
        fitted: Sequence[int] | np.ndarray,
        of: Sequence[int] | np.ndarray,
    ) -> np.ndarray:
        """Return each equation's RMS (g,) in the groups `of`, by a fit to the groups `fitted`, weighted by `noise`."""
        vector = self.solution(chosen, self._together(fitted, noise))
        squares = np.sum([self.squares(vector, int(group)) for group in of], axis=0)
        return np.asarray(np.sqrt(squares / np.maximum(self.rows[list(of)].sum(axis=0), 1)))

    def within_bounds(self, chosen: Sequence[int], noise: np.ndarray) -> list[int]:
        """Return the chosen columns without those of nuisances that a fit would have below their bounds.

        Dry friction that turns by a negative share is none: it would imitate friction that falls with speed.
        """
        kept, total = list(chosen), self.total(noise)
        while own := [k for k in kept if self.column(k).effect.nuisance]:
            values = self.solution(kept, total)
            terms = [self.all_terms[k] for k in own]
            below = {
                k for k, term in zip(own, terms, strict=True) if term.expected + values[k] * self.scale[k] < term.lowest
            }
            if not below:
                break
            kept = [k for k in kept if k not in below]
        return kept

    def _together(self, groups: Sequence[int] | np.ndarray, noise: np.ndarray) -> Moments:
        """Return the products of columns of some groups, equations weighted as by `moments`."""
        weights = np.maximum(noise, self.quietest) ** -2.0
        return Moments([pair for group in groups for pair in zip(self._products[group], weights.tolist(), strict=True)])

    def solution(self, chosen: Sequence[int], total: Moments, without: Moments | None = None) -> np.ndarray:
        """Return the (D,) coefficients, in units of the prior, of the twin's terms and the chosen columns.

        `without`: a part of the total that is left out.
        """
        inside = self.fitted(chosen)
        asked = inside, np.append(inside, self.size)
        products = total.among(*asked) - (0.0 if without is None else without.among(*asked))
        vector = np.zeros(self.size)
        vector[inside] = solved(factored(products[:, :-1], self.prior(chosen)), products[:, -1])
        return vector

    def squares_without(self, chosen: Sequence[int], total: Moments, own: Moments, group: int) -> np.ndarray:
        """Return each equation's squares (g,) in a group by a fit without it: the total without its `own` moments.

        What acts for a while, in runs of the group alone, is not foretold by the part of it that is left.
        """
        vector = self.solution(chosen, total, own)
        runs = {self.blocks[k].run for k in np.flatnonzero(self.group == group)}
        for k in chosen:
            effect = self.column(k).effect
            if effect.window is not None and effect.runs is not None and runs.issuperset(effect.runs):
                vector[k] = 0.0
        return self.squares(vector, group)

    def fitted(self, chosen: Sequence[int]) -> np.ndarray:
        """Return the indices of the columns that are fitted: the twin's and those chosen."""
        return np.append(np.arange(self.base), np.array(chosen, dtype=int))

    def squares(self, vector: np.ndarray, group: int) -> np.ndarray:
        """Return each equation's squared residuals (g,) in a group, by (D,) coefficients in units of the prior."""
        weights = np.append(-vector, 1.0)
        return np.maximum([products.squares(weights) for products in self._products[group]], 0.0)


def _times(products: np.ndarray, values: np.ndarray) -> np.ndarray:
    some = np.flatnonzero(values)  # of many columns few are fitted
    return np.asarray(values[some] @ products[some])


def _change(term: Term) -> Term:
    return Term(term.name, term.unit, term.joint, term.link, 0.0, term.spread)


def least_noise(squares: float) -> float:
    """Return the least noise of an equation whose largest column, in units of its prior, has such a sum of squares."""
    return max(_LEAST_NOISE * float(np.sqrt(squares)), _NO_NOISE)


def observed_rms(system: System, chosen: Sequence[int], noise: np.ndarray) -> np.ndarray:
    """Return the RMS (g,) that a fit to all runs leaves in observed ones; equations weighted by `noise` (g,)."""
    return system.rms(chosen, noise, range(system.groups), np.flatnonzero(system.group_observed))


def reference_rms(system: System, noise: np.ndarray) -> np.ndarray:
    """Return the RMS (g,) that the twin, fitted to the runs that are not observed, leaves in these."""
    groups = np.flatnonzero(~system.group_observed)
    return system.rms((), noise, groups, groups)


def twin_values(system: System, vector: np.ndarray) -> np.ndarray:
    """Return the coefficients of the twin's terms, (K,), from a solution (D,) in units of the prior."""
    return np.asarray(system.expected + vector[: system.base] * system.scale[: system.base])

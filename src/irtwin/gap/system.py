"""The equations of one channel, reduced once, and the algebra of trying hypotheses on them.

A sample's equations are [columns of the twin | candidate columns] @ coefficients = measured. Blocks of time are reduced
to triangular factors while the samples are read; whatever is asked later works on these.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, reduce

import numpy as np

from irtwin.effects.effect import Effect, Term
from irtwin.gap.episodes import Episode, brief
from irtwin.gap.hypotheses import Column, Variant, bounds
from irtwin.gap.normal_equations import factored, solved
from irtwin.identification.accumulate import Block

_NO_NOISE = 1e-9  # N m or W: an equation without rows leaves nothing
_LEAST_NOISE = 1e-7  # of a column as large as expected: with less, rounding of its squares would hide the prior
_QUIET = 0.3  # of the noise: what is left of a block is never taken for less


@dataclass(frozen=True)
class System:
    """g equations a sample, B blocks; K terms of the twin, M candidate columns.

    `pattern` (g, K + M): which columns each equation has; `group` (B,): blocks left out together; `observed` (B,):
    whether the block belongs to an observed run. With any that does not, each candidate column stands there twice: as
    it is, and (from index K + M) zero in all but observed runs. `episode`: what joints say of a brief candidate.
    """

    terms: tuple[tuple[Effect, Term], ...]
    columns: tuple[Column, ...]
    pattern: np.ndarray
    blocks: tuple[Block, ...]
    group: np.ndarray
    observed: np.ndarray
    episode: Episode | None = None

    @property
    def base(self) -> int:
        """K, how many terms the twin has."""
        return len(self.terms)

    @property
    def both(self) -> bool:
        """Whether there are reference runs beside the observed ones."""
        return not self.observed.all()

    @property
    def changed(self) -> int:
        """The index of the first candidate column that is zero outside observed runs."""
        return self.base + len(self.columns)

    def equations(self, columns: Sequence[int]) -> np.ndarray:
        """Return (g,) whether an equation has any of some candidate columns."""
        own = [k - len(self.columns) if k >= self.changed else k for k in columns]
        return np.asarray(self.pattern[:, own].any(axis=1))

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
            [
                least_noise(np.sum([np.diag(products)[:-1].max(initial=0.0) for _, products in own]))
                for own in zip(*self._products, strict=True)
            ]
        )

    @cached_property
    def all_terms(self) -> tuple[Term, ...]:
        """The terms of every column, those of changes too: their expectation is no change, without bound."""
        first = [term for _, term in self.terms]
        return (*first, *(column.term for column in self.columns), *(_change(c.term) for c in self.columns))

    @cached_property
    def scale(self) -> np.ndarray:
        """(D,) the prior's standard deviations; factors are taken in units of it."""
        return np.array([term.spread for term in self.all_terms[: self._size]])

    @cached_property
    def expected(self) -> np.ndarray:
        """(K,) what is expected of the twin's terms."""
        return np.array([term.expected for _, term in self.terms])

    @property
    def _size(self) -> int:
        return self.base + len(self.columns) * (2 if self.both else 1)

    def factor(self, block: int, equation: int) -> tuple[np.ndarray, np.ndarray]:
        """Return a block's factor of an equation, (r, k + 1), in units of the prior, and the indices (k,) it has.

        The last column is what was measured, less what was expected.
        """
        used = np.flatnonzero(self.pattern[equation])
        factor = self.blocks[block].factors[equation]
        own = used[used < self.base]
        target = factor[:, -1] - factor[:, : len(own)] @ self.expected[own]
        columns = factor[:, :-1]
        if self.both and self.observed[block]:
            later = used >= self.base
            columns = np.concatenate([columns, columns[:, later]], axis=1)
            used = np.append(used, used[later] + len(self.columns))
        return np.column_stack([columns * self.scale[used], target]), used

    @cached_property
    def _products(self) -> list[list[tuple[np.ndarray, np.ndarray]]]:
        """Per group and equation: the indices of its columns, the measurement's (D) last, and their products."""
        found = []
        for group in range(self.groups):
            blocks = np.flatnonzero(self.group == group)
            own = []
            for equation in range(len(self.pattern)):
                factors = [self.factor(int(block), equation) for block in blocks]
                stacked = np.concatenate([factor for factor, _ in factors])
                own.append((np.append(factors[0][1], self._size), stacked.T @ stacked))
            found.append(own)
        return found

    def moments(self, noise: np.ndarray) -> list[np.ndarray]:
        """Return each group's (D + 1, D + 1) products of columns, equations weighted by their `noise` (g,)."""
        return [self._weighted([group], noise) for group in range(self.groups)]

    def _weighted(self, groups: Sequence[int] | np.ndarray, noise: np.ndarray) -> np.ndarray:
        total = np.zeros((self._size + 1, self._size + 1))
        for group in groups:
            for (places, products), level in zip(self._products[group], np.maximum(noise, self.quietest), strict=True):
                total[np.ix_(places, places)] += products / float(level) ** 2
        return total

    def residual_rms(self, chosen: Sequence[int], noise: np.ndarray) -> np.ndarray:
        """Return each equation's residual RMS (g,) of the fit of the twin's terms and the chosen columns.

        Of an equation without rows, a joint that never moves, nothing is known: it is given the largest of the others'.
        """
        found = self.rms(chosen, noise, range(self.groups), range(self.groups))
        found = np.where(self.rows.any(axis=0), found, found.max(initial=0.0))
        return np.asarray(np.maximum(found, self.quietest))

    def rms(
        self,
        chosen: Sequence[int],
        noise: np.ndarray,
        fitted: Sequence[int] | np.ndarray,
        of: Sequence[int] | np.ndarray,
    ) -> np.ndarray:
        """Return each equation's RMS (g,) in the groups `of`, by a fit to the groups `fitted`, weighted by `noise`."""
        vector = self.solution(chosen, self._weighted(fitted, noise))
        squares = np.sum([self.squares(vector, int(group)) for group in of], axis=0)
        return np.asarray(np.sqrt(squares / np.maximum(self.rows[list(of)].sum(axis=0), 1)))

    def solution(self, chosen: Sequence[int], total: np.ndarray) -> np.ndarray:
        """Return the (D,) coefficients, in units of the prior, of the twin's terms and the chosen columns."""
        inside = np.append(np.arange(self.base), np.array(chosen, dtype=int))
        vector = np.zeros(self._size)
        vector[inside] = solved(factored(total[np.ix_(inside, inside)]), total[inside, -1])
        return vector

    def squares(self, vector: np.ndarray, group: int) -> np.ndarray:
        """Return each equation's squared residuals (g,) in a group, by (D,) coefficients in units of the prior."""
        weights = np.append(-vector, 1.0)
        left = [float(weights[places] @ products @ weights[places]) for places, products in self._products[group]]
        return np.maximum(left, 0.0)


def least_noise(squares: float) -> float:
    """Return the least noise of an equation whose largest column, in units of its prior, has such a sum of squares."""
    return max(_LEAST_NOISE * float(np.sqrt(squares)), _NO_NOISE)


@dataclass(frozen=True)
class Trial:
    """What H hypotheses do on groups left out: weighted squares (H, G) each, `start` (G,) without any.

    `said` (H, G): the weighted squares of what each adds there, however well that fits.
    `best` (H,): the index of the variant that the whole data choose; `values`: its coefficients, in units of the prior;
    `visible` (H,): mean square that the variant adds beyond what the rest imitates, with coefficients as large as
    expected; `share_visible` (H,): the part of its columns that the rest cannot imitate.
    """

    start: np.ndarray
    loss: np.ndarray
    said: np.ndarray
    best: np.ndarray
    values: tuple[np.ndarray, ...]
    visible: np.ndarray
    share_visible: np.ndarray


@dataclass(frozen=True)
class _Batch:
    """Variants of one number of coefficients: `place` (V,) in all variants, `columns` (V, k), `lowest` (V, k)."""

    place: np.ndarray
    columns: np.ndarray
    lowest: np.ndarray


def attempt(
    system: System, moments: Sequence[np.ndarray], chosen: Sequence[int], candidates: Sequence[Sequence[Variant]]
) -> Trial:
    """Try hypotheses, each a list of variants, beside the twin's terms and the `chosen` columns.

    Everything is refitted without each group in turn; the shape (variant) is chosen inside the training groups. What is
    brief has its coefficients from all groups: other runs cannot tell them, and joints have told that they agree.
    """
    variants = [variant for group in candidates for variant in group]
    owner = np.repeat(np.arange(len(candidates)), [len(group) for group in candidates])
    batches = _batches(system, variants)
    total = reduce(np.add, moments)
    whole, _ = _project(total, total, system.base, chosen)
    objective, _, _, values = _fit(whole, whole, batches, len(variants))
    start = np.empty(len(moments))
    loss, said = np.empty((2, len(candidates), len(moments)))
    for group, part in enumerate(moments):
        train, test = _project(total - part, part, system.base, chosen)
        start[group] = test.squares
        inner, left_out, added, _ = _fit(train, test, batches, len(variants))
        for place, variant in enumerate(variants):
            if brief(variant.effect):
                left_out[place] = _left(test, variant.columns, values[place])
        best = _best(inner, owner, len(candidates))
        loss[:, group], said[:, group] = left_out[best], added[best]
    best = _best(objective, owner, len(candidates))
    diagonal = whole.diagonal
    rows = max(float(system.rows.sum(axis=0).max(initial=0.0)), 1.0)
    visible = np.array([diagonal[list(variants[k].columns)].sum() / rows for k in best])
    before = np.diag(total)
    share = np.array([_ratio(diagonal[list(variants[k].columns)], before[list(variants[k].columns)]) for k in best])
    return Trial(start, loss, said, best, tuple(values[k] for k in best), visible, share)


def scores(
    system: System, moments: Sequence[np.ndarray], noise: np.ndarray, chosen: Sequence[int]
) -> tuple[np.ndarray, np.ndarray]:
    """Return each block's score of each column (B, D), and the products of projected columns (D + 1, D + 1).

    A block's equations count by the inverse of what is left of them, so that no few blocks decide alone.
    """
    total = reduce(np.add, moments)
    inside, weights = _weights(total, system.base, chosen)
    rest = np.zeros(len(total))
    rest[-1] = 1.0
    rest[inside] = -weights[:, -1]
    found = np.empty((len(system.blocks), len(total) - 1))
    for block in range(len(system.blocks)):
        vector = np.zeros(len(total))
        for equation, level in enumerate(noise):
            factor, used = system.factor(block, equation)
            places = np.append(used, len(total) - 1)
            left = factor @ rest[places]
            loud = np.sqrt(left @ left / max(system.blocks[block].rows[equation], 1)) / level
            vector[places] += factor.T @ left / level**2 / max(float(loud), _QUIET)
        found[block] = (vector - weights.T @ vector[inside])[:-1]
    return found, total - total[inside].T @ weights


def canonical_correlation(
    total: np.ndarray, base: int, chosen: Sequence[int], sets: Sequence[Sequence[int]]
) -> np.ndarray:
    """Return the largest canonical correlation of each set of columns with the first set, (S,), after the refit.

    total: (D + 1, D + 1) products of columns. What the prior holds near zero anyway correlates with nothing.
    """
    whole, _ = _project(total, total, base, chosen)
    first = len(sets[0])
    found = []
    for columns in sets:
        products = whole.of(np.array([[*sets[0], *columns]]))[0] + np.eye(first + len(columns))
        own, other = (
            np.linalg.pinv(part, hermitian=True) for part in (products[:first, :first], products[first:, first:])
        )
        squared = own @ products[:first, first:] @ other @ products[first:, :first]
        found.append(np.sqrt(np.abs(np.linalg.eigvals(squared)).max()))
    return np.minimum(found, 1.0)


def _change(term: Term) -> Term:
    return Term(term.name, term.unit, term.joint, term.link, 0.0, term.spread)


def _ratio(part: np.ndarray, whole: np.ndarray) -> float:
    return float(part.sum() / whole.sum()) if whole.sum() > 0 else 0.0


def _left(test: _Products, columns: Sequence[int], values: np.ndarray) -> float:
    """Return the squares left on test by known coefficients of some columns."""
    both = np.array([[*columns, len(test.whole) - 1]])
    return float(_squares(test.of(both), values[None])[0])


def _batches(system: System, variants: Sequence[Variant]) -> list[_Batch]:
    sizes: dict[int, list[int]] = {}
    for place, variant in enumerate(variants):
        sizes.setdefault(len(variant.columns), []).append(place)
    batches = []
    for places in sizes.values():
        columns = np.array([variants[place].columns for place in places])
        lowest = np.array([bounds(variants[place]) for place in places])
        lowest[columns >= system.changed] = -np.inf
        batches.append(_Batch(np.array(places), columns, lowest / system.scale[columns]))
    return batches


def _weights(total: np.ndarray, base: int, chosen: Sequence[int]) -> tuple[np.ndarray, np.ndarray]:
    """Return the fitted columns' indices, and their weights in the fit of every column and of the measurement."""
    inside = np.append(np.arange(base), np.array(chosen, dtype=int))
    return inside, solved(factored(total[np.ix_(inside, inside)]), total[inside])


@dataclass(frozen=True)
class _Products:
    """Products of what a fit leaves of each column, worked out for the columns that are asked for.

    `whole` (D + 1, D + 1): products of the columns as they are; of each pair (D + 1, K) the product is taken off.
    """

    whole: np.ndarray
    pairs: tuple[tuple[np.ndarray, np.ndarray], ...]

    def of(self, columns: np.ndarray) -> np.ndarray:
        """Return the products among each row of columns: (V, k) -> (V, k, k)."""
        found: np.ndarray = self.whole[columns[:, :, None], columns[:, None, :]]
        for left, right in self.pairs:
            found = found - left[columns] @ right[columns].swapaxes(1, 2)
        return found

    @property
    def squares(self) -> float:
        """Those of the measurement."""
        return float(self.of(np.array([[len(self.whole) - 1]]))[0, 0, 0])

    @property
    def diagonal(self) -> np.ndarray:
        """(D,) those of each column."""
        return self.of(np.arange(len(self.whole) - 1)[:, None])[:, 0, 0]


def _project(train: np.ndarray, test: np.ndarray, base: int, chosen: Sequence[int]) -> tuple[_Products, _Products]:
    """Return the products of what a fit on `train` leaves of each column: on train, and on test."""
    inside, weights = _weights(train, base, chosen)
    own = np.ascontiguousarray(weights.T)
    seen = np.ascontiguousarray(test[inside].T)
    fitted = seen - own @ test[np.ix_(inside, inside)]
    return (
        _Products(train, ((np.ascontiguousarray(train[inside].T), own),)),
        _Products(test, ((own, fitted), (seen, own))),
    )


def _fit(
    train: _Products, test: _Products, batches: Sequence[_Batch], count: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray, list[np.ndarray]]:
    """Fit each variant on train; return the objective there, the squares left and added on test, the coefficients."""
    objective, left_out, added = np.empty((3, count))
    values: list[np.ndarray] = [np.zeros(0)] * count
    for batch in batches:
        target = np.full((len(batch.columns), 1), len(train.whole) - 1)
        both = np.concatenate([batch.columns, target], axis=1)
        on_train, on_test = train.of(both), test.of(both)
        normal, right = on_train[:, :-1, :-1], on_train[:, :-1, -1]
        solved = _bounded(normal + np.eye(normal.shape[1]), right, batch.lowest)
        objective[batch.place] = _squares(on_train, solved) + (solved**2).sum(axis=1)
        left_out[batch.place] = _squares(on_test, solved)
        added[batch.place] = np.einsum("vi,vij,vj->v", solved, on_test[:, :-1, :-1], solved)
        for place, value in zip(batch.place, solved, strict=True):
            values[place] = value
    return objective, left_out, added, values


def _bounded(normal: np.ndarray, right: np.ndarray, lowest: np.ndarray) -> np.ndarray:
    """Solve V small systems (V, k, k); what falls below its bound is put there, the rest solved again."""
    solved = np.linalg.solve(normal, right[..., None])[..., 0]
    fixed = np.zeros(solved.shape, dtype=bool)
    for _ in range(normal.shape[1]):
        below = (solved < lowest) & ~fixed
        if not below.any():
            break
        fixed |= below
        held = np.where(fixed, lowest, 0.0)
        held[~np.isfinite(held)] = 0.0
        free = ~fixed
        system = normal * (free[:, :, None] & free[:, None, :])
        system[:, range(normal.shape[1]), range(normal.shape[1])] += fixed
        target = np.where(fixed, held, right - np.einsum("vij,vj->vi", normal, held))
        solved = np.linalg.solve(system, target[..., None])[..., 0]
    return solved


def _squares(products: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Return what V fits leave of the measurement: products (V, k + 1, k + 1), it last; values (V, k)."""
    weights = np.concatenate([-values, np.ones((len(values), 1))], axis=1)
    return np.asarray(np.einsum("vi,vij,vj->v", weights, products, weights))


def _best(objective: np.ndarray, owner: np.ndarray, count: int) -> np.ndarray:
    """Return, for each hypothesis, the place of its variant of the least objective."""
    order = np.lexsort((objective, owner))
    first = np.searchsorted(owner[order], np.arange(count))
    return np.asarray(order[first])

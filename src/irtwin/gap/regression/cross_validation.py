"""Hypotheses tried on groups left out: everything is refitted without each group in turn."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import reduce

import numpy as np

from irtwin.gap.regression.bounded import bounded_small
from irtwin.gap.regression.hypotheses import Variant
from irtwin.gap.regression.normal_equations import Fitted, System
from irtwin.gap.regression.split import Products, Split, split
from irtwin.gap.regression.transient import is_transient

_NEXT_TO_NOTHING = 1e-3  # of the noise's squares: what a bound adds to them at least, to be looked at with a variant
_QUIET = 0.3  # of the noise: what is left of a block is never taken for less


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
    """Variants of one number of coefficients: `place` (V,) in all variants, `columns` (V, o + k), `lowest` likewise.

    The first columns are those that the split holds apart, (o,), the same in each.
    """

    place: np.ndarray
    columns: np.ndarray
    lowest: np.ndarray


class _Fits:
    """What fits of V variants leave: the objective on train, squares left and added on test; their coefficients."""

    def __init__(self, count: int):
        self.objective, self.left, self.added = np.empty((3, count))
        self.values: list[np.ndarray] = [np.zeros(0)] * count

    def fit(self, one: Split, batches: Sequence[_Batch]) -> None:
        """Fit each variant of some batches on train."""
        before = one.fitted.values[one.apart]
        others, last = len(before), len(one.train.whole) - 1
        for batch in batches:
            both = np.concatenate([batch.columns, np.full((len(batch.columns), 1), last)], axis=1)
            on_train, on_test = one.train.of(both), one.test.of(both)
            own = np.diag(np.arange(batch.columns.shape[1]) >= others)  # the others' prior is in train
            found = bounded_small(on_train[:, :-1, :-1] + own, on_train[:, :-1, -1], batch.lowest)
            self.objective[batch.place] = _squares(on_train, found) + (found[:, others:] ** 2).sum(axis=1)
            self.left[batch.place] = _squares(on_test, found)
            added = found - np.append(before, np.zeros(found.shape[1] - others))
            self.added[batch.place] = np.einsum("vi,vij,vj->v", added, on_test[:, :-1, :-1], added)
            for place, value in zip(batch.place, found[:, others:], strict=True):
                self.values[place] = value


@dataclass(frozen=True)
class _Moving:
    """Variants beside which other terms move from or onto their lowest value: these are fitted with each of them.

    `kept`: the columns of the fit, those of the variants and, last, the measurement, among all; `apart` (k,): which of
    the fit move. Batches count columns as `kept` does.
    """

    kept: np.ndarray
    apart: np.ndarray
    batches: list[_Batch]

    def fit(self, into: _Fits, fitted: Fitted, prior: np.ndarray, train: np.ndarray, test: np.ndarray) -> None:
        """Fit them, and the terms that they move, to products of all columns."""
        if not self.batches:
            return
        there, inside = np.ix_(self.kept, self.kept), np.arange(len(fitted.inside))
        one = split(replace(fitted, inside=inside), prior, train[there], test[there], np.flatnonzero(self.apart))
        into.fit(one, self.batches)


def attempt(
    system: System, moments: Sequence[np.ndarray], chosen: Sequence[int], candidates: Sequence[Sequence[Variant]]
) -> Trial:
    """Try hypotheses, each a list of variants, beside the twin's terms and the `chosen` columns.

    Everything is refitted without each group in turn; the shape (variant) is chosen inside the training groups. What is
    brief has its coefficients from all groups: other runs cannot tell them, and joints have told that they agree.
    """
    variants = [variant for group in candidates for variant in group]
    owner = np.repeat(np.arange(len(candidates)), [len(group) for group in candidates])
    prior, total = system.prior(chosen), reduce(np.add, moments)
    fitted = system.fitted(chosen, total)
    whole = split(fitted, prior, total.copy(), total)
    batches, fits = _batches(system, variants), _Fits(len(variants))
    fits.fit(whole, batches)
    batches, moving = _parted(system, whole, variants, batches, fits.values)
    moving.fit(fits, fitted, prior, total, total)
    start = np.empty(len(moments))
    loss, said = np.empty((2, len(candidates), len(moments)))
    for group, part in enumerate(moments):
        train, without = total - part, _Fits(len(variants))
        fitted = system.fitted(chosen, train)
        moving.fit(without, fitted, prior, train, part)
        one = split(fitted, prior, train, part)
        start[group] = one.test.squares
        without.fit(one, batches)
        for place, variant in enumerate(variants):
            if is_transient(variant.effect):
                without.left[place] = _left(one.test, variant.columns, fits.values[place])
        best = _best(without.objective, owner, len(candidates))
        loss[:, group], said[:, group] = without.left[best], without.added[best]
    best = _best(fits.objective, owner, len(candidates))
    diagonal = whole.train.diagonal
    rows = max(float(system.rows.sum(axis=0).max(initial=0.0)), 1.0)
    visible = np.array([diagonal[list(variants[k].columns)].sum() / rows for k in best])
    before = np.diag(total)
    share = np.array([_ratio(diagonal[list(variants[k].columns)], before[list(variants[k].columns)]) for k in best])
    return Trial(start, loss, said, best, tuple(fits.values[k] for k in best), visible, share)


def scores(
    system: System, moments: Sequence[np.ndarray], noise: np.ndarray, chosen: Sequence[int]
) -> tuple[np.ndarray, np.ndarray]:
    """Return each block's score of each column (B, D), and the products of projected columns (D + 1, D + 1).

    A block's equations count by the inverse of what is left of them, so that no few blocks decide alone.
    """
    total = reduce(np.add, moments)
    fit = split(system.fitted(chosen, total), system.prior(chosen), total.copy(), total)
    free, weights = fit.free, fit.weights
    rest = np.zeros(len(total))
    rest[-1] = 1.0
    rest[fit.fitted.inside] = -fit.fitted.values
    found = np.empty((len(system.blocks), len(total) - 1))
    for block in range(len(system.blocks)):
        vector = np.zeros(len(total))
        for equation, level in enumerate(noise):
            left, products = system.scored(block, equation, rest)
            loud = np.sqrt(left @ left / max(system.blocks[block].rows[equation], 1)) / level
            vector += products / level**2 / max(float(loud), _QUIET)
        found[block] = (vector - weights.T @ vector[free])[:-1]
    return found, fit.train.rows(np.arange(len(total)))


def canonical_correlation(
    system: System, total: np.ndarray, chosen: Sequence[int], sets: Sequence[Sequence[int]]
) -> np.ndarray:
    """Return the largest canonical correlation of each set of columns with the first set, (S,), after the refit.

    total: (D + 1, D + 1) products of columns. What the prior holds near zero anyway correlates with nothing.
    """
    whole = split(system.fitted(chosen, total), system.prior(chosen), total.copy(), total).train
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


def _ratio(part: np.ndarray, whole: np.ndarray) -> float:
    return float(part.sum() / whole.sum()) if whole.sum() > 0 else 0.0


def _left(test: Products, columns: Sequence[int], values: np.ndarray) -> float:
    """Return the squares left on test by known coefficients of some columns."""
    both = np.array([[*columns, len(test.whole) - 1]])
    return float(_squares(test.of(both), values[None])[0])


def _batches(system: System, variants: Sequence[Variant]) -> list[_Batch]:
    sizes: dict[int, list[int]] = {}
    for place, variant in enumerate(variants):
        sizes.setdefault(len(variant.columns), []).append(place)
    found = []
    for places in sizes.values():
        columns = np.array([variants[place].columns for place in places])
        found.append(_Batch(np.array(places), columns, system.lowest[columns]))
    return found


def _parted(
    system: System, whole: Split, variants: Sequence[Variant], batches: Sequence[_Batch], values: Sequence[np.ndarray]
) -> tuple[list[_Batch], _Moving]:
    """Return the batches without the variants that move other terms from or onto their lowest value, and these."""
    inside = whole.fitted.inside
    moves, apart = _moved(system, whole, variants, values)
    own_columns = [variants[place].columns for place in np.flatnonzero(moves).tolist()]
    columns = np.array(sorted({k for own in own_columns for k in own}), dtype=int)
    still, moving = [], []
    for batch in batches:
        own = moves[batch.place]
        still.append(_Batch(batch.place[~own], batch.columns[~own], batch.lowest[~own]))
        if own.any():
            count = own.sum()
            at = len(inside) + np.searchsorted(columns, batch.columns[own])
            both = np.concatenate([np.tile(np.flatnonzero(apart), (count, 1)), at], axis=1)
            lowest = np.concatenate([np.tile(system.lowest[inside[apart]], (count, 1)), batch.lowest[own]], axis=1)
            moving.append(_Batch(batch.place[own], both, lowest))
    kept = np.concatenate([inside, columns, [len(whole.train.whole) - 1]])
    return [batch for batch in still if len(batch.place)], _Moving(kept, apart, moving)


def _moved(
    system: System, whole: Split, variants: Sequence[Variant], values: Sequence[np.ndarray]
) -> tuple[np.ndarray, np.ndarray]:
    """Return which variants (V,) move columns of the fit from or onto their lowest value, and which columns, (k,)."""
    least = _NEXT_TO_NOTHING * float(system.rows.max(axis=1).sum())
    bound = np.isfinite(system.lowest[whole.free])
    free, weights, variances = whole.free[bound], whole.weights[bound], whole.variances[bound]
    pulls, lowest = whole.pulls, system.lowest[free]
    sizes = np.diagonal(pulls[:, whole.at])
    moves, terms = np.zeros(len(variants), dtype=bool), set[int]()
    for place, (variant, value) in enumerate(zip(variants, values, strict=True)):
        if is_transient(variant.effect):
            continue
        columns = list(variant.columns)
        below = np.maximum(lowest - (weights[:, -1] - weights[:, columns] @ value), 0.0)
        up = np.maximum(pulls[:, -1] - pulls[:, columns] @ value, 0.0)
        own = {*free[below**2 > least * variances].tolist(), *whole.at[up**2 > least * sizes].tolist()}
        moves[place] = bool(own)
        terms |= own
    return moves, np.isin(whole.fitted.inside, list(terms))


def _squares(products: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Return what V fits leave of the measurement: products (V, k + 1, k + 1), it last; values (V, k)."""
    weights = np.concatenate([-values, np.ones((len(values), 1))], axis=1)
    return np.asarray(np.einsum("vi,vij,vj->v", weights, products, weights))


def _best(objective: np.ndarray, owner: np.ndarray, count: int) -> np.ndarray:
    """Return, for each hypothesis, the place of its variant of the least objective."""
    order = np.lexsort((objective, owner))
    first = np.searchsorted(owner[order], np.arange(count))
    return np.asarray(order[first])

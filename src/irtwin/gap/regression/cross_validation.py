"""Hypotheses tried on groups left out: everything is refitted without each group in turn."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import reduce

import numpy as np

from irtwin.gap.regression.cholesky import factored, solved
from irtwin.gap.regression.hypotheses import Variant, bounds
from irtwin.gap.regression.normal_equations import System
from irtwin.gap.regression.transient import is_transient

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
    whole, _ = _project(system, total, total, chosen)
    objective, _, _, values = _fit(whole, whole, batches, len(variants))
    start = np.empty(len(moments))
    loss, said = np.empty((2, len(candidates), len(moments)))
    for group, part in enumerate(moments):
        train, test = _project(system, total - part, part, chosen)
        start[group] = test.squares
        inner, left_out, added, _ = _fit(train, test, batches, len(variants))
        for place, variant in enumerate(variants):
            if is_transient(variant.effect):
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
    inside, weights = _weights(system, total, chosen)
    rest = np.zeros(len(total))
    rest[-1] = 1.0
    rest[inside] = -weights[:, -1]
    found = np.empty((len(system.blocks), len(total) - 1))
    for block in range(len(system.blocks)):
        vector = np.zeros(len(total))
        for equation, level in enumerate(noise):
            left, products = system.scored(block, equation, rest)
            loud = np.sqrt(left @ left / max(system.blocks[block].rows[equation], 1)) / level
            vector += products / level**2 / max(float(loud), _QUIET)
        found[block] = (vector - weights.T @ vector[inside])[:-1]
    return found, total - total[inside].T @ weights


def canonical_correlation(
    system: System, total: np.ndarray, chosen: Sequence[int], sets: Sequence[Sequence[int]]
) -> np.ndarray:
    """Return the largest canonical correlation of each set of columns with the first set, (S,), after the refit.

    total: (D + 1, D + 1) products of columns. What the prior holds near zero anyway correlates with nothing.
    """
    whole, _ = _project(system, total, total, chosen)
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


def _weights(system: System, total: np.ndarray, chosen: Sequence[int]) -> tuple[np.ndarray, np.ndarray]:
    """Return the fitted columns' indices, and their weights in the fit of every column and of the measurement."""
    inside = np.append(np.arange(system.base), np.array(chosen, dtype=int))
    return inside, solved(factored(total[np.ix_(inside, inside)], system.prior(chosen)), total[inside])


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


def _project(system: System, train: np.ndarray, test: np.ndarray, chosen: Sequence[int]) -> tuple[_Products, _Products]:
    """Return the products of what a fit on `train` leaves of each column: on train, and on test."""
    inside, weights = _weights(system, train, chosen)
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

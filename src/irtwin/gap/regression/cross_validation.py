"""Hypotheses tried on groups left out: everything is refitted without each group in turn."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from irtwin.gap.regression.cholesky import factored, solved
from irtwin.gap.regression.hypotheses import Variant, bounds
from irtwin.gap.regression.moments import Moments, summed
from irtwin.gap.regression.normal_equations import System
from irtwin.gap.regression.transient import is_transient
from irtwin.identification.progress import Tell, paced

_PANEL = 256  # rows of a product of matrices, at least
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
    system: System,
    moments: Sequence[Moments],
    chosen: Sequence[int],
    candidates: Sequence[Sequence[Variant]],
    tell: Tell | None = None,
) -> Trial:
    """Try hypotheses, each a list of variants, beside the twin's terms and the `chosen` columns.

    Everything is refitted without each group in turn; the shape (variant) is chosen inside the training groups. What is
    brief has its coefficients from all groups: other runs cannot tell them, and joints have told that they agree.
    `tell` is told how far that has come, where it takes long.
    """
    variants = [variant for group in candidates for variant in group]
    owner = np.repeat(np.arange(len(candidates)), [len(group) for group in candidates])
    batches = _batches(system, variants)
    told = paced(tell)
    told(f"  {len(candidates)} hypotheses, in all groups")
    total = summed(moments)
    asked = _asked(total, [k for variant in variants for k in variant.columns])
    whole, _ = _project(system, total, None, chosen, asked)
    told(f"  {len(candidates)} hypotheses, in all groups")
    objective, _, _, values = _fit(whole, whole, batches, len(variants))
    start = np.empty(len(moments))
    loss, said = np.empty((2, len(candidates), len(moments)))
    for group, part in enumerate(moments):
        told(f"  {len(candidates)} hypotheses, group {group + 1} of {len(moments)} left out")
        train, test = _project(system, total, part, chosen, asked)
        start[group] = test.squares([total.size - 1])[0]
        inner, left_out, adds, _ = _fit(train, test, batches, len(variants))
        for place, variant in enumerate(variants):
            if is_transient(variant.effect):
                left_out[place] = _left(test, variant.columns, values[place])
        best = _best(inner, owner, len(candidates))
        loss[:, group], said[:, group] = left_out[best], adds[best]
    told(f"  {len(candidates)} hypotheses, what each adds")
    best = _best(objective, owner, len(candidates))
    columns = [k for place in best for k in variants[place].columns]
    ends = np.cumsum([len(variants[place].columns) for place in best])[:-1]
    left, before = (np.split(each.squares(columns), ends) for each in (whole, total))
    rows = max(float(system.rows.sum(axis=0).max(initial=0.0)), 1.0)
    visible = np.array([own.sum() / rows for own in left])
    share = np.array([_ratio(own, every) for own, every in zip(left, before, strict=True)])
    return Trial(start, loss, said, best, tuple(values[k] for k in best), visible, share)


def scores(
    system: System,
    moments: Sequence[Moments],
    noise: np.ndarray,
    chosen: Sequence[int],
    tell: Tell | None = None,
) -> tuple[np.ndarray, Projected]:
    """Return each block's score of each column (B, D), and the products of what the fit leaves of columns.

    A block's equations count by the inverse of what is left of them, so that no few blocks decide alone. `tell` as
    for `attempt`.
    """
    total = summed(moments)
    inside = _inside(system, chosen)
    products = total.of(inside)
    weights = _weights(system, inside, products[:, inside], products)
    rest = np.zeros(total.size)
    rest[-1] = 1.0
    rest[inside] = -weights[:, -1]
    found = np.empty((len(system.blocks), total.size - 1))
    told = paced(tell)
    for block in range(len(system.blocks)):
        told(f"  whether chance reaches what they gain, block {block + 1} of {len(system.blocks)}")
        vector = np.zeros(total.size)
        for equation, level in enumerate(noise):
            left, own = system.scored(block, equation, rest)
            loud = np.sqrt(left @ left / max(system.blocks[block].rows[equation], 1)) / level
            vector += own / level**2 / max(float(loud), _QUIET)
        found[block] = (vector - weights.T @ vector[inside])[:-1]
    return found, Projected.by(total, np.arange(total.size), products, weights)


def canonical_correlation(
    system: System, total: Moments, chosen: Sequence[int], sets: Sequence[Sequence[int]]
) -> np.ndarray:
    """Return the largest canonical correlation of each set of columns with the first set, (S,), after the refit.

    What the prior holds near zero anyway correlates with nothing.
    """
    asked = _asked(total, [k for columns in sets for k in columns])
    whole, _ = _project(system, total, None, chosen, asked)
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


def _left(test: Projected, columns: Sequence[int], values: np.ndarray) -> float:
    """Return the squares left on test by known coefficients of some columns."""
    both = np.array([[*columns, test.whole.size - 1]])
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


def _inside(system: System, chosen: Sequence[int]) -> np.ndarray:
    """Return the indices of the columns that are fitted."""
    return np.append(np.arange(system.base), np.array(chosen, dtype=int))


def _asked(total: Moments, columns: Sequence[int]) -> np.ndarray:
    """Return the columns that are asked for and the measurement, in order.

    A few are made more by repeating the last: BLAS rounds products of few rows in a way of its own, and what comes out
    should not depend on what else is asked.
    """
    asked = np.unique([*columns, total.size - 1])
    return np.pad(asked, (0, max(0, _PANEL - len(asked))), mode="edge")


def _weights(system: System, inside: np.ndarray, among: np.ndarray, products: np.ndarray) -> np.ndarray:
    """Return the weights (c, a) of the columns `inside` in the fit of others, by their products (c, c) and (c, a)."""
    return solved(factored(among, system.prior(inside[system.base :])), products)


@dataclass(frozen=True)
class Projected:
    """Products of what a fit leaves of the columns that are `asked` (a,), worked out where they are needed.

    `whole`: products of the columns as they are; of each pair (a, c) the product is taken off.
    """

    whole: Moments
    asked: np.ndarray
    pairs: tuple[tuple[np.ndarray, np.ndarray], ...]

    @classmethod
    def by(cls, whole: Moments, asked: np.ndarray, products: np.ndarray, weights: np.ndarray) -> Projected:
        """Take the products (c, a) of the columns that are fitted, and their weights in the fit to these."""
        return cls(whole, asked, ((np.ascontiguousarray(products.T), np.ascontiguousarray(weights.T)),))

    def of(self, columns: np.ndarray) -> np.ndarray:
        """Return the products among each row of columns: (V, k) -> (V, k, k)."""
        found = self.whole.blocks(columns)
        places = np.searchsorted(self.asked, columns)
        for left, right in self.pairs:
            found = found - left[places] @ right[places].swapaxes(1, 2)
        return found

    def each(self, sets: Sequence[tuple[int, ...]]) -> dict[tuple[int, ...], np.ndarray]:
        """Return the products among the columns of each set, (k, k)."""
        found: dict[tuple[int, ...], np.ndarray] = {}
        for size in {len(columns) for columns in sets}:
            own = [columns for columns in sets if len(columns) == size]
            found |= dict(zip(own, self.of(np.array(own)), strict=True))
        return found

    def squares(self, columns: Sequence[int]) -> np.ndarray:
        """Return the squares (k,) of some columns."""
        return self.of(np.array(columns)[:, None])[:, 0, 0]


def _project(
    system: System, total: Moments, left_out: Moments | None, chosen: Sequence[int], asked: np.ndarray
) -> tuple[Projected, Projected]:
    """Return the products of what a fit leaves of the columns `asked`: where it was fitted, and in the groups left out.

    Without any left out, both are of all groups.
    """
    inside = _inside(system, chosen)
    every = np.append(inside, asked)
    products = total.among(inside, every)
    seen = None if left_out is None else left_out.among(inside, every)
    if seen is not None:
        products = products - seen
    among, beside = products[:, : len(inside)], products[:, len(inside) :]
    fitted_to = total if left_out is None else total - left_out
    train = Projected.by(fitted_to, asked, beside, _weights(system, inside, among, beside))
    if left_out is None or seen is None:
        return train, train
    own, across = train.pairs[0][1], np.ascontiguousarray(seen[:, len(inside) :].T)
    fitted = across - own @ seen[:, : len(inside)]
    return train, Projected(left_out, asked, ((own, fitted), (across, own)))


def _fit(
    train: Projected, test: Projected, batches: Sequence[_Batch], count: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray, list[np.ndarray]]:
    """Fit each variant on train; return the objective there, the squares left and added on test, the coefficients."""
    objective, left_out, adds = np.empty((3, count))
    values: list[np.ndarray] = [np.zeros(0)] * count
    for batch in batches:
        target = np.full((len(batch.columns), 1), train.whole.size - 1)
        both = np.concatenate([batch.columns, target], axis=1)
        on_train, on_test = train.of(both), test.of(both)
        normal, right = on_train[:, :-1, :-1], on_train[:, :-1, -1]
        solved = _bounded(normal + np.eye(normal.shape[1]), right, batch.lowest)
        objective[batch.place] = _squares(on_train, solved) + (solved**2).sum(axis=1)
        left_out[batch.place] = _squares(on_test, solved)
        adds[batch.place] = np.einsum("vi,vij,vj->v", solved, on_test[:, :-1, :-1], solved)
        for place, value in zip(batch.place, solved, strict=True):
            values[place] = value
    return objective, left_out, adds, values


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

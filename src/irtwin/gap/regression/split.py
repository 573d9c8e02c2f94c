"""A fit on some groups held against others: what it leaves of every column, on both."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from irtwin.gap.regression.cholesky import factored, solved
from irtwin.gap.regression.normal_equations import Fitted


@dataclass(frozen=True)
class Products:
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

    def rows(self, columns: np.ndarray) -> np.ndarray:
        """Return the products of some columns with every column, (k, D + 1)."""
        found: np.ndarray = self.whole[columns]
        for left, right in self.pairs:
            found = found - left[columns] @ right.T
        return found

    @property
    def squares(self) -> float:
        """Those of the measurement."""
        return float(self.of(np.array([[len(self.whole) - 1]]))[0, 0, 0])

    @property
    def diagonal(self) -> np.ndarray:
        """(D,) those of each column."""
        return self.of(np.arange(len(self.whole) - 1)[:, None])[:, 0, 0]


@dataclass(frozen=True)
class Split:
    """What is left on `train` and on `test` by a fit of the twin's terms and the chosen columns to train, `fitted`.

    Those `at` their lowest value (h,) are held there; the `free` ones (f,) are projected out, with `weights` (f, D + 1)
    in the fit of every column and of the measurement. Those that are `apart`, of the fitted ones (k,), are neither.
    Products on train hold the prior of all these.
    """

    train: Products
    test: Products
    fitted: Fitted
    apart: np.ndarray
    free: np.ndarray
    at: np.ndarray
    weights: np.ndarray

    @cached_property
    def pulls(self) -> np.ndarray:
        """(h, D + 1) products of what is left of those held with what is left of every column."""
        return self.train.rows(self.at)

    @cached_property
    def variances(self) -> np.ndarray:
        """(f,) of the free coefficients."""
        among = self.train.whole[np.ix_(self.free, self.free)]
        return np.diag(solved(factored(among, np.zeros_like(among)), np.eye(len(among))))


def split(
    fitted: Fitted, prior: np.ndarray, train: np.ndarray, test: np.ndarray, apart: np.ndarray | None = None
) -> Split:
    """Return what a fit to products `train` (D + 1, D + 1) leaves; those `apart` (o,) are only prepared.

    The `prior` (k, k) of the fitted columns is added to `train` itself.
    """
    inside = fitted.inside
    own = np.zeros(len(inside), dtype=bool) if apart is None else np.isin(inside, apart)
    train[np.ix_(inside, inside)] += prior
    free, at = inside[~fitted.held & ~own], inside[fitted.held & ~own]
    values = fitted.values[fitted.held & ~own]
    given = [_less(products, at, values) for products in (train, test)]
    own_rows, seen = (one.rows(free) for one in given)
    among = train[np.ix_(free, free)]
    weights = solved(factored(among, np.zeros_like(among)), own_rows)
    mine = np.ascontiguousarray(weights.T)
    seen = np.ascontiguousarray(seen.T)
    left = seen - mine @ test[np.ix_(free, free)]
    return Split(
        Products(train, (*given[0].pairs, (np.ascontiguousarray(own_rows.T), mine))),
        Products(test, (*given[1].pairs, (mine, left), (seen, mine))),
        fitted,
        own,
        free,
        at,
        weights,
    )


def _less(products: np.ndarray, columns: np.ndarray, values: np.ndarray) -> Products:
    """Return products of all columns where the measurement is less what some columns say with known coefficients."""
    if not values.any():
        return Products(products, ())
    taken, last = products[:, columns] @ values, np.zeros(len(products))
    last[-1] = 1.0
    rest = taken - last * float(values @ taken[columns])
    return Products(products, ((np.column_stack([last, rest]), np.column_stack([taken, last])),))

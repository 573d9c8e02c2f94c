"""What a fit leaves of columns: their products, and each block's score of each column."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from irtwin.gap.regression.cholesky import factored, solved
from irtwin.gap.regression.moments import Moments, Summed
from irtwin.gap.regression.normal_equations import System

_PANEL = 256  # rows of a product of matrices, at least
_QUIET = 0.3  # of the noise: what is left of a block is never taken for less


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

    def squares(self, columns: Sequence[int]) -> np.ndarray:
        """Return the squares (k,) of some columns."""
        return self.of(np.array(columns)[:, None])[:, 0, 0]


def projected(system: System, total: Moments, inside: np.ndarray, asked: np.ndarray) -> Projected:
    """Return the products of what a fit of the columns `inside` to all groups leaves of the columns `asked`."""
    products = total.among(inside, np.append(inside, asked))
    among, beside = products[:, : len(inside)], products[:, len(inside) :]
    return Projected.by(total, asked, beside, _weights(system, inside, among, beside))


def projected_in(part: Moments, whole: Projected, inside: np.ndarray) -> Projected:
    """Return the same products in one group, by the fit to all."""
    asked, own = whole.asked, whole.pairs[0][1]
    seen = part.among(inside, np.append(inside, asked))
    across = np.ascontiguousarray(seen[:, len(inside) :].T)
    return Projected(part, asked, ((own, across - own @ seen[:, : len(inside)]), (across, own)))


def scores(
    system: System, moments: Sequence[Moments], noise: np.ndarray, chosen: Sequence[int]
) -> tuple[np.ndarray, Projected]:
    """Return each block's score of each column (B, D), and the products of what the fit leaves of columns.

    A block's equations count by the inverse of what is left of them, so that no few blocks decide alone.
    """
    total = Summed(moments)
    inside = fitted_columns(system, chosen)
    products = total.of(inside)
    weights = _weights(system, inside, products[:, inside], products)
    rest = np.zeros(total.size)
    rest[-1] = 1.0
    rest[inside] = -weights[:, -1]
    found = np.empty((len(system.blocks), total.size - 1))
    for block in range(len(system.blocks)):
        vector = np.zeros(total.size)
        for equation, level in enumerate(noise):
            left, own = system.scored(block, equation, rest)
            loud = np.sqrt(left @ left / max(system.blocks[block].rows[equation], 1)) / level
            vector += own / level**2 / max(float(loud), _QUIET)
        found[block] = (vector - weights.T @ vector[inside])[:-1]
    return found, Projected.by(total, np.arange(total.size), products, weights)


def fitted_columns(system: System, chosen: Sequence[int]) -> np.ndarray:
    """Return the indices of the columns that are fitted: the twin's and those chosen."""
    return np.append(np.arange(system.base), np.array(chosen, dtype=int))


def asked_columns(total: Moments, columns: Sequence[int]) -> np.ndarray:
    """Return the columns that are asked for and the measurement, in order.

    A few are made more by repeating the last: BLAS rounds products of few rows in a way of its own, and what comes out
    should not depend on what else is asked.
    """
    asked = np.unique([*columns, total.size - 1])
    return np.pad(asked, (0, max(0, _PANEL - len(asked))), mode="edge")


def _weights(system: System, inside: np.ndarray, among: np.ndarray, products: np.ndarray) -> np.ndarray:
    """Return the weights (c, a) of the columns `inside` in the fit of others, by their products (c, c) and (c, a)."""
    return solved(factored(among, system.prior(inside[system.base :])), products)

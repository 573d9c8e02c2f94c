"""What a fit leaves of columns: their products."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from irtwin.gap.regression.cholesky import factored, solved
from irtwin.gap.regression.moments import Moments
from irtwin.gap.regression.normal_equations import System

_PANEL = 256  # rows of a product of matrices, at least


@dataclass(frozen=True)
class Projected:
    """Products of what a fit leaves of the columns that are `asked` (a,), worked out where they are needed.

    `whole`: products of the columns as they are; of each pair (a, c) the product is taken off.
    """

    whole: Moments
    asked: np.ndarray
    pairs: tuple[tuple[np.ndarray, np.ndarray], ...]

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
    weights = solved(factored(among, system.prior(inside[system.base :])), beside)
    return Projected(total, asked, ((np.ascontiguousarray(beside.T), np.ascontiguousarray(weights.T)),))


def projected_in(part: Moments, whole: Projected, inside: np.ndarray) -> Projected:
    """Return the same products in one group, by the fit to all."""
    asked, own = whole.asked, whole.pairs[0][1]
    seen = part.among(inside, np.append(inside, asked))
    across = np.ascontiguousarray(seen[:, len(inside) :].T)
    return Projected(part, asked, ((own, across - own @ seen[:, : len(inside)]), (across, own)))


def asked_columns(total: Moments, columns: Sequence[int]) -> np.ndarray:
    """Return the columns that are asked for and the measurement, in order.

    A few are made more by repeating the last: BLAS rounds products of few rows in a way of its own, and what comes out
    should not depend on what else is asked.
    """
    asked = np.unique([*columns, total.size - 1])
    return np.pad(asked, (0, max(0, _PANEL - len(asked))), mode="edge")

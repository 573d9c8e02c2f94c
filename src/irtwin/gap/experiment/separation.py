"""How far apart two explanations lie, on the data there are and on those of an experiment.

All of it works on products of columns (D + 1, D + 1), in units of the terms' priors and of the noise, the last column
being the measurement: see `irtwin.gap.regression.normal_equations`.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from irtwin.gap.regression.cholesky import factored, solved
from irtwin.gap.regression.moments import Moments
from irtwin.gap.regression.normal_equations import System
from irtwin.gap.regression.projection import scores

_LEAST = 1.0  # squares of a column in units of its prior: with less the prior decides


def projected(total: np.ndarray, inside: Sequence[int], prior: np.ndarray | None = None) -> np.ndarray:
    """Return the products of what the columns `inside` (c), refitted, leave of all columns; `prior`: its products."""
    kept = np.array(inside, dtype=int)
    return np.asarray(total - total[:, kept] @ solved(factored(total[np.ix_(kept, kept)], prior), total[kept]))


def fitted(left: np.ndarray, own: Sequence[int]) -> np.ndarray:
    """Return the values (k,) of columns in their fit to projected products, and nothing else in it."""
    part = list(own)
    return np.asarray(np.linalg.solve(left[np.ix_(part, part)] + np.eye(len(part)), left[part, -1]))


def unimitated(left: np.ndarray, own: Sequence[int], values: np.ndarray, by: Sequence[int]) -> float:
    """Return the squares that columns `by`, refitted, leave of the columns `own` with their values (k,)."""
    part, rival = list(own), list(by)
    squares = float(values @ left[np.ix_(part, part)] @ values)
    if rival:
        cross = left[np.ix_(rival, part)] @ values
        squares -= float(cross @ np.linalg.solve(left[np.ix_(rival, rival)] + np.eye(len(rival)), cross))
    return max(squares, 0.0)


def dispersion(system: System, moments: Sequence[Moments], noise: np.ndarray, chosen: Sequence[int]) -> float:
    """Return how many times more than with independent samples the scores of columns vary.

    Samples of one run are not independent, so what a fit leaves counts by this the less: the median over all candidate
    columns, between blocks of time or between groups of runs, whichever is the larger, and at least one.
    moments, noise: as of `System.moments`; chosen: the columns fitted beside the twin's.
    """
    by_block, products = scores(system, moments, noise, chosen)
    sizes = products.squares(range(by_block.shape[1]))
    judged = np.arange(system.base, len(sizes))
    judged = np.setdiff1d(judged[sizes[judged] > _LEAST], chosen)
    if not len(judged):
        return 1.0
    by_group = np.array([by_block[system.group == group].sum(axis=0) for group in range(system.groups)])
    return max(1.0, *(float(np.median((s[:, judged] ** 2).sum(axis=0) / sizes[judged])) for s in (by_block, by_group)))

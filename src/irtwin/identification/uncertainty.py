"""How sure an estimate is: intervals that respect correlated samples."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.linalg import solve_triangular
from scipy.stats import t as student

from irtwin.identification.accumulate import Block, triangle

_LEVEL = 0.95
_LEARNT = 0.5  # of the prior's standard deviation: an estimate less sure than this says what was expected, not measured


def covariance(
    blocks: Sequence[Block],
    pattern: np.ndarray,
    rows: np.ndarray,
    values: np.ndarray,
    noise: np.ndarray,
    spread: np.ndarray,
) -> np.ndarray:
    """Return the (K, K) covariance of weighted least squares under a prior of standard deviations `spread`.

    rows: (r, K) columns of all equations, weighted, as triangular factors; noise: (g,) that they were weighted by.

    Samples of a run are not independent, so the scatter is taken between blocks of time (a cluster-robust sandwich,
    Liang and Zeger 1986), never below what independent rows would give; what the prior decides adds the prior's own.
    """
    scores = np.zeros((len(blocks), len(values)))
    for equation, used in enumerate(pattern):
        extended = np.append(values[used], -1.0)
        for number, block in enumerate(blocks):
            factor = block.factors[equation] / noise[equation]
            scores[number, used] += factor[:, :-1].T @ (factor @ extended)
    # in units of the spread; through a triangle, as normal equations would lose what the prior alone decides
    root = solve_triangular(triangle(np.concatenate([rows * spread, np.eye(len(values))])), np.eye(len(values)))
    groups = max(len(blocks), 2)
    between = (scores * spread) @ root
    middle = between.T @ between * groups / (groups - 1) + root.T @ root
    sandwich, independent = root @ middle @ root.T, root @ root.T
    grown = np.sqrt(np.maximum(1.0, np.diag(independent) / np.diag(sandwich))) * spread
    return np.asarray(sandwich * np.outer(grown, grown))


def half_widths(covariance: np.ndarray, spread: np.ndarray, blocks: int) -> np.ndarray:
    """Return half the 95 % interval of each of K coefficients; NaN where the data did not decide it.

    `spread`: (K,) the prior's standard deviations; `blocks`: how many the covariance rests on (Student's t).
    """
    deviation = np.sqrt(np.maximum(np.diag(covariance), 0.0))  # a sure sum of unsure terms may round below
    factor = float(student.ppf((1 + _LEVEL) / 2, max(blocks - 1, 1)))
    return np.where(deviation < _LEARNT * spread, factor * deviation, np.nan)

"""How sure an estimate is: intervals that respect correlated samples."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.stats import t as student

from irtwin.identification.accumulate import Block

_LEVEL = 0.95
_LEARNT = 0.5  # of the prior's standard deviation: an estimate less sure than this says what was expected, not measured


def covariance(
    blocks: Sequence[Block], pattern: np.ndarray, values: np.ndarray, noise: np.ndarray, prior: np.ndarray
) -> np.ndarray:
    """Return the (K, K) covariance of weighted least squares under a prior.

    Samples of a run are not independent, so the scatter is taken between blocks of time (a cluster-robust sandwich,
    Liang and Zeger 1986), never below what independent rows would give; what the prior decides adds the prior's own.
    """
    count = len(values)
    information = np.zeros((count, count))
    scores = np.zeros((len(blocks), count))
    for equation, used in enumerate(pattern):
        index = np.flatnonzero(used)
        extended = np.append(values[index], -1.0)
        for row, block in enumerate(blocks):
            factor = block.factors[equation] / noise[equation]
            columns = factor[:, :-1]
            information[np.ix_(index, index)] += columns.T @ columns
            scores[row, index] += columns.T @ (factor @ extended)
    scale = 1 / prior
    curvature = information * np.outer(scale, scale) + np.eye(count)
    inverse = np.linalg.inv(curvature) * np.outer(scale, scale)
    groups = max(len(blocks), 2)
    between = scores.T @ scores * groups / (groups - 1)
    sandwich = inverse @ (between + np.diag(prior**2)) @ inverse
    independent = inverse @ (information + np.diag(prior**2)) @ inverse
    grown = np.sqrt(np.maximum(1.0, np.diag(independent) / np.diag(sandwich)))
    return np.asarray(sandwich * np.outer(grown, grown))


def half_widths(covariance: np.ndarray, spread: np.ndarray, blocks: int) -> np.ndarray:
    """Return half the 95 % interval of each of K coefficients; NaN where the data did not decide it.

    `spread`: (K,) the prior's standard deviations; `blocks`: how many the covariance rests on (Student's t).
    """
    deviation = np.sqrt(np.diag(covariance))
    factor = float(student.ppf((1 + _LEVEL) / 2, max(blocks - 1, 1)))
    return np.where(deviation < _LEARNT * spread, factor * deviation, np.nan)

"""How sure an estimate is: intervals that respect correlated samples."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import scipy

from irtwin.effects.effect import NORMAL
from irtwin.identification.accumulate import Block, triangle

LEVEL = 0.95
_LEARNT = 0.5  # of the prior's standard deviation: an estimate less sure than this says what was expected, not measured


def covariance(
    blocks: Sequence[Block],
    pattern: np.ndarray,
    factors: Sequence[np.ndarray],
    values: np.ndarray,
    noise: np.ndarray,
    spread: np.ndarray,
    prior: np.ndarray,
) -> tuple[np.ndarray, float]:
    """Return the (K, K) covariance of weighted least squares, and the design effect.

    The design effect (Kish 1965) is how many rows carry what one independent row would, at least 1; `spread` are the
    units of the `prior` (K, K), rows of noise one.

    factors: each equation's over all blocks, (r, K + 1); noise: (g,) by which they are weighted.

    Samples of a run are not independent, so the scatter is taken between blocks of time (a cluster-robust sandwich,
    Liang and Zeger 1986), never below what independent rows would give; what the prior decides adds the prior's own.
    """
    scores = np.zeros((len(blocks), len(values)))
    for equation, used in enumerate(pattern):
        extended = np.append(values[used], -1.0)
        for number, block in enumerate(blocks):
            factor = block.factors[equation] / noise[equation]
            scores[number, used] += factor[:, :-1].T @ (factor @ extended)
    rows = np.concatenate([factor[:, :-1] / level for factor, level in zip(factors, noise, strict=True)])
    # in units of the spread; through a triangle, as normal equations would lose what the prior alone decides
    root = scipy.linalg.solve_triangular(triangle(np.concatenate([rows * spread, prior])), np.eye(len(values)))
    groups = max(len(blocks), 2)
    between = (scores * spread) @ root
    own = prior @ root
    middle = between.T @ between * groups / (groups - 1) + own.T @ own
    sandwich, independent = root @ middle @ root.T, root @ root.T
    ratio = np.diag(sandwich) / np.diag(independent)
    learnt = np.diag(independent) < _LEARNT**2
    effect = float(np.median(ratio[learnt])) if learnt.any() else 1.0
    grown = np.sqrt(np.maximum(1.0, 1 / ratio)) * spread
    return sandwich * np.outer(grown, grown), max(1.0, effect)


def half_widths(covariance: np.ndarray, spread: np.ndarray, blocks: int) -> np.ndarray:
    """Return half the 95 % interval of each of K coefficients; NaN where the data did not decide it.

    `spread`: (K,) the prior's standard deviations; `blocks`: how many the covariance rests on (Student's t).
    """
    deviation = np.sqrt(np.maximum(np.diag(covariance), 0.0))  # a sure sum of unsure terms may round below
    factor = float(scipy.special.stdtrit(max(blocks - 1, 1), (1 + LEVEL) / 2))
    return np.where(deviation < _LEARNT * spread, factor * deviation, np.nan)


def normal_covariance(covariance: np.ndarray, blocks: int) -> np.ndarray:
    """Return the (K, K) covariance grown so that `NORMAL` deviations are half a 95 % interval by Student's t."""
    return np.asarray(covariance * (scipy.special.stdtrit(max(blocks - 1, 1), (1 + LEVEL) / 2) / NORMAL) ** 2)

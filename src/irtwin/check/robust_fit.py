"""Least squares whose uncertainty allows for residuals that stay alike for long."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

BLOCKS = 20  # stretches of time that count as independent


@dataclass(frozen=True)
class RobustFit:
    """Coefficients (K,) and their covariance (K, K), from blocks of time."""

    coefficients: np.ndarray
    covariance: np.ndarray

    def t(self, direction: np.ndarray) -> float:
        """Return a combination (K,) of the coefficients by its standard deviation."""
        deviation = float(np.sqrt(max(direction @ self.covariance @ direction, 0.0)))
        value = float(direction @ self.coefficients)
        return value / deviation if deviation > 0 else 0.0


def fit(columns: np.ndarray, values: np.ndarray) -> RobustFit:
    """Fit values (N,) by columns (N, K), rows in the order of time.

    The covariance is the sandwich estimate over 20 blocks (Liang and Zeger, Biometrika 73, 1986, eq. 2.4).
    """
    norms = np.linalg.norm(columns, axis=0)
    scaled = columns / np.where(norms > 0, norms, 1.0)
    bread = np.linalg.pinv(scaled.T @ scaled, rcond=1e-10, hermitian=True)
    coefficients = bread @ (scaled.T @ values)
    residual = values - scaled @ coefficients
    scores = np.array(
        [scaled[rows].T @ residual[rows] for rows in np.array_split(np.arange(len(values)), BLOCKS) if len(rows)]
    )
    covariance = bread @ (scores.T @ scores) @ bread * (BLOCKS / (BLOCKS - 1))
    scale = np.where(norms > 0, 1 / np.where(norms > 0, norms, 1.0), 0.0)
    return RobustFit(coefficients * scale, covariance * np.outer(scale, scale))

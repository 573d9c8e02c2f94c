"""Normal equations under the prior: products of columns, in units of it, and the identity."""

from __future__ import annotations

import numpy as np
from scipy.linalg import LinAlgError, cho_factor, cho_solve


def factored(products: np.ndarray) -> np.ndarray:
    """Return the Cholesky factor, (k, k) upper triangle, of products of columns and the identity.

    Products are rounded. Where that hides the prior, it is taken to be as firm as the rounding is large.
    """
    prior = np.eye(len(products))
    try:
        return np.asarray(cho_factor(products + prior)[0])
    except LinAlgError:
        rounding = 10 * len(products) * np.finfo(float).eps * float(np.abs(products).max())
        return np.asarray(cho_factor(products + (1 + rounding) * prior)[0])


def solved(factor: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Return the solution of the factored equations, of the shape of the right-hand side (k, ...)."""
    return np.asarray(cho_solve((factor, False), right))

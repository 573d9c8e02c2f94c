"""Normal equations under the prior: products of columns, and those of the prior's rows."""

from __future__ import annotations

import numpy as np
import scipy


def factored(products: np.ndarray, prior: np.ndarray | None = None) -> np.ndarray:
    """Return the Cholesky factor, (k, k) upper triangle, of products of columns and of a prior's rows, (k, k) each.

    `prior` None: the identity, of columns in units of it. Products are rounded. Where that hides the prior, it is
    taken to be as firm as the rounding is large.
    """
    prior = np.eye(len(products)) if prior is None else prior
    try:
        return np.asarray(scipy.linalg.cho_factor(products + prior)[0])
    except scipy.linalg.LinAlgError:
        rounding = 10 * len(products) * np.finfo(float).eps * float(np.abs(products).max())
        return np.asarray(scipy.linalg.cho_factor(products + prior + rounding * np.eye(len(products)))[0])


def solved(factor: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Return the solution of the factored equations, of the shape of the right-hand side (k, ...)."""
    return np.asarray(scipy.linalg.cho_solve((factor, False), right))

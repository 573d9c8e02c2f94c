"""Least squares by normal equations, where coefficients have lowest values that can be true.

Which of them are held there is found by block principal pivoting (Judice and Pires 1994): what falls below is held,
what the data pull up is let go, all at once; if that does not end, one at a time, which does (Murty 1974).
"""

from __future__ import annotations

import numpy as np

from irtwin.gap.regression.cholesky import factored, solved

_AT_ONCE = 5  # rounds in which all that are wrong change sides
_ROUNDED = 1e-9  # of the largest pull: a smaller one is rounding


def bounded(
    products: np.ndarray, prior: np.ndarray, right: np.ndarray, lowest: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return the coefficients (k,), none below `lowest` (k,), and which are held there, (k,).

    products, prior (k, k): of columns and of the prior's rows; right (k,): of columns with the measurement.
    """
    values, held = solved(factored(products, prior), right), np.zeros(len(right), dtype=bool)
    if np.all(values >= lowest):
        return values, held
    normal = products + prior
    for nth in range(_AT_ONCE + 3 * len(right)):
        wrong = _wrong(values, normal @ values - right, held, lowest, right)
        if not wrong.any():
            break
        held ^= _changing(wrong, nth)
        free, at = np.flatnonzero(~held), np.flatnonzero(held)
        values = np.where(held, lowest, 0.0)
        inside = np.ix_(free, free)
        values[free] = solved(
            factored(products[inside], prior[inside]), right[free] - normal[np.ix_(free, at)] @ lowest[at]
        )
    return values, held


def bounded_small(normal: np.ndarray, right: np.ndarray, lowest: np.ndarray) -> np.ndarray:
    """Return the coefficients (V, k) of V small systems, none below `lowest` (V, k).

    normal (V, k, k): products of columns and the prior's; right (V, k).
    """
    values = np.linalg.solve(normal, right[..., None])[..., 0]
    some = np.flatnonzero((values < lowest).any(axis=1))
    if not len(some):
        return np.asarray(values)
    normal, right, lowest = normal[some], right[some], lowest[some]
    held, diagonal = np.zeros(right.shape, dtype=bool), range(right.shape[1])
    for nth in range(_AT_ONCE + 3 * right.shape[1]):
        pull = np.einsum("vij,vj->vi", normal, values[some]) - right
        wrong = _wrong(values[some], pull, held, lowest, right)
        if not wrong.any():
            break
        held ^= _changing(wrong, nth)
        at = np.where(held, lowest, 0.0)
        among = normal * (~held[:, :, None] & ~held[:, None, :])
        among[:, diagonal, diagonal] += held
        target = np.where(held, at, right - np.einsum("vij,vj->vi", normal, at))
        values[some] = np.linalg.solve(among, target[..., None])[..., 0]
    return np.asarray(values)


def _wrong(values: np.ndarray, pull: np.ndarray, held: np.ndarray, lowest: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Return which are below their lowest value, or held there while the data `pull` them up (a negative slope)."""
    rounded = _ROUNDED * np.abs(right).max(axis=-1, keepdims=True)
    return np.asarray(np.where(held, pull < -rounded, values < lowest))


def _changing(wrong: np.ndarray, nth: int) -> np.ndarray:
    """Return which of the wrong ones change sides in the nth round: all, later the last of each system."""
    if nth < _AT_ONCE:
        return wrong
    later = np.cumsum(wrong[..., ::-1], axis=-1)[..., ::-1]
    return np.asarray(wrong & (later == 1))

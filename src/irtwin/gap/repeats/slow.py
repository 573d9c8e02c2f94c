"""What is slow: an offset between two runs of one motion, or a drift of one against the other."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.stats import t as student_t

from irtwin.gap.regression.correlation import correlation_samples
from irtwin.gap.repeats.series import Series

_SLOW = 2  # columns of a series: a constant, and how it drifts, stand first beside it


def slow(series: Series) -> np.ndarray:
    """Return of the offset of a difference, and of its drift a second: value, deviation, p, mean square in one run.

    (2, 4); what is left remembers, so its samples count for fewer.
    """
    beside = series.beside
    scale = np.maximum(np.linalg.norm(beside, axis=0), 1e-300)
    inverse = np.linalg.pinv(beside / scale, rcond=1e-8)
    values = inverse @ series.values / scale
    left = series.values - beside @ values
    memory = correlation_samples(left)
    free = max(len(left) / memory - beside.shape[1], 1.0)
    variance = float(left @ left) / len(left) * memory * (1 + beside.shape[1] / free)
    deviations = np.sqrt(np.sum(inverse[:_SLOW] ** 2, axis=1) * variance) / scale[:_SLOW]
    values = values[:_SLOW]
    p = 2 * student_t.sf(np.abs(values) / np.maximum(deviations, 1e-300), free)
    return np.column_stack([values, deviations, p, values**2 / 2 * [1.0, np.var(beside[:, 1])]])


def from_start(series: Series) -> Series:
    """Return a series whose offset is that where it begins, before anything has drifted."""
    beside = series.beside.copy()
    beside[:, 1] -= beside[0, 1]
    return replace(series, beside=beside)

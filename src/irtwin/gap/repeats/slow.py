"""What is slow: an offset between two runs of one motion, or a drift of one against the other."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import scipy

from irtwin.gap.repeats.series import EvenSeries, correlation_samples

_SLOW = 2  # columns of a series: a constant, and how it drifts, stand first beside it
_CONSTANTS = (0.1, 0.25, 0.6)  # times the run's length: a longer one is a ramp
_DRIFT = 1  # the column of the drift: a constant stands before it


def slow(series: EvenSeries) -> np.ndarray:
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
    p = 2 * scipy.special.stdtr(free, -np.abs(values) / np.maximum(deviations, 1e-300))
    return np.column_stack([values, deviations, p, values**2 / 2 * [1.0, np.var(beside[:, 1])]])


def from_start(series: EvenSeries) -> EvenSeries:
    """Return a series whose offset is that where it begins, before anything has drifted."""
    beside = series.beside.copy()
    beside[:, 1] -= beside[0, 1]
    return replace(series, beside=beside)


def creep(series: EvenSeries, squares: np.ndarray | None) -> EvenSeries:
    """Return a difference with its likeliest drift beside it, by the least description.

    The drift's column rises by 1 a second, in the mean: its coefficient is the slope of the nearest straight line.
    Each joint's winding warms by itself. `squares` (N, n): of each joint's torque; None: unknown.
    """
    time = series.time - series.time[0]
    basis = replace(series, beside=np.delete(series.beside, _DRIFT, axis=1)).basis()
    left = series.values - basis @ (basis.T @ series.values)
    count = len(time) / correlation_samples(series.left())
    shortest, drift = np.inf, series.beside[:, _DRIFT]
    for constant in (None, *_CONSTANTS):
        course = time if constant is None else -np.expm1(-time / (constant * time[-1]))
        for loads in _loads(squares, len(time)):
            courses = loads * course[:, None]
            free = courses - basis @ (basis.T @ courses)
            taken = np.linalg.lstsq(free, left, rcond=1e-8)[0]
            numbers = loads.shape[1] + (constant is not None)
            length = count * np.log(max(np.sum((left - free @ taken) ** 2), 1e-300)) + numbers * np.log(count)
            if length < shortest:
                shortest, drift = length, courses @ taken
    beside = series.beside.copy()
    beside[:, _DRIFT] = _a_second(drift, time)
    return replace(series, beside=beside)


def _loads(squares: np.ndarray | None, count: int) -> list[np.ndarray]:
    """Return what may warm: nothing of the motion, or any joint's winding as well, (N, 1 + n) columns."""
    own = np.ones((count, 1))
    heated = [] if squares is None else [np.column_stack([own, squares / np.maximum(squares.mean(axis=0), 1e-300)])]
    return [own, *heated]


def _a_second(drift: np.ndarray, time: np.ndarray) -> np.ndarray:
    """Return a drift (N,) scaled to rise by 1 a second, about its mean."""
    centred, since = drift - drift.mean(), time - time.mean()
    slope = float(centred @ since) / float(since @ since)
    return np.asarray(centred / slope if slope else centred)

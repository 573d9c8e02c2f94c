"""Samples for the eye: fewer of them, the extremes kept."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

Samples = npt.NDArray[np.float64]


def extremes(signals: Sequence[Samples], points: int) -> npt.NDArray[np.intp]:
    """Return at most `points` rising indices that keep each signal's minimum and maximum in every stretch.

    signals: each (N,), of one time base; NaN samples are passed over. With `points` >= N all indices are kept.
    """
    count = len(signals[0])
    if count <= points:
        return np.arange(count)
    stretches = max(1, (points - 2) // (2 * len(signals)))
    width = -(-count // stretches)
    picked = [np.array([0, count - 1])]
    for signal in signals:
        padded = np.pad(signal, (0, width * stretches - count), constant_values=np.nan).reshape(stretches, width)
        starts = np.arange(stretches) * width
        picked.append(starts + np.argmin(np.where(np.isnan(padded), np.inf, padded), axis=1))
        picked.append(starts + np.argmax(np.where(np.isnan(padded), -np.inf, padded), axis=1))
    indices = np.unique(np.concatenate(picked))
    return indices[indices < count]

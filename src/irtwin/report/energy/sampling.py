"""Samples for the eye: fewer of them, the extremes kept, packed small."""

from __future__ import annotations

import base64
from collections.abc import Sequence
from typing import TypedDict

import numpy as np
import numpy.typing as npt

Samples = npt.NDArray[np.float64]

_LEVELS = 65_534  # of a 16-bit integer, symmetric about zero
_MISSING = -32_768  # stands for NaN


class Packed(TypedDict):
    """16-bit integers, little-endian, in base64: value = offset + scale * integer."""

    scale: float
    offset: float
    data: str


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


def pack(values: Samples) -> Packed:
    """Quantise values to 1/65534 of their range, an eighth of a pixel's hair on any screen."""
    finite = values[np.isfinite(values)]
    low, high = (float(finite.min()), float(finite.max())) if finite.size else (0.0, 0.0)
    offset, scale = (low + high) / 2, (high - low) / _LEVELS or 1.0
    steps = np.where(np.isfinite(values), np.round((values - offset) / scale), _MISSING)
    data = base64.b64encode(steps.astype("<i2").tobytes()).decode("ascii")
    return Packed(scale=scale, offset=offset, data=data)

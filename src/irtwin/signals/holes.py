"""Holes in time: where a signal was not sampled for so long that nobody knows its value."""

from __future__ import annotations

import numpy as np

HOLE = 25.0  # intervals without a sample: nobody knows what the robot did meanwhile


def known_at(wanted: np.ndarray, times: np.ndarray) -> np.ndarray:
    """Return (N,) whether a value logged at rising `times` (M,) is known at `wanted` (N,) ones, of one unit.

    It is not before the first, after the last, and within a hole between two of them.
    """
    known: np.ndarray = (wanted >= times[0]) & (wanted <= times[-1])
    gaps = np.diff(times)
    if len(gaps):
        before = np.clip(np.searchsorted(times, wanted, side="right") - 1, 0, len(gaps) - 1)
        inside = (wanted > times[before]) & (wanted < times[before + 1])
        known &= ~(inside & (gaps[before] > HOLE * np.median(gaps)))
    return known

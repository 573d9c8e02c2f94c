"""A telegraph signal in power: what the motion takes told from how power changes, and on and off from what is left.

A load that goes on or off shows in few of the changes over a tenth of a second, so that a robust fit to these passes
it by. All of the power says little of the motion beside a load, and holds what hardly changes.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from scipy.ndimage import uniform_filter1d

from irtwin.gap.repeats.series import SPREAD, Series

_MOMENT = 0.1  # s, over which power is averaged, and changes
_ROUNDS = 7  # of weights by absolute deviations; as many of weights that leave out what is far
_NEAR = 0.5  # spreads: nearer changes count alike
_FAR = 4.0  # spreads: what lies beyond is a step (Tukey's biweight)


def two_levels(runs: Mapping[str, Series], trust: float) -> dict[str, np.ndarray]:
    """Return where each run's power is on the upper of two levels, beside what the motion takes, (N,) of 0 and 1.

    `trust`: how much all of the power counts beside its changes.
    """
    even = {name: _smooth(np.column_stack([one.beside, one.values]), one) for name, one in runs.items()}
    changes = [
        each[_samples(one) :] - each[: -_samples(one)] for one, each in zip(runs.values(), even.values(), strict=True)
    ]
    taken = _of_motion(np.vstack(list(even.values())), np.vstack(changes), trust)
    left = {name: each @ np.append(-taken, 1.0) for name, each in even.items()}
    middle = _middle(np.concatenate(list(left.values())))
    return {name: (values > middle).astype(float) for name, values in left.items()}


def _smooth(columns: np.ndarray, one: Series) -> np.ndarray:
    """Return the moving means of columns (N, m) over a moment."""
    return np.asarray(uniform_filter1d(columns, _samples(one), axis=0, mode="nearest"))


def _samples(one: Series) -> int:
    return min(max(1, round(_MOMENT * one.rate)), len(one.time) // 3)


def _of_motion(whole: np.ndarray, change: np.ndarray, trust: float) -> np.ndarray:
    """Return the coefficients (m,) of columns, power the last, (M, m + 1): by a robust fit to changes, held by all."""
    scale = np.maximum(np.linalg.norm(whole[:, :-1], axis=0), 1e-300)
    whole, values = whole[:, :-1] / scale, whole[:, -1]
    change, changes = change[:, :-1] / scale, change[:, -1]
    square, right = whole.T @ whole, whole.T @ values
    found = np.linalg.lstsq(square, right, rcond=1e-12)[0]
    rough = float(np.mean((values - whole @ found) ** 2))
    for turn in range(2 * _ROUNDS):
        off = np.abs(changes - change @ found)
        spread = max(SPREAD * float(np.median(off)), 1e-12)
        weights = _weights(off / spread, last=turn >= _ROUNDS)
        held = trust**2 * spread**2 / max(rough, 1e-300)
        weighted = change * weights[:, None]
        both = change.T @ weighted + held * square, weighted.T @ changes + held * right
        found = np.linalg.lstsq(*both, rcond=1e-12)[0]
    return np.asarray(found / scale)


def _weights(off: np.ndarray, *, last: bool) -> np.ndarray:
    """Return the weights (N,) of deviations in spreads: of the least absolute ones first, then of Tukey's biweight."""
    return np.clip(1 - (off / _FAR) ** 2, 0.0, None) ** 2 if last else 1 / np.maximum(off, _NEAR)


def _middle(values: np.ndarray) -> float:
    """Return what lies between the two levels that leave the least squares (two means, exactly)."""
    ordered = np.sort(values)
    below, sums = np.arange(1, len(ordered)), np.cumsum(ordered)
    lower, upper = sums[:-1] / below, (sums[-1] - sums[:-1]) / (len(ordered) - below)
    best = int(np.argmax(lower**2 * below + upper**2 * (len(ordered) - below)))
    return float(lower[best] + upper[best]) / 2

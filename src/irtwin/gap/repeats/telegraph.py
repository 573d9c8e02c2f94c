"""A telegraph signal in power: what the motion takes told from how power changes, and on and off from what is left.

A load that goes on or off shows in few of the changes over a tenth of a second, so that a robust fit to these passes
it by. All of the power says little of the motion beside a load, and holds what hardly changes.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from irtwin.gap.repeats.series import SPREAD, Series

_MOMENT = 0.1  # s, over which power is averaged, and changes
_ROUNDS = 7  # of weights by absolute deviations; as many of weights that leave out what is far
_NEAR = 0.5  # spreads: nearer changes count alike
_FAR = 4.0  # spreads: what lies beyond is a step (Tukey's biweight)


def two_levels(runs: Mapping[str, Series], trust: float) -> dict[str, np.ndarray]:
    """Return where each run's power is on the upper of two levels, beside what the motion takes, (N,) of 0 and 1.

    `trust`: how much all of the power counts beside its changes.
    """
    taken = _of_motion([_even(one) for one in runs.values()], trust)
    left = {name: _smooth((one.values - one.beside @ taken)[:, None], one)[:, 0] for name, one in runs.items()}
    middle = _middle(np.concatenate(list(left.values())))
    return {name: (_padded(values, len(runs[name].time)) > middle).astype(float) for name, values in left.items()}


def _smooth(columns: np.ndarray, one: Series) -> np.ndarray:
    """Return the moving means of columns (N, m) over a moment, (N - M + 1, m)."""
    size = _samples(one)
    sums = np.concatenate([np.zeros((1, columns.shape[1])), np.cumsum(columns, axis=0)])
    return np.asarray((sums[size:] - sums[:-size]) / size)


def _samples(one: Series) -> int:
    return min(max(1, round(_MOMENT * one.rate)), len(one.time) // 3)


def _padded(values: np.ndarray, count: int) -> np.ndarray:
    before = (count - len(values)) // 2
    return np.pad(values, (before, count - len(values) - before), mode="edge")


def _even(one: Series) -> tuple[np.ndarray, np.ndarray]:
    """Return columns and power as the last, (M, m + 1), averaged over a moment, and how these change in one."""
    size = _samples(one)
    means = _smooth(np.column_stack([one.beside, one.values]), one)
    return means, means[size:] - means[:-size]


def _of_motion(runs: list[tuple[np.ndarray, np.ndarray]], trust: float) -> np.ndarray:
    """Return the coefficients (m,) of the columns: those of a robust fit to changes, held by all of the power."""
    whole, change = (np.vstack(parts) for parts in zip(*runs, strict=True))
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

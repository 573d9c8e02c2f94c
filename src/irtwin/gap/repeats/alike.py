"""A drift that repeats share: no difference shows it, but what the twin's effects leave of each run does.

A run of another motion lends what it says of the twin's coefficients. An offset that all runs share is none: it is
the twin's own offset of torque.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import t as student_t

from irtwin.effects.stack import Stack
from irtwin.gap.regression.correlation import correlation_samples
from irtwin.gap.regression.residuals import as_filtered, without_ends
from irtwin.gap.repeats.series import Series, waves
from irtwin.signals.motion import Motion

_UNDECIDED = 0.1  # of the filter's kernel: where more of it is undecided, so is what it gives
_MOST = 20_000  # samples of all runs: in longer ones differences tell enough


@dataclass(frozen=True)
class OwnDrift:
    """The `drift` of one run a second, its `deviation` and p; `size`: its mean square; `rest`: of what is left."""

    drift: float
    deviation: float
    p: float
    size: float
    rest: float


@dataclass(frozen=True)
class Alike:
    """What each run says by itself: the `motions` of all, the twin's `columns` and `values` in them; the `judged`."""

    motions: Sequence[Motion]
    columns: Sequence[np.ndarray]
    values: Sequence[np.ndarray]
    judged: Sequence[str]

    @classmethod
    def of(cls, stack: Stack, motions: Sequence[Motion], judged: Sequence[str]) -> Alike | None:
        """Return it of the runs that are `judged`, beside the twin; None in long runs."""
        if sum(len(motion.time) for motion in motions) > _MOST:
            return None
        columns = [as_filtered(motion, stack.torque_columns(motion)) for motion in motions]
        values = [_known(stack, motion, own) for motion, own in zip(motions, columns, strict=True)]
        return cls(motions, columns, values, judged)

    def drifts(self, joint: int, frequencies: Sequence[float] = ()) -> list[OwnDrift]:
        """Return the drifts of the judged runs in a joint, beside lines of some `frequencies`, Hz."""
        return _of_joint(self.motions, self.columns, self.values, joint, self.judged, frequencies)


def _known(stack: Stack, motion: Motion, columns: np.ndarray) -> np.ndarray:
    """Return measured torque (N, n) less what is known of it, NaN where friction is undecided."""
    assert motion.torque is not None
    left = motion.torque - columns @ stack.shift(motion)
    undecided = as_filtered(motion, stack.undecided(motion).astype(float)) > _UNDECIDED
    return without_ends(motion, np.where(undecided, np.nan, left))


def _of_joint(
    motions: Sequence[Motion],
    columns: Sequence[np.ndarray],
    values: Sequence[np.ndarray],
    joint: int,
    judged: Sequence[str],
    frequencies: Sequence[float],
) -> list[OwnDrift]:
    """Return the drifts of the judged runs in one joint."""
    known = [np.isfinite(each[:, joint]) for each in values]
    parts = [motion.time[kept] for motion, kept in zip(motions, known, strict=True)]
    time, run = np.concatenate(parts), np.repeat(np.arange(len(motions)), [len(each) for each in parts])
    if not len(time):
        return []
    ones = (run[:, None] == np.arange(len(motions))).astype(float)
    began = np.array([each.mean() if len(each) else 0.0 for each in parts])
    beside = np.concatenate([own[kept, joint] for own, kept in zip(columns, known, strict=True)])
    measured = np.concatenate([each[kept, joint] for each, kept in zip(values, known, strict=True)])
    swings = [wave[:, None] * ones for one in frequencies for wave in waves(time, one)]
    basis = Series(time, measured, np.column_stack([beside, ones, *swings])).basis()
    drifts = ones * (time - began[run])[:, None]
    free = drifts - basis @ (basis.T @ drifts)
    weights = np.linalg.pinv(free, rcond=1e-3)
    slopes = weights @ measured
    left = measured - basis @ (basis.T @ measured) - free @ slopes
    memory = np.array([correlation_samples(left[run == k]) for k in range(len(motions))])
    variance = np.array([np.mean(left[run == k] ** 2) if len(each) else 0.0 for k, each in enumerate(parts)])
    deviations = np.sqrt((weights**2) @ (variance * memory)[run])
    freedom = max(float(np.sum([len(e) for e in parts] / memory)) - basis.shape[1] - len(motions), 1.0)
    p = 2 * student_t.sf(np.abs(slopes) / np.maximum(deviations, 1e-300), freedom)
    return [
        OwnDrift(
            float(slopes[k]),
            float(deviations[k]),
            float(p[k]),
            float(slopes[k] ** 2 * np.var(parts[k])),
            float(np.mean(left**2)),
        )
        for k, motion in enumerate(motions)
        if motion.run in judged and len(parts[k])
    ]

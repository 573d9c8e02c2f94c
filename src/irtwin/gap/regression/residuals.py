"""Residuals of whole runs, sample by sample: what the twin leaves of what was measured."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from irtwin.effects.stack import Stack
from irtwin.gap.regression.channel_equations import Torque
from irtwin.signals.filter import kernel, low_pass
from irtwin.signals.motion import Motion

_PIECE = 8192  # samples whose regressor is held at once
_UNDECIDED = 0.1  # of the filter's kernel: where more of it is undecided, so is what it gives

Values = Callable[[str], np.ndarray]
"""The coefficients of the twin's terms for a run, by its name."""


@dataclass(frozen=True)
class Trace:
    """One run's residual (N, g), N m or W, NaN where undecided, and the joint torque predicted, (N, n) N m."""

    motion: Motion
    residual: np.ndarray
    torque: np.ndarray


def torque_traces(stack: Stack, motions: Sequence[Motion], values: Values, predicted: Torque) -> list[Trace]:
    """Return what the twin leaves of the measured torque of each motion, g = n."""
    return [Trace(m, torque_residual(stack, m, values(m.run)), predicted(m)) for m in motions if m.torque is not None]


def power_traces(stack: Stack, motions: Sequence[Motion], values: Values, torque: Torque) -> list[Trace]:
    """Return what the twin leaves of the measured power of each motion, g = 1, given the joint torque."""
    fixed = np.array([term.expected for _, term in stack.power_terms])
    traces = []
    for motion in motions:
        if motion.power is None:
            continue
        taken = torque(motion)
        full = fixed.copy()
        full[~stack.fixed] = values(motion.run)
        parts = [
            stack.power_columns(piece, taken[piece.start : piece.start + len(piece.time)]) @ full
            for piece in motion.pieces(_PIECE)
        ]
        left = motion.power - as_filtered(motion, np.concatenate(parts))
        traces.append(Trace(motion, without_ends(motion, left)[:, None], taken))
    return traces


def torque_residual(stack: Stack, motion: Motion, values: np.ndarray) -> np.ndarray:
    """Return measured torque less the twin's with these coefficients (K,): (N, n) N m, NaN where undecided."""
    assert motion.torque is not None
    parts = [stack.shown_torque(piece, values) for piece in motion.pieces(_PIECE)]
    left = motion.torque - as_filtered(motion, np.concatenate(parts))
    undecided = as_filtered(motion, stack.undecided(motion).astype(float)) > _UNDECIDED
    return without_ends(motion, np.where(undecided, np.nan, left))


def as_filtered(motion: Motion, signal: np.ndarray) -> np.ndarray:
    """Return a computed signal, (N, ...), as it would look if it had been measured with the motion."""
    return low_pass(signal, motion.rate, motion.cutoff) if motion.cutoff else signal


def without_ends(motion: Motion, residual: np.ndarray) -> np.ndarray:
    """Return a residual (N, ...) with NaN at either end of the run, where a filter knows only one side."""
    half = len(kernel(motion.rate, motion.cutoff)) // 2 if motion.cutoff else 0
    inside = residual.copy()
    inside[:half] = np.nan
    inside[len(inside) - half :] = np.nan
    return inside

"""How far the gap shrinks, judged on groups of runs that took no part in the fit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from irtwin.gap.regression.moments import Summed
from irtwin.gap.regression.normal_equations import System
from irtwin.identification.progress import track


@dataclass(frozen=True)
class HeldOut:
    """Squared residuals of each group and equation (G, g) when the group was left out of the fit; rows likewise."""

    before: np.ndarray
    after: np.ndarray
    rows: np.ndarray

    def rmse(self, squares: np.ndarray) -> np.ndarray:
        """Return each equation's RMSE (g,) over the groups."""
        return np.asarray(np.sqrt(squares.sum(axis=0) / np.maximum(self.rows.sum(axis=0), 1)))


def held_out(
    system: System, noise: np.ndarray, noise_after: np.ndarray, chosen: Sequence[int], plain: System | None = None
) -> HeldOut:
    """Refit everything without each observed group in turn, with the chosen columns and without them.

    Equations are weighted by what each model leaves, `noise` and `noise_after` (g,). `plain`: those of the same groups
    before anything was added, if others.
    """
    judged = np.flatnonzero(system.group_observed)
    before = left_out(plain or system, noise, (), judged)
    anything = len(chosen) > 0 or plain is not None
    after = left_out(system, noise_after, chosen, judged) if anything else before
    return HeldOut(before, after, system.rows[judged])


def left_out(system: System, noise: np.ndarray, chosen: Sequence[int], judged: np.ndarray) -> np.ndarray:
    """Return the squares that a fit with the chosen columns, weighted by `noise`, leaves of each group without it."""
    moments = system.group_moments(noise)
    total, every = Summed(moments), track(judged, "how far the gap closes without a group")
    return np.array([system.squares_without(chosen, total, moments[group], int(group)) for group in every])

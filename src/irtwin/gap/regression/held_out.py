"""How far the gap shrinks, judged on groups of runs that took no part in the fit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy

from irtwin.gap.regression.moments import Summed
from irtwin.gap.regression.normal_equations import System
from irtwin.identification.progress import track

_RESAMPLED = 1000


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


def closed_fraction(parts: Sequence[tuple[HeldOut, np.ndarray]], seed: int) -> tuple[float, list[float]] | None:
    """Return the fraction of the gap above the floor that is closed, with its 95 % interval over groups.

    parts: each channel's groups and noise floor (g,). Equations count by their mean square over the floor's, those that
    have a gap. The interval is Student's, of the deviation under resampling, as groups are few. None without a gap.
    """
    gaps = [(part, floor, part.rmse(part.before) > floor) for part, floor in parts]

    def fractions(picks: Sequence[np.ndarray]) -> np.ndarray:
        """Return the fraction (R,) of each of R choices of groups, (R, G) of each part; NaN without a gap."""
        above, below = np.zeros((2, len(picks[0])))
        for (part, floor, gap), pick in zip(gaps, picks, strict=True):
            rows = np.maximum(part.rows[pick].sum(axis=1), 1)
            above += (part.before[pick].sum(axis=1) / rows / floor**2 - 1)[:, gap].sum(axis=1)
            below += (part.after[pick].sum(axis=1) / rows / floor**2 - 1)[:, gap].sum(axis=1)
        some = above > 0
        return np.where(some, np.minimum(1 - below / np.where(some, above, 1.0), 1.0), np.nan)

    counts = [len(part.rows) for part, _ in parts]
    value, groups = float(fractions([np.arange(count)[None] for count in counts])[0]), counts[0]
    if not np.isfinite(value):
        return None
    if groups < 2:
        return value, [value, value]
    generator = np.random.default_rng(seed)
    picks = [[generator.integers(count, size=count) for count in counts] for _ in range(_RESAMPLED)]
    drawn = fractions([np.array(own) for own in zip(*picks, strict=True)])
    deviation = drawn[np.isfinite(drawn)].std(ddof=1) * np.sqrt(groups / (groups - 1))
    half = float(scipy.special.stdtrit(groups - 1, 0.975) * deviation)
    return value, [value - half, min(value + half, 1.0)]


def pooled_interval(squares: np.ndarray, rows: np.ndarray, seed: int) -> list[float]:
    """Return the 95 % interval over groups of the RMSE pooled over equations."""
    pick = np.random.default_rng(seed).integers(len(rows), size=(_RESAMPLED, len(rows)))
    drawn = np.sqrt(squares[pick].sum(axis=(1, 2)) / np.maximum(rows[pick].sum(axis=(1, 2)), 1))
    return list(np.quantile(drawn, [0.025, 0.975]).tolist())


def left_out(system: System, noise: np.ndarray, chosen: Sequence[int], judged: np.ndarray) -> np.ndarray:
    """Return the squares that a fit with the chosen columns, weighted by `noise`, leaves of each group without it."""
    moments = system.group_moments(noise)
    total, every = Summed(moments), track(judged, "how far the gap closes without a group")
    return np.array([system.squares_without(chosen, total, moments[group], int(group)) for group in every])

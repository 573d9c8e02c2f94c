"""How much of a channel's gap is closed, by all causes or by some: in shares of the gap, and in floors."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.stats import t as student_t

from irtwin.gap.regression.held_out import HeldOut
from irtwin.gap.thresholds import Matters

_RESAMPLED = 1000


@dataclass(frozen=True)
class Closing:
    """What is closed on groups of runs left out.

    share: of the channel's gap above the floor, or of its mean square where no floor is known; below 0 where the fit is
    spoilt. interval: of the share, 95 %, over groups. floors: RMS that is closed in runs where the causes act, at the
    joint that gains most, in floors; None where none is known. size: mean squares closed, summed over joints, in
    floors squared, or in what the causes leave where no floor is known: by it all channels' are put in order.
    """

    share: float
    interval: tuple[float, float]
    floors: float | None
    size: float

    def matters(self, limits: Matters) -> bool:
        """Return whether a person would miss it: enough of the gap, more than noise, and for sure more than nothing."""
        more_than_noise = self.floors is None or self.floors >= limits.least_floors
        return self.share >= limits.least_share and more_than_noise and self.interval[0] > 0


def closing(
    closed: np.ndarray,
    acting: np.ndarray,
    held_out: HeldOut,
    floor: np.ndarray | None,
    noise: np.ndarray,
    seed: int,
) -> Closing:
    """Return what squares `closed` (G, g) on groups left out are worth; floor, and noise that is left: (g,) RMS.

    acting: (G,) whether the causes act in a group at all.

    Equations count by their mean square over the floor's, those that have a gap. The interval is Student's, of the
    deviation under resampling, as groups are few.
    """
    before, rows = held_out.before, held_out.rows
    mean = before.sum(axis=0) / np.maximum(rows.sum(axis=0), 1)
    level = np.maximum(mean if floor is None else floor**2, np.finfo(float).tiny)
    least = np.zeros_like(mean) if floor is None else floor**2
    gap = mean > least
    above = ((before - least * rows) / level)[:, gap]
    won = (closed / level)[:, gap]
    weights = rows[:, gap]

    def share(count: np.ndarray) -> np.ndarray:
        """Return the share of (R, G) draws, in which each group stands so often."""
        total = np.maximum(count @ weights, 1)
        whole = (count @ above / total).sum(axis=1)
        part = (count @ won / total).sum(axis=1)
        return np.asarray(np.divide(part, whole, out=np.zeros(len(count)), where=whole > 0))

    groups = len(before)
    value = min(float(share(np.ones((1, groups)))[0]), 1.0)
    half = 0.0
    if groups > 1:
        drawn = share(np.random.default_rng(seed).multinomial(groups, np.full(groups, 1 / groups), _RESAMPLED))
        deviation = float(drawn.std(ddof=1) * np.sqrt(groups / (groups - 1)))
        half = float(student_t.ppf(0.975, groups - 1)) * deviation
    squares = closed.sum(axis=0) / np.maximum(rows.sum(axis=0), 1)
    where = closed[acting].sum(axis=0) / np.maximum(rows[acting].sum(axis=0), 1)
    floors = None if floor is None else float(np.sqrt(np.max(np.maximum(where, 0.0) / floor**2)))
    size = float((squares / (noise if floor is None else floor) ** 2).sum())
    return Closing(value, (value - half, min(value + half, 1.0)), floors, size)

"""How much of a channel's gap is closed, by all causes or by some: in shares of the gap, and in floors."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy

from irtwin.gap.regression.held_out import HeldOut
from irtwin.gap.thresholds import Matters


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

    @property
    def share_of(self) -> str:
        """What the share is of, in words."""
        return "the mean square, as no floor is known" if self.floors is None else "the gap above the floor"

    def matters(self, limits: Matters, *, likely: bool = False) -> bool:
        """Return whether a person would miss it: enough of the gap, more than noise, and for sure more than nothing.

        `likely`: the cause is there, more likely than not; then how much it closes need not be sure.
        """
        more_than_noise = self.floors is None or self.floors >= limits.floors
        return self.share >= limits.share and more_than_noise and (likely or self.interval[0] > 0)


def closing(
    closed: np.ndarray, acting: np.ndarray, held_out: HeldOut, floor: np.ndarray | None, noise: np.ndarray
) -> Closing:
    """Return what squares `closed` (G, g) on groups left out are worth; floor, and noise that is left: (g,) RMS.

    acting: (G,) whether the causes act in a group at all. Equations count by their mean square over the floor's, those
    that have a gap.
    """
    before, rows = held_out.before, np.maximum(held_out.rows.sum(axis=0), 1)
    mean = before.sum(axis=0) / rows
    level = np.maximum(mean if floor is None else floor**2, np.finfo(float).tiny)
    least = np.zeros_like(mean) if floor is None else floor**2
    gap = mean > least
    above = ((before - least * held_out.rows) / level / rows)[:, gap].sum(axis=1)
    won = (closed / level / rows)[:, gap].sum(axis=1)
    value, interval = share(won, above)
    squares = closed.sum(axis=0) / rows
    where = closed[acting].sum(axis=0) / np.maximum(held_out.rows[acting].sum(axis=0), 1)
    floors = None if floor is None else float(np.sqrt(np.max(np.maximum(where, 0.0) / floor**2)))
    size = float((squares / (noise if floor is None else floor) ** 2).sum())
    return Closing(value, interval, floors, size)


def share(part: np.ndarray, whole: np.ndarray) -> tuple[float, tuple[float, float]]:
    """Return which share of the whole a part is, each a sum over groups (G,), at most 1, with its 95 % interval.

    The interval is Student's, of a ratio of sums (linearised): groups are few, and of groups drawn anew some sets have
    no whole. It has no width where there is one group, or no whole.
    """
    total, groups = float(whole.sum()), len(whole)
    if total <= 0:
        return 0.0, (0.0, 0.0)
    value, half = min(float(part.sum()) / total, 1.0), 0.0
    if groups > 1:
        error = float(np.sqrt(np.sum((part - value * whole) ** 2) * groups / (groups - 1))) / total
        half = float(scipy.special.stdtrit(groups - 1, 0.975)) * error
    return value, (value - half, min(value + half, 1.0))

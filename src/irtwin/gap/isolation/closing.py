"""How much of a channel's gap is closed, by all causes or by some: in shares of the gap, and in floors."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy

from irtwin.gap.regression.held_out import HeldOut
from irtwin.gap.thresholds import Matters

_MOST = 0.5  # of the whole: a group that has more says by itself what the ratio is


@dataclass(frozen=True)
class Closing:
    """What is closed on groups of runs left out.

    share: of the channel's gap above the floor, or of its mean square where no floor is known; below 0 where the fit is
    spoilt. interval: of the share, 95 %, over groups. floors: RMS that is closed in runs where the causes act, at the
    joint that gains most, in floors; None where none is known. size: mean squares closed, summed over joints, in
    floors squared, or in what the causes leave where no floor is known: by it all channels' are put in order. both: of
    torque and power together.
    """

    share: float
    interval: tuple[float, float]
    floors: float | None
    size: float
    both: bool = False

    @property
    def share_of(self) -> str:
        """What the share is of, in words."""
        of = " of torque and power" if self.both else ""
        return f"the mean square{of}, as no floor is known" if self.floors is None else f"the gap{of} above the floor"

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
    value, interval = share(*_above_floor(closed, held_out, floor))
    squares = closed.sum(axis=0) / np.maximum(held_out.rows.sum(axis=0), 1)
    where = closed[acting].sum(axis=0) / np.maximum(held_out.rows[acting].sum(axis=0), 1)
    floors = None if floor is None else float(np.sqrt(np.max(np.maximum(where, 0.0) / floor**2)))
    size = float((squares / (noise if floor is None else floor) ** 2).sum())
    return Closing(value, interval, floors, size)


def share_above(closed: np.ndarray, held_out: HeldOut, floor: np.ndarray) -> tuple[float, tuple[float, float]] | None:
    """Return which share squares `closed` (G, g) are of the gap above a floor (g,), RMS, with its 95 % interval.

    None without a gap.
    """
    closed_of_groups, above = _above_floor(closed, held_out, floor)
    return _ratio(closed_of_groups, above, np.ones(len(above)))


def closed_fraction(parts: Sequence[tuple[HeldOut, np.ndarray]]) -> tuple[float, tuple[float, float]] | None:
    """Return the fraction of the gap above the floor that is closed, with its 95 % interval over groups.

    parts: each channel's groups and noise floor (g,). None without a gap.
    """
    by_channel = [_above_floor(groups.before - groups.after, groups, floor) for groups, floor in parts]
    closed, above = (np.concatenate(own) for own in zip(*by_channel, strict=True))
    return _ratio(closed, above, above)


def _above_floor(closed: np.ndarray, held_out: HeldOut, floor: np.ndarray | None) -> tuple[np.ndarray, np.ndarray]:
    """Return what is closed and what lies above the floor in each group, (G,): a sum over equations that have a gap."""
    before, rows = held_out.before, np.maximum(held_out.rows.sum(axis=0), 1)
    mean = before.sum(axis=0) / rows
    level = np.maximum(mean if floor is None else floor**2, np.finfo(float).tiny)
    least = np.zeros_like(mean) if floor is None else floor**2
    gap = mean > least
    above = (before - least * held_out.rows) / level / rows
    return (closed / level / rows)[:, gap].sum(axis=1), above[:, gap].sum(axis=1)


def share(part: np.ndarray, whole: np.ndarray) -> tuple[float, tuple[float, float]]:
    """Return which share of the whole a part is, each a sum over groups (G,), at most 1, with its 95 % interval.

    For it groups are alike: one that is most of the whole, as of a contact in one run, does not unsay what it shows.
    """
    return _ratio(part, whole, np.ones(len(whole))) or (0.0, (0.0, 0.0))


def _ratio(part: np.ndarray, whole: np.ndarray, own: np.ndarray) -> tuple[float, tuple[float, float]] | None:
    """Return the ratio of two sums over groups (G,), at most 1, with its interval by `half_width`; None of no whole."""
    if whole.sum() <= 0:
        return None
    value = min(float(part.sum() / whole.sum()), 1.0)
    half = half_width(value, part, whole, own)
    return value, (value - half, min(value + half, 1.0))


def half_width(value: float, part: np.ndarray, whole: np.ndarray, own: np.ndarray) -> float:
    """Return half of the 95 % interval of a ratio of two sums over groups (G,), 0 where there is one group.

    It is Student's, linearised: groups are few, and of groups drawn anew some sets have no whole. What a group misses
    counts as if the ratio had been found without it, by its `own` weight (MacKinnon and White 1985).
    """
    groups = len(whole)
    if groups < 2:
        return 0.0
    missed = (part - value * whole) / (1 - np.clip(own / own.sum(), 0.0, _MOST))
    error = float(np.sqrt(np.sum(missed**2) * (groups - 1) / groups) / whole.sum())
    return float(scipy.special.stdtrit(groups - 1, 0.975)) * error

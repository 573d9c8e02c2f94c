"""Whether a robot stays as near to its twin as it used to: the residual of the last two seconds beside its usual band.

The band is what that residual seldom exceeded on the runs that the twin knows, so it is the twin's own measure. The
state has hysteresis: the band is left at a larger ratio than it is entered again.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np

from irtwin.twin.so_far import WatchedStretch

OUTSIDE, INSIDE = 1.5, 1.1  # times the band: beyond the first the gap leaves it, below the second it is back
SEEN_AS = 1.0  # s that an excursion lasts at least; shorter ones are forgotten when they end
_STEP, _STEPS = 0.25, 8  # s between two looks, and how many of them the residual is of
_SELDOM = 0.99  # of the windows of a run that the twin knows lie within the band
ROBOT = "robot"  # the place of power


class Windows:
    """Root mean squares of residuals over the last two seconds, every quarter of a second of the run's time."""

    def __init__(self) -> None:
        self._steps: deque[tuple[np.ndarray, np.ndarray]] = deque(maxlen=_STEPS)
        self._now: int | None = None
        self._sums = self._counts = np.zeros(0)

    def take(self, time: np.ndarray, residuals: np.ndarray, *, begins: bool) -> Iterator[tuple[float, np.ndarray]]:
        """Take residuals (N, k), NaN where not measured; yield times and (k,) root mean squares as they are complete.

        `begins`: a hole in time was before.
        """
        if begins:
            self._steps.clear()
            self._now = None
        steps = np.floor(time / _STEP).astype(int)
        cuts = [0, *(np.flatnonzero(np.diff(steps)) + 1).tolist(), len(time)]
        known = ~np.isnan(residuals)
        squares = np.where(known, residuals, 0.0) ** 2
        for start, stop in pairwise(cuts):
            if start == stop:
                continue
            if self._now != steps[start]:
                if self._now is not None:
                    self._steps.append((self._sums, self._counts))
                    if len(self._steps) == _STEPS:
                        yield float(steps[start] * _STEP), self._root()
                self._now = int(steps[start])
                self._sums = self._counts = np.zeros(residuals.shape[1])
            self._sums = self._sums + squares[start:stop].sum(axis=0)
            self._counts = self._counts + known[start:stop].sum(axis=0)

    def _root(self) -> np.ndarray:
        sums, counts = (np.sum([step[part] for step in self._steps], axis=0) for part in (0, 1))
        return np.asarray(np.sqrt(np.divide(sums, counts, out=np.full(len(sums), np.nan), where=counts > 0)))


@dataclass
class Excursion:
    """A time outside the band; times in s, residual in N m or W; `ended` is None while it lasts."""

    began: float
    until: float
    peak_residual: float
    peak_ratio: float
    ended: float | None = None


@dataclass
class PlaceState:
    """The gap of one joint's torque, or of power, now."""

    band: float
    residual: float
    ratio: float
    state: str
    since: float
    excursions: list[Excursion] = field(default_factory=list)


class GapWatch:
    """Follows the gap of a run by place: each joint for its torque, `ROBOT` for power. `places` are those measured."""

    def __init__(self, joints: Iterable[str], bands: Mapping[str, float]) -> None:
        """Take the bands by place, N m and W; a place without one is not watched."""
        self.places: dict[str, PlaceState] = {}
        self._names = (*joints, ROBOT)
        self._bands = {place: band for place, band in bands.items() if band > 0}
        self._windows = Windows()

    def take(self, stretch: WatchedStretch) -> None:
        """Take the next stretch of the run."""
        for time, roots in self._windows.take(*residuals(stretch), begins=stretch.begins):
            for place, root in zip(self._names, roots.tolist(), strict=True):
                if place in self._bands and not np.isnan(root):
                    self._look(place, time, root)

    def end(self) -> None:
        """End the run: what lasts ends with it."""
        for now in self.places.values():
            if now.excursions and now.excursions[-1].ended is None:
                self._come_back(now, now.excursions[-1].until)

    def _look(self, place: str, time: float, residual: float) -> None:
        band = self._bands[place]
        ratio = residual / band
        now = self.places.setdefault(place, PlaceState(band, residual, ratio, "inside", time))
        now.residual, now.ratio = residual, ratio
        if now.state == "inside" and ratio > OUTSIDE:
            now.state, now.since = "outside", time
            now.excursions.append(Excursion(time, time, residual, ratio))
        elif now.state == "outside":
            last = now.excursions[-1]
            last.until = time
            last.peak_residual, last.peak_ratio = max(last.peak_residual, residual), max(last.peak_ratio, ratio)
            if ratio < INSIDE:
                now.state, now.since = "inside", time
                self._come_back(now, time)

    def _come_back(self, now: PlaceState, time: float) -> None:
        last = now.excursions[-1]
        last.ended = time
        if last.ended - last.began < SEEN_AS:
            now.excursions.pop()


def residuals(stretch: WatchedStretch) -> tuple[np.ndarray, np.ndarray]:
    """Return times (N,) s and residuals (N, n + 1) of torque and power; without the sample of the stretch before."""
    new = slice(0 if stretch.begins else 1, None)
    missing = np.full_like(stretch.torque, np.nan)
    torque = missing if stretch.torque_residual is None else stretch.torque_residual
    power = missing[:, 0] if stretch.power_residual is None else stretch.power_residual
    return stretch.motion.time[new], np.column_stack([torque, power])[new]


def band(windows: np.ndarray) -> np.ndarray:
    """Return the band of each column of root mean squares (M, k); NaN where there are none."""
    known = ~np.isnan(windows).all(axis=0)
    widest = np.full(windows.shape[1], np.nan)
    widest[known] = np.nanquantile(windows[:, known], _SELDOM, axis=0)
    return widest

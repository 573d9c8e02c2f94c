"""The last minutes of a power of a robot that is watched, for a page that begins to look on."""

from __future__ import annotations

import numpy as np

SECONDS = 300.0  # that are remembered
BIN = 0.1  # s, of which the lowest sample and the highest are kept


class Curve:
    """Samples of the last minutes: of each bin the lowest and the highest, at their own times, so that peaks stay.

    It takes 96 kB, whatever the rate of the samples.
    """

    def __init__(self) -> None:
        self._ends = np.full((round(SECONDS / BIN), 2, 2), np.nan)  # a ring of bins: lowest, highest; time, value
        self._bin = -1  # the newest, whose ends are written into the ring once it is over, or asked for
        self._lowest = self._highest = (-np.inf, np.nan)
        self._newest = -np.inf

    def add(self, time: float, value: float) -> None:
        """Take a sample, its time in s since 1970; one of an earlier time than the newest begins anew."""
        if time < self._newest:
            self._ends.fill(np.nan)
            self._bin = -1
        self._newest = time
        number = int(time / BIN)
        if number != self._bin:
            self._write()
            self._bin = number
            self._lowest = self._highest = (time, value)
        elif value < self._lowest[1]:
            self._lowest = (time, value)
        elif value > self._highest[1]:
            self._highest = (time, value)

    def _write(self) -> None:
        if self._bin >= 0:
            self._ends[self._bin % len(self._ends)] = self._lowest, self._highest

    def points(self) -> np.ndarray:
        """Return times, s since 1970, and values, (M, 2), in the order of time."""
        self._write()
        ends = self._ends.reshape(-1, 2)
        return np.unique(ends[ends[:, 0] > self._newest - SECONDS], axis=0)  # one where the lowest is the highest

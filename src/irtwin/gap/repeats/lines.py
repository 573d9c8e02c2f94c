"""Line spectrum: frequencies that stand out of the spectrum of what two runs of one motion differ by.

What the columns of a series leave of it is windowed, so that a strong line leaks into no other frequency, and held
against the median of the frequencies around, on the side where these are louder: coloured noise is no line. Where a
frequency stands out, a wave is fitted beside the columns, and the next is looked for in what all leave.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy

from irtwin.effects.effect import NORMAL
from irtwin.gap.repeats.series import EvenSeries, waves

_PERIODS = 3  # of a line in a run at least: the window blurs what is slower
_HIGHEST = 0.95  # of half the sampling rate
_FINE = 2  # points of the spectrum for each that is independent
_NEAR = 2  # independent points on either side that belong to a line,
_AROUND = 12  # and beyond them those that it is held against
_MEDIAN = float(np.log(np.log(2)))  # of the logarithm of what is exponential, with mean one
_FREE = 0.1  # of a wave must be left by the columns beside it
_MOST = 8  # lines of one channel


@dataclass(frozen=True)
class Line:
    """A line: `frequency` Hz with its standard `error`; `amplitude` of one run, its 95 % `interval`; p, of all tests.

    Two runs differ by twice the amplitude times the sine of half of what their phases differ by, which may be anything.
    `purity`: the part of what stands out around the line that one steady wave explains. `size`: its mean square in one
    run, were its phases random.
    """

    frequency: float
    error: float
    amplitude: float
    interval: tuple[float, float]
    purity: float
    p: float

    @property
    def size(self) -> float:
        """The mean square."""
        return self.amplitude**2 / 2


def lines(series: Sequence[EvenSeries], tests: int) -> tuple[list[Line], list[EvenSeries]]:
    """Return the lines that all series show together, the strongest first, and the series with these beside them.

    Each series is the difference of two runs. `tests`: how many channels are searched, for which p is adjusted. A line
    is told where it says more of the samples than its two coefficients cost (Schwarz): p is below one over them.
    """
    series = list(series)
    told: list[Line] = []
    grid = _grid(series)
    while len(grid) > 4 * _AROUND and len(told) < _MOST:
        power = np.array([_power(difference, grid) for difference in series])
        noise = np.array([_noise(row, grid) for row in power])
        stands = (power / noise).sum(axis=0)
        best = int(np.argmax(stands))
        p = float(min(1.0, scipy.special.gammaincc(len(series), stands[best]) * len(grid) / _FINE * tests))
        if not p * sum(len(difference.values) for difference in series) <= len(series):
            break
        near = np.abs(np.arange(len(grid)) - best) <= _FINE * _NEAR
        line, series = _line(series, grid, best, noise[:, best])
        rest = sum(float(_power(difference, grid)[near].sum()) for difference in series)
        purity = 1 - min(rest / float(power[:, near].sum()), 1.0)
        told.append(Line(*line, purity, p))
    return told, series


def _grid(series: Sequence[EvenSeries]) -> np.ndarray:
    """Return the frequencies to try, (F,) Hz: even, so that those of a run cut short are told apart too."""
    seconds = [difference.seconds for difference in series]
    step = 1 / (_FINE * max(seconds))
    highest = _HIGHEST * min(difference.rate for difference in series) / 2
    return np.asarray(step * np.arange(np.ceil(_PERIODS / min(seconds) / step), np.floor(highest / step) + 1))


def _power(series: EvenSeries, grid: np.ndarray) -> np.ndarray:
    """Return the power that what is left of a series has at even frequencies, (F,): of white noise its mean square.

    Nothing, where the columns beside it leave less than `_FREE` of a wave. No more than before they are taken off: the
    rounding of positions has lines of its own.
    """
    window = np.hanning(len(series.values) + 2)[1:-1]
    turn = 2j * np.pi / series.rate
    ratio, start = np.exp(-turn * (grid[1] - grid[0])), np.exp(turn * grid[0])

    def transform(columns: np.ndarray) -> np.ndarray:
        sums = scipy.signal.czt(columns, len(grid), ratio, start, axis=0)
        return np.asarray(np.abs(sums) ** 2)

    taken = transform(series.basis()).sum(axis=1) / len(window)
    told = transform(window[:, None] * np.column_stack([series.left(), series.values]))
    return np.where(taken < 1 - _FREE, told.min(axis=1) / float(window @ window), 0.0)


def _noise(power: np.ndarray, grid: np.ndarray) -> np.ndarray:
    """Return the noise's power at each frequency, (F,): the median of the louder side, as what wanders falls off.

    Below there is little to hold the lowest frequencies against, so they are from those above, by the square of their
    ratio: that of a random walk.
    """
    logs = np.log(np.maximum(power, 1e-12 * max(float(power.max(initial=0.0)), 1e-300)))
    width, apart = _FINE * _AROUND, _FINE * (_NEAR + _AROUND // 2)
    padded = np.pad(scipy.ndimage.median_filter(logs, size=width, mode="reflect"), apart, mode="reflect")
    below, above = padded[: len(logs)], padded[2 * apart :]
    falling = 2 * np.log1p(apart * (grid[1] - grid[0]) / grid)
    return np.asarray(np.exp(np.maximum(below, above + falling) - _MEDIAN))


def _line(
    series: Sequence[EvenSeries], grid: np.ndarray, best: int, noise: np.ndarray
) -> tuple[tuple[float, float, float, tuple[float, float]], list[EvenSeries]]:
    """Place a line between the points of the grid; return its frequency and amplitude, and the series beside it."""

    def beside(frequency: float) -> list[EvenSeries]:
        return [difference.with_columns(*waves(difference.time, frequency)) for difference in series]

    def missed(frequency: float) -> float:
        return float(sum(np.sum(own.left() ** 2) / level for own, level in zip(beside(frequency), noise, strict=True)))

    step = grid[1] - grid[0]
    ends = (grid[best] - step, grid[best] + step)
    least = scipy.optimize.minimize_scalar(missed, bounds=ends, method="bounded", options={"xatol": 1e-3 * step})
    frequency = float(least.x)
    more = beside(frequency)
    heights = np.array([float(np.linalg.norm(difference.coefficients()[-2:])) for difference in more])
    amplitude = float(np.sqrt(np.mean(heights**2) / 2))  # of one run: a difference has two, of any phases
    samples, seconds = np.array([(len(difference.values), difference.seconds) for difference in series]).T
    signal = max(float(np.sum(heights**2 * samples / 4 / noise)), 1.0)
    error = float(np.sqrt(1.5 / signal) / (np.pi * seconds.mean()))
    return (frequency, error, amplitude, _ends(heights, np.sqrt(4 * noise / samples))), more


def _ends(heights: np.ndarray, deviations: np.ndarray) -> tuple[float, float]:
    """Return the ends of a run's amplitude, by the highest of the differences (P,), whose phases may be any."""
    best = int(np.argmax(heights))
    sines = [float(np.sin(np.pi / 2 * share ** (1 / len(heights)))) for share in (0.975, 0.025)]
    lower, upper = (float(heights[best] + side * NORMAL * deviations[best]) for side in (-1, 1))
    return max(lower / 2, 0.0) / sines[0], upper / 2 / sines[1]

"""Line spectrum: frequencies that stand out of the spectrum of what two runs of one motion differ by.

At each frequency a wave is fitted beside the columns of a series (the least-squares periodogram of Lomb and Scargle,
with nuisance columns). What it explains is held against the median of the frequencies around, on the side where these
are louder, so that coloured noise is no line. The frequencies around are those of what the wave leaves: a strong line
leaks into them, and would hide itself.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import median_filter
from scipy.optimize import minimize_scalar
from scipy.signal import czt
from scipy.stats import gamma

from irtwin.gap.repeats.series import Series, waves
from irtwin.gap.thresholds import NotRepeating

_FINE = 2  # points of the spectrum for each that is independent
_NEAR = 2  # independent points on either side that belong to a line,
_AROUND = 12  # and beyond them those that it is held against
_MEDIAN = float(np.log(np.log(2)))  # of the logarithm of what is exponential, with mean one
_FREE = 0.1  # of a wave must be left by the columns beside it, for it to be looked for
_FREE_STILL = 0.01  # or to be placed: its best frequency may lie closer to theirs
_MOST = 8  # lines of one channel
_NORMAL = 1.96


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


def lines(series: Sequence[Series], tests: int, limits: NotRepeating) -> tuple[list[Line], list[Series]]:
    """Return the lines that all series show together, the strongest first, and the series with these beside them.

    Each series is the difference of two runs. `tests`: how many channels are searched, for which p is adjusted.
    """
    series = list(series)
    found: list[Line] = []
    grid = _grid(series, limits)
    while len(grid) > 4 * _AROUND and len(found) < _MOST:
        explained = np.array([_explained(one, grid) for one in series])
        noise = np.array([_noise(each, grid) for each in explained])
        likely = {int(np.argmax((explained / noise).sum(axis=0))), int(np.argmax(explained.sum(axis=0)))}
        around = {best: _around(series, grid, best) for best in likely}
        stands = {best: float(np.sum(explained[:, best] / around[best])) for best in likely}
        best = max(likely, key=lambda place: stands[place])
        p = float(min(1.0, gamma.sf(stands[best], len(series)) * len(grid) / _FINE * tests))
        if not p <= limits.alpha:
            break
        line, series = _line(series, grid, best, around[best], p)
        found.append(line)
    return found, series


def _around(series: Sequence[Series], grid: np.ndarray, best: int) -> np.ndarray:
    """Return what noise explains at a frequency of each series, (S,), told from what a wave of it leaves."""
    near = np.abs(np.arange(len(grid)) - best) <= _FINE * _NEAR
    found = []
    for one in series:
        left = _explained(one.with_columns(*waves(one.time, grid[best])), grid)
        left[near] = np.interp(grid[near], grid[~near], left[~near])
        found.append(_noise(left, grid)[best])
    return np.array(found)


def _grid(series: Sequence[Series], limits: NotRepeating) -> np.ndarray:
    """Return the frequencies to try, (F,) Hz: even, so that those of a run cut short are told apart too."""
    seconds = [one.seconds for one in series]
    step = 1 / (_FINE * max(seconds))
    highest = limits.highest * min(one.rate for one in series) / 2
    return np.asarray(step * np.arange(np.ceil(limits.periods / min(seconds) / step), np.floor(highest / step) + 1))


def _transform(values: np.ndarray, one: Series, grid: np.ndarray) -> np.ndarray:
    """Return the Fourier sums of columns (N, m) at even frequencies, (F, m)."""
    turn = 2j * np.pi / one.rate
    ratio, start = np.exp(-turn * (grid[1] - grid[0])), np.exp(turn * grid[0])
    return np.asarray(czt(values, len(grid), ratio, start, axis=0))


def _explained(one: Series, grid: np.ndarray, free: float = _FREE) -> np.ndarray:
    """Return the squares that a wave of each frequency explains beside the columns, (F,), halved: of mean S², white.

    Nothing, where the columns leave less than `free` of it.
    """
    basis, count = one.basis(), len(one.values)
    left = one.left()
    sums = _transform(np.column_stack([left, basis]), one, grid)
    twice = _transform(np.ones((count, 1)), one, 2 * grid)[:, 0]
    own, beside = sums[:, 0], sums[:, 1:]
    cosine, sine = beside.real, -beside.imag
    both = np.empty((len(grid), 2, 2))
    both[:, 0, 0] = (count + twice.real) / 2 - (cosine**2).sum(axis=1)
    both[:, 1, 1] = (count - twice.real) / 2 - (sine**2).sum(axis=1)
    both[:, 0, 1] = both[:, 1, 0] = -twice.imag / 2 - (cosine * sine).sum(axis=1)
    imitated = np.linalg.eigvalsh(both)[:, 0] < free * count / 2
    both[imitated] = np.eye(2)
    right = np.stack([own.real, -own.imag], axis=1)
    found = np.einsum("fi,fi->f", right, np.linalg.solve(both, right[..., None])[..., 0]) / 2
    return np.asarray(np.where(imitated, 0.0, found))


def _noise(explained: np.ndarray, grid: np.ndarray) -> np.ndarray:
    """Return what noise explains at each frequency, (F,): the median of the louder side, as what wanders falls off.

    Below there is little to hold the lowest frequencies against, so they are from those above, by the square of their
    ratio: that of a random walk.
    """
    logs = np.log(np.maximum(explained, 1e-12 * max(float(explained.max(initial=0.0)), 1e-300)))
    width, apart = _FINE * _AROUND, _FINE * (_NEAR + _AROUND // 2)
    padded = np.pad(median_filter(logs, size=width, mode="reflect"), apart, mode="reflect")
    below, above = padded[: len(logs)], padded[2 * apart :]
    falling = 2 * np.log1p(apart * (grid[1] - grid[0]) / grid)
    return np.asarray(np.exp(np.maximum(below, above + falling) - _MEDIAN))


def _line(
    series: Sequence[Series], grid: np.ndarray, best: int, noise: np.ndarray, p: float
) -> tuple[Line, list[Series]]:
    """Place a line between the points of the grid; return it, and the series with it beside them."""
    step = grid[1] - grid[0]

    def missed(frequency: float) -> float:
        return -float(np.sum(at(frequency) / noise))

    def at(frequency: float) -> np.ndarray:
        near = np.array([frequency, frequency + step])
        return np.array([_explained(one, near, _FREE_STILL)[0] for one in series])

    placed = minimize_scalar(missed, bounds=(grid[best] - step, grid[best] + step), method="bounded")
    frequency = float(placed.x)
    more = [one.with_columns(*waves(one.time, frequency)) for one in series]
    near = grid[max(0, best - _FINE * _NEAR) : best + _FINE * _NEAR + 1]
    rest = np.sum([_explained(one, near) for one in more], axis=0).max(initial=0.0)
    samples = np.array([len(one.values) for one in series])
    whole = at(frequency)
    heights = np.array([float(np.linalg.norm(one.coefficients()[-2:])) for one in more])
    amplitude = float(np.sqrt(np.mean(heights**2) / 2))  # of one run: a difference has two, of any phases
    interval = _ends(heights, np.sqrt(4 * noise / samples))
    seconds = float(np.mean([one.seconds for one in series]))
    signal = float(np.sum(whole / noise))
    error = float(np.sqrt(1.5 / max(signal, 1.0)) / (np.pi * seconds))
    return Line(frequency, error, amplitude, interval, float(whole.sum() / (whole.sum() + rest)), p), more


def _ends(heights: np.ndarray, deviations: np.ndarray) -> tuple[float, float]:
    """Return the ends of a run's amplitude, by the highest of the differences (P,), whose phases may be any."""
    best = int(np.argmax(heights))
    sines = [float(np.sin(np.pi / 2 * share ** (1 / len(heights)))) for share in (0.975, 0.025)]
    lower, upper = (float(heights[best] + side * _NORMAL * deviations[best]) for side in (-1, 1))
    return max(lower / 2, 0.0) / sines[0], upper / 2 / sines[1]

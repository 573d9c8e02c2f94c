"""What is as smooth as a motion, worked out at some of its samples: logs have many more than the motion needs.

States pass a filter before they are differentiated, so that bodies' torque has nothing far above its cutoff. It is
worked out at every few samples. From these a kernel that is fitted to the filter's gain, by least squares, makes what
filter and decimation make of all samples, or gives the samples between.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

import numpy as np

from irtwin.signals.filter import banded, decimate, decimation, kernel
from irtwin.signals.motion import Motion

_RATE = 6.5  # times the cutoff: what folds into what is kept lies above 4.8, where states' own filter passes 2 %
_PASSED = 1.7  # times the cutoff: beyond, the kernel passes less than 1 % ...
_LOOSE = 1e-3  # ... and may be off by this times more, for 3e-7 below
_SMOOTH = 2.2  # times the cutoff, within which a factor of what is smooth matters
_REACH = 10  # sparse samples on either side of one between, which is then told to 5e-7
_FACTORS_REACH = 6  # sparse samples on either side, in a factor's filter
_GRID = 400  # frequencies at which gains are fitted
_AT_ONCE = 16  # rows that are made by one product of matrices
_SPARSE_AT_ONCE = 32  # sparse samples between which others are found so


@dataclass(frozen=True)
class Sparse:
    """Columns at every so many samples of a part, from its first on, (M, r), of which `mixed` (r, k) makes k columns.

    None: they are the columns themselves.
    """

    values: np.ndarray
    mixed: np.ndarray | None = None


def thinning(motion: Motion) -> tuple[np.ndarray, int]:
    """Return the kernel of the filter that a motion's measurement went through, and the step of decimation."""
    whole = motion.whole or motion
    if not motion.cutoff:
        return np.ones(1), 1
    return kernel(whole.rate, motion.cutoff), decimation(whole.rate, motion.cutoff)


def sparse_step(motion: Motion) -> int:
    """Return every which sample tells all that is smooth."""
    if not motion.cutoff:
        return 1
    return max(1, int((motion.whole or motion).rate / (_RATE * motion.cutoff)))


def at_some(motion: Motion) -> Motion:
    """Return a motion's samples that tell all that is smooth."""
    every = sparse_step(motion)
    return motion if every == 1 else motion.rows(slice(None, None, every))


def at_all(of: Callable[[Motion], np.ndarray], motion: Motion) -> np.ndarray:
    """Return what is smooth, `of` a motion's samples (N, ...), at all N: worked out at some, and at both ends."""
    every, count = sparse_step(motion), len(motion.time)
    first, last = (_REACH - 1) * every, (-(-count // every) - _REACH) * every
    if every == 1 or last - first < 2 * first:
        return of(motion)
    assert motion.cutoff
    band = _between((motion.whole or motion).rate, motion.cutoff, every)
    values = of(motion.rows(np.r_[0:first, 0:count:every, last:count]))
    some = values[first : len(values) - (count - last)]
    inner = banded(band, some.reshape(len(some), -1), last - first, _SPARSE_AT_ONCE).reshape(
        last - first, *some.shape[1:]
    )
    return np.concatenate([values[:first], inner, values[len(values) - (count - last) :]])


def factor_at_some(values: np.ndarray, motion: Motion) -> np.ndarray:
    """Return values (N, n) at the samples of `at_some`, without what no product with a smooth one has after a filter.

    They may jump as dry friction does. Beyond either end they are taken to stay.
    """
    every = sparse_step(motion)
    if every == 1:
        return values
    assert motion.cutoff
    taps = _factors((motion.whole or motion).rate, motion.cutoff, every)
    return decimate(np.pad(values, ((len(taps) // 2,) * 2, (0, 0)), mode="edge"), taps, every)


def decimate_sparse(sparse: np.ndarray, motion: Motion, count: int) -> np.ndarray:
    """Return of columns (M, k) at some samples of a motion's part the `count` rows that `decimate` makes of all."""
    whole, every = motion.whole or motion, sparse_step(motion)
    if every == 1:
        return decimate(sparse, *thinning(motion))
    assert motion.cutoff
    band, advance = _decimating(whole.rate, motion.cutoff, every)
    return banded(band, sparse, count, advance)


@cache
def _decimating(rate: float, cutoff: float, every: int) -> tuple[np.ndarray, int]:
    """Return a matrix that filters and decimates, and by how many sparse samples it moves on."""
    taps, step = kernel(rate, cutoff), decimation(rate, cutoff)
    half, rows = len(taps) // 2, every * max(1, _AT_ONCE // every)
    gain = np.cos(2 * np.pi * np.outer(_frequencies(every), np.arange(-half, half + 1))) @ taps
    weights = np.where(_frequencies(every) < _PASSED * cutoff / rate, 1.0, _LOOSE)
    band = np.zeros((rows, ((rows - 1) * step + 2 * half) // every + 1))
    for row in range(rows):
        places = np.arange(-(-row * step // every), (row * step + 2 * half) // every + 1)
        band[row, places] = _fitted(places * every - row * step - half, every, gain, weights)
    return band, rows * step // every


@cache
def _between(rate: float, cutoff: float, every: int) -> np.ndarray:
    """Return a matrix that gives all samples from those `_REACH - 1` sparse ones before on."""
    weights = np.where(_frequencies(every) < 2 * cutoff / rate, 1.0, _LOOSE**2)
    band = np.zeros((_SPARSE_AT_ONCE * every, _SPARSE_AT_ONCE + 2 * _REACH - 1))
    for row in range(len(band)):
        places = np.arange(row // every, row // every + 2 * _REACH)
        offsets = (places - _REACH + 1) * every - row
        band[row, places] = _fitted(offsets, every, np.ones(_GRID), weights)
    return band


@cache
def _factors(rate: float, cutoff: float, every: int) -> np.ndarray:
    """Return the kernel of a factor of what is smooth, of sum one."""
    offsets, width = np.arange(-_FACTORS_REACH * every, _FACTORS_REACH * every + 1), _SMOOTH * cutoff / rate
    at = np.linspace(0, 0.5, _GRID * every)
    folded = np.abs((at + 0.5 / every) % (1 / every) - 0.5 / every) < width
    passed = (at[folded] < width).astype(float)
    taps = np.linalg.lstsq(np.cos(2 * np.pi * np.outer(at[folded], offsets)), passed, rcond=1e-8)[0]
    return np.asarray(taps / taps.sum())


def _frequencies(every: int) -> np.ndarray:
    """Return the frequencies that some samples tell, a sample."""
    return np.linspace(0, 0.5 / every, _GRID)


def _fitted(offsets: np.ndarray, every: int, gain: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Return the taps at offsets, in samples, whose gain at `_frequencies` is nearest to a real one."""
    angles = 2 * np.pi * np.outer(_frequencies(every), offsets)
    rows = np.concatenate([weights[:, None] * np.cos(angles), weights[:, None] * np.sin(angles)])
    return np.asarray(np.linalg.lstsq(rows, np.concatenate([weights * gain, np.zeros(_GRID)]), rcond=None)[0])

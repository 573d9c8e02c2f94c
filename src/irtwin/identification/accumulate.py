"""One pass over the samples: each block of time leaves a small triangular factor.

Whatever is asked later (fits, weights, cross-validation by run, intervals) works on these factors; the samples are
not read again.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from irtwin.signals.filter import decimate, decimation, kernel
from irtwin.signals.motion import Motion


@dataclass(frozen=True)
class Rows:
    """g equations a sample: columns (N, g, K) @ coefficients + known (N, g) = measured (N, g).

    Where `undecided` (N, g) the equation does not hold, and is left out.
    """

    columns: np.ndarray
    known: np.ndarray
    measured: np.ndarray
    undecided: np.ndarray | None = None


Equations = Callable[[Motion], Rows]

_CHUNK = 4096  # samples whose columns are held at once
_BLOCKS = 40  # at least, over all motions: enough for intervals
_UNDECIDED = 0.1  # of the filter's kernel: where more of it is undecided, so is what it gives
_SHORTEST = 4.0  # periods of the cutoff in a block: residuals are then nearly independent between blocks


@dataclass(frozen=True)
class Block:
    """A stretch of a run, reduced.

    `factors[e]` is the triangular factor of equation e's rows of [columns | measurement], (r, k_e + 1) with
    r <= k_e + 1; `rows` (g,) is how many each equation had.
    """

    run: str
    start: float  # s
    stop: float  # s
    rows: np.ndarray
    factors: tuple[np.ndarray, ...]


def accumulate(motions: Sequence[Motion], equations: Equations, pattern: np.ndarray) -> list[Block]:
    """Reduce the motions to blocks.

    `pattern`: (g, K) which columns each equation has. What is computed from the motion passes the filter that its
    measurement went through (its `cutoff`), and both are then decimated to what lies below it. Half a kernel at
    either end of a run is left out, where a filter knows only one side.
    """
    total = sum(float(motion.time[-1] - motion.time[0]) for motion in motions)
    blocks = []
    for motion in motions:
        for start, stop in _stretches(motion, total):
            blocks.append(_reduce(motion, start, stop, equations, pattern))
    return [block for block in blocks if block.rows.any()]


def triangle(rows: np.ndarray) -> np.ndarray:
    """Return the triangular factor of rows (N, k): (min(N, k), k), with the same products of columns."""
    return np.asarray(np.linalg.qr(rows, mode="r"))


def _stretches(motion: Motion, total: float) -> list[tuple[int, int]]:
    """Cut a motion into the sample ranges of its blocks, of equal length."""
    seconds = float(motion.time[-1] - motion.time[0])
    shortest = _SHORTEST / motion.cutoff if motion.cutoff else 0.0
    count = max(1, int(min(np.ceil(_BLOCKS * seconds / total), seconds / shortest if shortest else np.inf)))
    edges = np.linspace(0, len(motion.time), count + 1).astype(int)
    return list(zip(edges[:-1].tolist(), edges[1:].tolist(), strict=True))


def _reduce(motion: Motion, start: int, stop: int, equations: Equations, pattern: np.ndarray) -> Block:
    taps = kernel(motion.rate, motion.cutoff) if motion.cutoff else np.ones(1)
    step = decimation(motion.rate, motion.cutoff) if motion.cutoff else 1
    half = len(taps) // 2
    factors = [np.zeros((0, int(row.sum()) + 1)) for row in pattern]
    rows = np.zeros(len(pattern), dtype=int)
    size = max(step, _CHUNK // step * step)
    for first in range(max(start, half), min(stop, len(motion.time) - half), size):
        last = min(first + size, stop, len(motion.time) - half)
        sample = equations(motion.part(first - half, last + half))
        columns = decimate(sample.columns, taps, step)
        measured = sample.measured[half : len(sample.measured) - half : step] - decimate(sample.known, taps, step)
        keep = np.ones(measured.shape, dtype=bool)
        if sample.undecided is not None:
            keep = decimate(sample.undecided.astype(float), np.abs(taps), step) < _UNDECIDED
        rows += keep.sum(axis=0)
        for equation, used in enumerate(pattern):
            chosen = keep[:, equation]
            part = np.column_stack([columns[chosen, equation][:, used], measured[chosen, equation]])
            factors[equation] = triangle(np.concatenate([factors[equation], part]))
    return Block(motion.run, float(motion.time[start]), float(motion.time[stop - 1]), rows, tuple(factors))

"""One pass over the samples: each block of time leaves a small triangular factor.

Whatever is asked later (fits, weights, cross-validation by run, intervals) works on these factors; the samples are
not read again.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, replace
from itertools import islice, pairwise

import numpy as np
import scipy

from irtwin.errors import InputError
from irtwin.identification.progress import tell_step
from irtwin.identification.two_processes import can_copy, shared
from irtwin.signals.filter import decimate, kernel
from irtwin.signals.motion import Motion
from irtwin.signals.sparse import Sparse, decimate_sparse, thinning

Columns = Sequence[np.ndarray | Sparse]
Given = Columns | Callable[[], Columns]  # an equation's columns


@dataclass(frozen=True)
class Rows:
    """g equations a sample: columns (N, g, K) @ coefficients + known (N, g) = measured (N, g).

    `columns` may also be, for each equation, the arrays (N, some) that side by side are the columns which it has by the
    `pattern`, or what tells them sparsely: they are joined when few samples are left. A function that returns them is
    called beside the work on the next part. Where `undecided` (N, g) the equation does not hold, and is left out. Rows
    where it is `slow` (N, g) stay apart from the others.
    """

    columns: np.ndarray | Sequence[Given]
    known: np.ndarray
    measured: np.ndarray
    undecided: np.ndarray | None = None
    slow: np.ndarray | None = None

    def own(self, equation: int, used: np.ndarray) -> Columns:
        """Return the columns of an equation, `used` (K,) by the pattern, as arrays (N, some) to stand side by side."""
        if isinstance(self.columns, np.ndarray):
            return [self.columns[:, equation, used]]
        given = self.columns[equation]
        return given() if callable(given) else given

    def dense(self, equation: int, used: np.ndarray) -> list[np.ndarray]:
        """Return `own` where none are sparse."""
        return [part for part in self.own(equation, used) if isinstance(part, np.ndarray)]


Equations = Callable[[Motion], Rows]

_CHUNK = 8192  # samples whose columns are held at once,
_ROWS = 2048  # of which no more than this are left by decimation: they stay in the processor's cache
_NARROW = 32  # columns: fewer are filtered together with others, as products of small matrices take long
_PANEL = 64  # columns that LAPACK takes together
_ROUNDING = 1e-15  # of a column's square: less of what others leave of it is rounding
_SHARED = 2e7  # samples times columns: some 1 s, and a copy of the process takes 0.1 s
_BESIDE = 100  # columns take as long as what a sample takes beside its columns
_BLOCKS = 40  # at least, over all motions: enough for intervals
_UNDECIDED = 0.1  # of the filter's kernel: where more of it is undecided, so is what it gives
_SLOW = 0.02  # of the kernel: a row with more of it is slow, as one reversal outweighs many quiet rows
_ENOUGH = 60_000  # samples that tell where to begin, or which shape to take, as well as all do
_SHORTEST = 4.0  # periods of the cutoff in a block: residuals are then nearly independent between blocks


@dataclass(frozen=True)
class Slow:
    """Slow rows of a block's equations: how many there were, (g,), and from which row of the factor on, (g,)."""

    begin: np.ndarray
    rows: np.ndarray


@dataclass(frozen=True)
class Block:
    """A stretch of a run, reduced.

    `factors[e]` is a factor, (r, k_e + 1) with r <= k_e + 1, of equation e's rows of [columns | measurement]: with the
    same products of columns, or two on top of each other; `rows` (g,) is how many each equation had. `slow`: which of
    both are of slow rows; None where none were told apart.
    """

    run: str
    start: float  # s
    stop: float  # s
    rows: np.ndarray
    factors: tuple[np.ndarray, ...]
    slow: Slow | None = None

    def of(self, equations: slice) -> Block:
        """Return some equations of the block."""
        slow = None if self.slow is None else Slow(self.slow.begin[equations], self.slow.rows[equations])
        return replace(self, rows=self.rows[equations], factors=self.factors[equations], slow=slow)

    def weighted(self, weights: np.ndarray) -> Block:
        """Return the block with each equation's rows counting by its weight, (g,)."""
        factors = (np.sqrt(weight) * factor for weight, factor in zip(weights, self.factors, strict=True))
        return replace(self, factors=tuple(factors))

    @property
    def apart(self) -> Block:
        """The block with 2 g equations: those of fast rows, then those of slow ones."""
        assert self.slow is not None
        cut = [np.split(factor, [begin]) for factor, begin in zip(self.factors, self.slow.begin, strict=True)]
        factors = (*(fast for fast, _ in cut), *(slow for _, slow in cut))
        return replace(
            self, rows=np.concatenate([self.rows - self.slow.rows, self.slow.rows]), factors=factors, slow=None
        )


def accumulate(
    motions: Sequence[Motion], equations: Equations, pattern: np.ndarray, *, by_products: bool = False, every: int = 1
) -> list[Block]:
    """Reduce the motions to blocks.

    `pattern`: (g, K) which columns each equation has. What is computed from the motion passes the filter that its
    measurement went through (its `cutoff`), and both are then decimated to what lies below it. Half a kernel at
    either end of a run is left out, where a filter knows only one side. `every`: every which block is made, of blocks
    so many times as short; one is all. `by_products`: factors are worked out of the products of columns, in a quarter
    of the time where these are many; they are no triangles, and what is below 1e-8 of a column is lost in rounding.
    Raises InputError where nothing is left.
    """
    blocks = accumulate_any(motions, equations, pattern, by_products=by_products, every=every)
    if not blocks:
        raise _nothing_left(motions)
    return blocks


def accumulate_any(
    motions: Sequence[Motion], equations: Equations, pattern: np.ndarray, *, by_products: bool = False, every: int = 1
) -> list[Block]:
    """Do as `accumulate` does, and return no block where nothing is left."""
    total = sum(_seconds(motion) for motion in motions)
    kind = _Products if by_products else _Triangle
    stretches = [(motion, *stretch) for motion in motions for stretch in _stretches(motion, total, every)][::every]
    samples = sum(stop - start for _, start, stop in stretches)
    place = {motion.run: number for number, motion in enumerate(motions, start=1)}

    def asked(motion: Motion) -> Rows:
        share = 100 * motion.start // len((motion.whole or motion).time)
        tell_step(f"  reading run {place[motion.run]} of {len(motions)}" + (f", {share} % of it" if share else ""))
        return equations(motion)

    def grown(some: Sequence[tuple[Motion, int, int]]) -> list[Block]:
        return _grown(some, asked, lambda motion, start, stop: _Growing(motion, start, stop, pattern, kind))

    long = samples * (_BESIDE + int(pattern.sum())) >= _SHARED
    blocks = shared(grown, stretches) if long and can_copy() else grown(stretches)
    return [block for block in blocks if block.rows.any()]


def _grown(
    stretches: Sequence[tuple[Motion, int, int]], equations: Equations, begun: Callable[[Motion, int, int], _Growing]
) -> list[Block]:
    made: list[Future[list[Block]]] = []
    with ThreadPoolExecutor(1) as worker:  # filters and reduces while the next part's columns are computed
        adding: Future[None] | None = None
        for together in _joined(stretches):
            blocks = tuple(begun(*stretch) for stretch in together)
            for first, last, sample in _parts(blocks, equations):
                if adding:
                    adding.result()
                adding = worker.submit(_add, blocks, first, last, sample)
            made.append(worker.submit(_made, blocks))  # what grew can go then
        if adding:
            adding.result()
    return [block for future in made for block in future.result()]


def _joined(stretches: Sequence[tuple[Motion, int, int]]) -> Iterator[Sequence[tuple[Motion, int, int]]]:
    """Yield what of a motion follows on each other, without a gap."""
    cuts = [
        k
        for k, ((before, _, stop), (motion, start, _)) in enumerate(pairwise(stretches), start=1)
        if motion is not before or start != stop
    ]
    return (stretches[first:last] for first, last in pairwise([0, *cuts, len(stretches)]) if first < last)


def _made(growing: Sequence[_Growing]) -> list[Block]:
    return [part.block() for part in growing]


def _parts(growing: Sequence[_Growing], equations: Equations) -> Iterator[tuple[int, int, Rows]]:
    """Yield the equations of a motion's blocks from sample `first` to `last`, half a kernel more at either end."""
    motion, (taps, step) = growing[0].motion, thinning(growing[0].motion)
    half = len(taps) // 2
    size = step * max(1, min(_CHUNK // step, _ROWS))
    begin = half + step * max(0, -(-(growing[0].start - half) // step))  # the same samples stay, wherever one begins
    end = min(growing[-1].stop, len(motion.time) - half)
    for first in range(begin, end, size):
        last = min(first + size, end)
        yield first, last, equations(motion.part(first - half, last + half))


def _add(growing: Sequence[_Growing], first: int, last: int, sample: Rows) -> None:
    """Filter and decimate a part of a motion, and give each block its own rows."""
    motion = growing[0].motion
    thin = _Thin.of(sample, motion, growing[0].pattern)
    at = np.arange(first, last, thinning(motion)[1])
    for block in growing:
        begin, end = np.searchsorted(at, (block.start, block.stop))
        if begin < end:
            block.add(thin, slice(begin, end))


@dataclass(frozen=True)
class _Thin:
    """Each equation's rows (N, r_e + 1) of [columns | measurement], filtered and decimated.

    `mixed`: what makes the k_e columns of the r_e, part by part, by `Sparse.mixed`; ones (r,) where they are these.
    `keep`, `slow`: (N, g), which hold, and which are slow; `slow` is None where none are told apart.
    """

    rows: list[np.ndarray]
    mixed: list[list[np.ndarray]]
    keep: np.ndarray
    slow: np.ndarray | None

    @classmethod
    def of(cls, sample: Rows, motion: Motion, pattern: np.ndarray) -> _Thin:
        taps, step = thinning(motion)
        half = len(taps) // 2
        measured = sample.measured[half : len(sample.measured) - half : step] - decimate(sample.known, taps, step)
        keep, slow = np.ones(measured.shape, dtype=bool), None
        if sample.undecided is not None:
            keep = decimate(sample.undecided.astype(float), np.abs(taps), step) < _UNDECIDED
        if sample.slow is not None:
            slow = decimate(sample.slow.astype(float), np.abs(taps), step) >= _SLOW
        given = [sample.own(equation, used) for equation, used in enumerate(pattern)]
        thin = iter(_decimated([part for parts in given for part in parts], motion, len(measured)))
        rows = [np.column_stack([*islice(thin, len(parts)), own]) for parts, own in zip(given, measured.T, strict=True)]
        return cls(rows, [[_mixed(part) for part in parts] for parts in given], keep, slow)


def _decimated(parts: Columns, motion: Motion, count: int) -> list[np.ndarray]:
    """Return the `count` rows of each part's columns that filter and decimation leave, of narrow parts together."""
    taps, step = thinning(motion)
    bunches: dict[tuple[bool, int], list[int]] = {}
    for place, part in enumerate(parts):
        wide = not isinstance(part, Sparse) and part.shape[1] > _NARROW
        bunches.setdefault((isinstance(part, Sparse), place if wide else -1), []).append(place)
    thinned = [np.zeros((count, 0))] * len(parts)
    for (sparse, _), places in bunches.items():
        own = [part.values if isinstance(part, Sparse) else part for part in map(parts.__getitem__, places)]
        together = np.concatenate([some.T for some in own]).T if len(own) > 1 else own[0]
        thin = decimate_sparse(together, motion, count) if sparse else decimate(together, taps, step)
        for place, some in zip(
            places, np.split(thin, np.cumsum([some.shape[1] for some in own])[:-1], axis=1), strict=True
        ):
            thinned[place] = some
    return thinned


def _mixed(part: np.ndarray | Sparse) -> np.ndarray:
    """Return what makes a part's columns of those that are read: a matrix, or a line of ones where they are these."""
    if isinstance(part, Sparse):
        return np.ones(part.values.shape[1]) if part.mixed is None else part.mixed
    return np.ones(part.shape[1])


def _nothing_left(motions: Sequence[Motion]) -> InputError:
    longest = max(motions, key=_seconds)
    filtered = len(kernel(longest.rate, longest.cutoff)) / longest.rate if longest.cutoff else 0.0
    if _seconds(longest) <= filtered:
        return InputError(
            f'no run is longer than the filter, {filtered:.3g} s; the longest, "{longest.run}", has '
            f"{_seconds(longest):.3g} s: log longer runs"
        )
    return InputError(
        f'in no run does a joint move for as long as the filter, {filtered:.3g} s, in "{longest.run}" neither; '
        "log longer runs in motion"
    )


def _seconds(motion: Motion) -> float:
    return float(motion.time[-1] - motion.time[0])


def triangle(rows: np.ndarray) -> np.ndarray:
    """Return the triangular factor of rows (N, k): (min(N, k), k), with the same products of columns."""
    if not rows.size:
        return np.zeros((0, rows.shape[1]))
    # numpy's keeps other threads waiting
    factored, _, _, _ = scipy.linalg.lapack.dgeqrf(rows, lwork=_PANEL * rows.shape[1])
    return np.triu(factored[: rows.shape[1]])


class _Triangle:
    """Rows of k columns, reduced to a triangle as they come."""

    def __init__(self, columns: int):
        self._factor = np.zeros((0, columns))

    def add(self, rows: np.ndarray) -> None:
        self._factor = triangle(np.concatenate([self._factor, rows]) if len(self._factor) else rows)

    def factor(self) -> np.ndarray:
        return self._factor


class _Products:
    """Rows of k columns, kept while they are few, and then as the products of their columns."""

    def __init__(self, columns: int):
        self._few: np.ndarray | None = np.zeros((0, columns))
        self._products = np.zeros((0, 0))

    def add(self, rows: np.ndarray) -> None:
        if self._few is None:
            self._products += rows.T @ rows
            return
        self._few = np.concatenate([self._few, rows]) if len(self._few) else rows
        if len(self._few) > self._few.shape[1]:
            self._products, self._few = self._few.T @ self._few, None

    def factor(self) -> np.ndarray:
        return root(self._products) if self._few is None else self._few


def _of_all_columns(reduced: _Triangle | _Products, mixed: Sequence[np.ndarray]) -> np.ndarray:
    factor = reduced.factor()
    if all(part.ndim == 1 for part in mixed):
        return factor
    whole = scipy.linalg.block_diag(*(np.diag(part) if part.ndim == 1 else part for part in mixed), 1.0)
    return np.asarray(factor @ whole) if len(factor) else np.zeros((0, whole.shape[1]))


def root(products: np.ndarray) -> np.ndarray:
    """Return a factor (r, k), r <= k, of products of columns (k, k): its own are these."""
    size = np.sqrt(np.diag(products))
    size[size == 0] = 1.0
    scaled = products / size / size[:, None]
    factored, order, rank, _ = scipy.linalg.lapack.dpstrf(scaled, tol=_ROUNDING)
    factor = np.empty((rank, len(size)))
    factor[:, order - 1] = np.triu(factored)[:rank] * size[order - 1]
    return factor


def part_read(motions: Sequence[Motion]) -> int:
    """Return every which block tells about what all of them do: of a long log a few tell that."""
    return max(1, sum(len(motion.time) for motion in motions) // _ENOUGH)


def _stretches(motion: Motion, total: float, every: int) -> list[tuple[int, int]]:
    """Cut a motion into the sample ranges of its blocks, of equal length, `every` times as many."""
    seconds = _seconds(motion)
    shortest = _SHORTEST / motion.cutoff if motion.cutoff else 0.0
    count = max(1, int(min(np.ceil(_BLOCKS * every * seconds / total), seconds / shortest if shortest else np.inf)))
    edges = np.linspace(0, len(motion.time), count + 1).astype(int)
    return list(zip(edges[:-1].tolist(), edges[1:].tolist(), strict=True))


class _Growing:
    """A block, from sample `start` to `stop` (exclusive) of a motion, whose factors grow part by part."""

    def __init__(self, motion: Motion, start: int, stop: int, pattern: np.ndarray, kind: type[_Triangle | _Products]):
        self.motion, self.start, self.stop, self.pattern = motion, start, stop, pattern
        self._reduced, self._slow = ([kind(int(row.sum()) + 1) for row in pattern] for _ in range(2))
        self._mixed: list[list[np.ndarray]] = [[] for _ in pattern]
        self._rows, self._slow_rows = np.zeros((2, len(pattern)), dtype=int)
        self._told_apart = False

    def add(self, thin: _Thin, part: slice) -> None:
        """Take in the rows of a part that are the block's."""
        self._told_apart, self._mixed = thin.slow is not None, thin.mixed
        for equation, (reduced, apart) in enumerate(zip(self._reduced, self._slow, strict=True)):
            keep = thin.keep[part, equation]
            slow = np.zeros_like(keep) if thin.slow is None else thin.slow[part, equation] & keep
            self._rows[equation] += keep.sum()
            self._slow_rows[equation] += slow.sum()
            reduced.add(thin.rows[equation][part][keep & ~slow])
            if slow.any():
                apart.add(thin.rows[equation][part][slow])

    def block(self) -> Block:
        """Return what the block has become."""
        time = self.motion.time
        ends = float(time[self.start]), float(time[self.stop - 1])
        fast = tuple(map(_of_all_columns, self._reduced, self._mixed))
        if not self._told_apart:
            return Block(self.motion.run, *ends, self._rows, fast)
        slow = map(_of_all_columns, self._slow, self._mixed)
        both = tuple(np.concatenate(pair) for pair in zip(fast, slow, strict=True))
        begin = np.array([len(own) for own in fast])
        return Block(self.motion.run, *ends, self._rows, both, Slow(begin, self._slow_rows))

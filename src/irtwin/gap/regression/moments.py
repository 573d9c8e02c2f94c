"""Products of columns over groups of runs, held equation by equation and worked out where they are asked for.

A joint's torque knows only the bodies behind it and the effects at it: of all pairs of columns few share an equation.
Of a robot of 30 joints the products of all pairs would take twenty times what those of its equations do.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

_AT_ONCE = 4096  # pairs of columns whose rows are picked
_AS_ROWS = 4  # an equation with so many times more columns than rows is kept as these rows


@dataclass(frozen=True)
class Places:
    """Where what an equation holds stands among all columns and the measurement, the last, `size` in all.

    every (k,): places among all; `own` (k,): which of its u columns stands there. A column of observed runs stands
    there twice, as it is and as a change, and is held once.
    """

    every: np.ndarray
    own: np.ndarray
    size: int

    @property
    def wide(self) -> bool:
        """Whether the equation has most of all columns."""
        return 2 * len(self.every) >= self.size - 1

    @cached_property
    def spread(self) -> Places:
        """These, if they are few; else all places, with a column of zeros, the last, where the equation has none."""
        if not self.wide:
            return self
        own = np.full(self.size, self.own.max() + 1)
        own[self.every] = self.own
        return Places(np.arange(self.size), own, self.size)

    @cached_property
    def at(self) -> np.ndarray:
        """(D + 1,) which of its columns stands at each place, -1 for none."""
        at = np.full(self.size, -1)
        at[self.every] = self.own
        return at


def numbers(rows: int, columns: int) -> int:
    """Return how many numbers are held of an equation's rows in a group."""
    return columns * (rows if _few(rows, columns) else columns)


def _few(rows: int, columns: int) -> bool:
    return columns > _AS_ROWS * rows


@dataclass(frozen=True)
class Products:
    """What an equation's rows in a group say: the products of its columns (u, u), or the rows (r, u) themselves."""

    places: Places
    held: np.ndarray
    as_rows: bool

    @classmethod
    def of(cls, places: Places, rows: np.ndarray, scale: np.ndarray) -> Products:
        """Take rows (r, u) whose columns are in units of `scale` (u,)."""
        missing = (0, int(places.spread.own.max()) + 1 - len(scale))
        if _few(*rows.shape):
            return cls(places.spread, np.pad(rows * scale, ((0, 0), missing)), True)
        products = rows.T @ rows
        products *= scale[:, None] * scale
        return cls(places.spread, np.pad(products, (missing, missing)), False)

    @classmethod
    def summed(cls, several: Sequence[Products]) -> Products:
        """Return the products over several groups' rows of an equation."""
        first = several[0]
        if len(several) == 1:
            return first
        if all(own.as_rows for own in several):
            rows = np.concatenate([own.held for own in several])
            if _few(*rows.shape):
                return cls(first.places, rows, True)
            return cls(first.places, rows.T @ rows, False)
        held = np.zeros_like(next(own.held for own in several if not own.as_rows))
        for own in several:
            held += own.held.T @ own.held if own.as_rows else own.held
        return cls(first.places, held, False)

    @cached_property
    def diagonal(self) -> np.ndarray:
        """(u,) the squares of what is held."""
        return np.asarray((self.held**2).sum(axis=0) if self.as_rows else np.diag(self.held))

    @property
    def largest(self) -> float:
        """The most squares of a column, the measurement's left out."""
        return float(np.delete(self.diagonal, self.places.own[-1]).max(initial=0.0))

    def among(self, rows: np.ndarray, columns: np.ndarray) -> np.ndarray:
        """Return the products (r, c) of some held columns with others."""
        if self.as_rows:
            return np.asarray(self.held[:, rows].T @ self.held[:, columns])
        if len(rows) > len(columns):  # whole rows are picked first: of what is symmetric the fewer
            return self.held.take(columns, axis=0).take(rows, axis=1).T
        return self.held.take(rows, axis=0).take(columns, axis=1)

    def pairs(self, first: np.ndarray, second: np.ndarray) -> np.ndarray:
        """Return the product (N,) of each held column with another."""
        if not self.as_rows:
            return np.asarray(self.held[first, second])
        pieces = range(0, len(first), _AT_ONCE)
        rows = ((self.held[:, side[k : k + _AT_ONCE]] for side in (first, second)) for k in pieces)
        return np.concatenate([np.zeros(0), *(np.einsum("rn,rn->n", *both) for both in rows)])

    def squares(self, weights: np.ndarray) -> float:
        """Return the squares of the sum of all columns, each times its weight (D + 1,)."""
        own = np.bincount(self.places.own, weights[self.places.every], self.held.shape[1])
        some = np.flatnonzero(own)  # of many columns few are fitted
        if self.as_rows:
            left = self.held[:, some] @ own[some]
            return float(left @ left)
        return float(own[some] @ self.among(some, some) @ own[some])


class Moments:
    """Products of D columns and, last, the measurement, `size` = D + 1 in all: equations', each times its weight."""

    def __init__(self, weighed: Sequence[tuple[Products, float]]):
        """Take products with their weights; what is wide is added first."""
        self.size = weighed[0][0].places.size
        self.weighed = sorted(weighed, key=lambda pair: not pair[0].places.wide)

    def times(self, weight: float) -> Moments:
        """Return these, each row counted so much."""
        return Moments([(products, weight * own) for products, own in self.weighed])

    def among(self, rows: np.ndarray, columns: np.ndarray) -> np.ndarray:
        """Return the products (r, c) of some columns with others: of mostly more columns, each one's side by side."""
        sums = np.zeros((len(columns), len(rows)))
        for products, weight in self.weighed:
            down, across = products.places.at[columns], products.places.at[rows]
            here, there = np.flatnonzero(down >= 0), np.flatnonzero(across >= 0)
            own = products.among(down[here], across[there])
            own *= weight
            if own.shape == sums.shape:
                sums += own
            else:
                part = sums[here]  # whole rows are picked faster than numbers one by one
                part[:, there] += own
                sums[here] = part
        return sums.T

    def of(self, rows: np.ndarray) -> np.ndarray:
        """Return the products (r, D + 1) of some columns with all."""
        return self.among(rows, np.arange(self.size))


class Whole(Moments):
    """Those of few columns, all of them worked out once: whoever asks for some of them often has them picked."""

    def __init__(self, moments: Moments):
        """Take the products of all columns."""
        super().__init__(moments.weighed)
        self._products = moments.of(np.arange(self.size))

    def among(self, rows: np.ndarray, columns: np.ndarray) -> np.ndarray:
        """Pick products (r, c) of some columns with others."""
        return self._products.take(rows, axis=0).take(columns, axis=1)


class Summed(Moments):
    """Those of several groups; what was asked last is kept, as it is asked again beside each group left out."""

    def __init__(self, parts: Sequence[Moments]):
        """Take those of each."""
        super().__init__([own for part in parts for own in part.weighed])
        self._among: tuple[tuple[bytes, bytes], np.ndarray] | None = None

    def among(self, rows: np.ndarray, columns: np.ndarray) -> np.ndarray:
        """Add up those of all groups."""
        asked = rows.tobytes(), columns.tobytes()
        if self._among is None or self._among[0] != asked:
            self._among = asked, super().among(rows, columns)
        return self._among[1]

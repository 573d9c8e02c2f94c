"""Products of columns over groups of runs, held equation by equation and worked out where they are asked for.

A joint's torque knows only the bodies behind it and the effects at it: of all pairs of columns few share an equation.
Of a robot of 30 joints the products of all pairs would take twenty times what those of its equations do.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property, reduce

import numpy as np

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
        found = np.full(self.size, -1)
        found[self.every] = self.own
        return found


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
        return self.held.take(rows, axis=0).take(columns, axis=1)

    def blocks(self, columns: np.ndarray) -> np.ndarray:
        """Return the products (V, k, k) among each row of held columns (V, k)."""
        if self.as_rows:
            picked = np.moveaxis(self.held[:, columns], 0, 1)
            return np.asarray(picked.swapaxes(1, 2) @ picked)
        return np.asarray(self.held[columns[:, :, None], columns[:, None, :]])

    def squares(self, weights: np.ndarray) -> float:
        """Return the squares of the sum of all columns, each times its weight (D + 1,)."""
        own = np.bincount(self.places.own, weights[self.places.every], self.held.shape[1])
        left = self.held @ own
        return float(left @ left if self.as_rows else own @ left)


class Moments(ABC):
    """Products of D columns and, last, the measurement, `size` = D + 1 in all."""

    size: int

    @abstractmethod
    def among(self, rows: np.ndarray, columns: np.ndarray) -> np.ndarray:
        """Return the products (r, c) of some columns with others."""

    @abstractmethod
    def blocks(self, columns: np.ndarray) -> np.ndarray:
        """Return the products (V, k, k) among each row of columns (V, k)."""

    def of(self, rows: np.ndarray) -> np.ndarray:
        """Return the products (r, D + 1) of some columns with all."""
        return self.among(rows, np.arange(self.size))

    @property
    def whole(self) -> np.ndarray:
        """All products, (D + 1, D + 1): of many columns more than fits into memory."""
        return self.of(np.arange(self.size))

    def squares(self, columns: Sequence[int]) -> np.ndarray:
        """Return the squares (k,) of some columns."""
        return self.blocks(np.array(columns)[:, None])[:, 0, 0]

    def __sub__(self, other: Moments) -> Moments:
        return _Less(self, other)


class GroupMoments(Moments):
    """Those of one group: of its equations' products, each times the equation's weight (g,)."""

    def __init__(self, products: Sequence[Products], weights: np.ndarray):
        """Take both; what is wide is added first."""
        self.size = products[0].places.size
        order = sorted(range(len(products)), key=lambda equation: not products[equation].places.wide)
        self._weighed = [(products[equation], weights[equation]) for equation in order]
        self._known: dict[bytes, np.ndarray] = {}  # blocks by their columns: a search asks for the same again and again

    def among(self, rows: np.ndarray, columns: np.ndarray) -> np.ndarray:
        """Add up the equations that have any of both: of mostly more columns than rows, each column's side by side."""
        found = np.zeros((len(columns), len(rows)))
        for products, weight in self._weighed:
            down, across = products.places.at[columns], products.places.at[rows]
            here, there = np.flatnonzero(down >= 0), np.flatnonzero(across >= 0)
            own = products.among(down[here], across[there])
            own *= weight
            if own.shape == found.shape:
                found += own
            else:
                part = found[here]  # whole rows are picked faster than numbers one by one
                part[:, there] += own
                found[here] = part
        return found.T

    def blocks(self, columns: np.ndarray) -> np.ndarray:
        """Return each block as it was worked out when it was first asked for."""
        asked = [row.tobytes() for row in columns]
        new = [k for k, row in enumerate(asked) if row not in self._known]
        if new:
            self._known.update(zip((asked[k] for k in new), self._worked_out(columns[new]), strict=True))
        return np.array([self._known[row] for row in asked])

    def _worked_out(self, columns: np.ndarray) -> np.ndarray:
        """Add up the equations: of most blocks they have one column alone, the measurement, and so its square."""
        found = np.zeros((*columns.shape, columns.shape[1]))
        for products, weight in self._weighed:
            places = products.places.at[columns]
            inside = places >= 0
            count = inside.sum(axis=1)
            block, k = np.nonzero(inside & (count == 1)[:, None])
            found[block, k, k] += products.diagonal[places[block, k]] * weight
            several = np.flatnonzero(count > 1)
            if len(several):
                both = inside[several, :, None] & inside[several, None, :]
                found[several] += np.where(both, products.blocks(places[several]) * weight, 0.0)
        return found


class Summed(Moments):
    """Those of several groups; what was asked last is kept, as it is asked again beside each group left out."""

    def __init__(self, parts: Sequence[Moments]):
        """Take those of each."""
        self.size = parts[0].size
        self._parts = parts
        self._among: tuple[tuple[bytes, bytes], np.ndarray] | None = None
        self._blocks: dict[tuple[int, bytes], np.ndarray] = {}

    def among(self, rows: np.ndarray, columns: np.ndarray) -> np.ndarray:
        """Add up those of all groups."""
        asked = rows.tobytes(), columns.tobytes()
        if self._among is None or self._among[0] != asked:
            self._among = asked, _sum(part.among(rows, columns) for part in self._parts)
        return self._among[1]

    def blocks(self, columns: np.ndarray) -> np.ndarray:
        """Add up those of all groups."""
        asked = columns.shape[1], columns.tobytes()
        if asked not in self._blocks:
            self._blocks[asked] = _sum(part.blocks(columns) for part in self._parts)
        return self._blocks[asked]


class _Less(Moments):
    """Those of some groups without others."""

    def __init__(self, whole: Moments, part: Moments):
        self.size = whole.size
        self._whole, self._part = whole, part

    def among(self, rows: np.ndarray, columns: np.ndarray) -> np.ndarray:
        return np.asarray(self._whole.among(rows, columns) - self._part.among(rows, columns))

    def blocks(self, columns: np.ndarray) -> np.ndarray:
        return np.asarray(self._whole.blocks(columns) - self._part.blocks(columns))


class Shifted(Moments):
    """Those of a group, less (D + 1,) products with the measurement; its own square stays."""

    def __init__(self, whole: Moments, products: np.ndarray):
        """Take both."""
        self.size = whole.size
        self._whole, self._less = whole, np.append(products[:-1], 0.0)

    def among(self, rows: np.ndarray, columns: np.ndarray) -> np.ndarray:
        """Take off what is with the measurement, which is the last."""
        found = self._whole.among(rows, columns).copy()  # what is kept elsewhere stays
        found[:, columns == self.size - 1] -= self._less[rows, None]
        found[rows == self.size - 1] -= self._less[columns]
        return found

    def blocks(self, columns: np.ndarray) -> np.ndarray:
        """Take off what is with the measurement, which is the last."""
        last, less = columns == self.size - 1, self._less[columns]
        both = less[:, :, None] * last[:, None, :] + last[:, :, None] * less[:, None, :]
        return np.asarray(self._whole.blocks(columns) - both)


def _sum(arrays: Iterable[np.ndarray]) -> np.ndarray:
    return np.asarray(reduce(np.add, arrays))

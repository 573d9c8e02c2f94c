"""What a fit of the twin's terms leaves of candidate columns: their products, part by part, by one noise.

A search asks again and again what variants explain beside this structure or that. The twin's terms are in all of them:
they are taken off once. What was found is a few columns, and is taken off what is left then.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from irtwin.gap.regression.cholesky import factored, solved
from irtwin.gap.regression.hypotheses import Variant
from irtwin.gap.regression.normal_equations import MOST_HELD, System
from irtwin.identification.progress import track


class Projection:
    """Products of what the twin's terms leave of variants' columns; fitted to all parts (P,), weighted by `noise` (g,).

    A columns are asked for, the measurement is the last. Raises InputError where they would take too much memory.
    """

    def __init__(self, system: System, noise: np.ndarray, variants: Sequence[Variant]):
        """Take the twin's terms off the columns of variants."""
        self.system, self._noise = system, noise
        self._moments = system.moments(noise)
        self._asked = np.unique([*(k for one in variants for k in one.columns), system.size])
        base, every = np.arange(system.base), track(self._moments, "parts of what the twin imitates")
        self._all, inner = np.zeros((len(self._asked), system.base)), []
        keeps = len(self._moments) * self._all.size <= MOST_HELD
        self._kept: list[np.ndarray] = []  # of each part, what is asked for beside the twin's terms (A, K)
        for own in every:
            products = own.among(base, np.append(base, self._asked))
            inner.append(products[:, : system.base])
            across = np.ascontiguousarray(products[:, system.base :].T)
            self._all += across
            self._kept += [across] if keeps else []
        self._inner = np.array(inner)  # (P, K, K)
        self._factor = factored(self._inner.sum(axis=0), system.prior())
        self._imitated = np.ascontiguousarray(solved(self._factor, self._all.T).T)  # (A, K)
        self._rows: dict[int, tuple[np.ndarray, np.ndarray]] = {}  # of a column: with all (A,), in each part (A, P)
        self.products: list[tuple[dict[tuple[int, ...], int], np.ndarray, np.ndarray]] = []
        self._squares: dict[tuple[int, ...], tuple[float, float]] = {}  # of variants: what is left, and all
        self._project(variants)

    def _project(self, variants: Sequence[Variant]) -> None:
        """Work out the products among each variant's columns, those of one number at once."""
        sizes: dict[int, list[tuple[int, ...]]] = {}
        for one in variants:
            sizes.setdefault(len(one.columns), []).append(one.columns)
        if not sizes:
            return
        each = [self.at([[*columns, self.system.size] for columns in own]) for own in sizes.values()]
        pairs = [np.broadcast_arrays(columns[:, :-1, None], columns[:, None, :]) for columns in each]
        flat = [self._asked[np.concatenate([one[side].ravel() for one in pairs])] for side in (0, 1)]
        products = self.system.products_of(flat[0], flat[1], self._noise)
        ends = np.cumsum([one.size for one, _ in pairs])[:-1]
        by_part = [
            products_of.reshape(-1, *one.shape)
            for products_of, (one, _) in zip(np.split(products, ends, axis=1), pairs, strict=True)
        ]
        before = [left.sum(axis=0) for left in by_part]
        imitated = [self._imitated[columns] for columns in each]
        for part, inner in enumerate(self._inner):
            half = self._across(part) - self._imitated @ inner / 2  # what is left is symmetric in it
            for columns, own, left in zip(each, imitated, by_part, strict=True):
                other = half[columns]
                left[part] -= _pairs(own[:, :-1], other) + _pairs(other[:, :-1], own)
        for known, columns, own, whole, left in zip(sizes.values(), each, imitated, before, by_part, strict=True):
            after = whole - _pairs(own[:, :-1], self._all[columns])
            squares = zip(*(np.trace(one, axis1=1, axis2=2) for one in (after, whole)), strict=True)
            self._squares |= zip(known, squares, strict=True)
            self.products.append((dict(zip(known, range(len(known)), strict=True)), after, left))

    def _across(self, part: int, at: np.ndarray | slice = slice(None)) -> np.ndarray:
        """Return the products (n, K) of what is asked for, at some places, with the twin's terms in a part."""
        if self._kept:
            return self._kept[part][at]
        return self._moments[part].among(np.arange(self.system.base), self._asked[at]).T

    def visible(self, variants: Sequence[Variant]) -> np.ndarray:
        """Return (V, 2) what variants add, with coefficients as large as expected, beyond what the twin imitates.

        As a mean square in units of the noise, and as the part of its columns' squares.
        """
        rows = max(float(self.system.rows.sum(axis=0).max(initial=0.0)), 1.0)
        left, every = np.array([self._squares[one.columns] for one in variants]).reshape(-1, 2).T
        return np.column_stack([left / rows, left / np.maximum(every, 1e-300)])

    def at(self, columns: Sequence[int] | Sequence[Sequence[int]]) -> np.ndarray:
        """Return the places of columns among those that are asked for."""
        return np.searchsorted(self._asked, np.array(columns, dtype=int))

    def prepare(self, chosen: Sequence[int]) -> None:
        """Work out what is asked of columns that are to be `beside`: of many at once it takes little longer."""
        new = [k for k in chosen if k not in self._rows]
        if not new:
            return
        at = self.at(new)
        own = np.array([moments.among(np.array(new), self._asked) for moments in self._moments])
        whole = own.sum(axis=0) - self._imitated[at] @ self._all.T
        for part, (products, inner) in enumerate(zip(own, self._inner, strict=True)):
            across = self._across(part)
            left = across[at] - self._imitated[at] @ inner
            products -= self._imitated[at] @ across.T + left @ self._imitated.T
        self._rows |= {k: (whole[place], np.ascontiguousarray(own[:, place].T)) for place, k in enumerate(new)}

    def beside(self, chosen: Sequence[int]) -> Beside:
        """Take `chosen` columns off as well, and what noise of positions seems to explain off the measurement."""
        self.prepare(chosen)
        at, rows = self.at(chosen), [self._rows[k] for k in chosen]
        whole = np.array([of_all for of_all, _ in rows]).reshape(-1, len(self._asked))
        parts = tuple(each for _, each in rows)
        measured = np.array([each[-1] for each in parts]).reshape(-1, len(self._moments)).T
        factor = factored(whole[:, at]) if len(at) else None
        imitated = whole if factor is None else solved(factor, whole)  # (c, A)
        shaken = self._shaken(at, imitated[:, -1])
        if shaken is not None:
            of_all, of_parts = self.less_noise(at, shaken)
            whole[:, -1] += of_all
            measured = measured + of_parts
            imitated = whole if factor is None else solved(factor, whole)
        return Beside(self, at, whole, parts, measured, imitated, shaken)

    def _shaken(self, at: np.ndarray, imitated: np.ndarray) -> Shaken | None:
        """Return what noise of positions seems to explain beside columns at places `at` (c,); None where it is unknown.

        The twin's terms and these columns leave their own noise times their coefficients, `imitated` (c,) of columns.
        """
        coefficients = np.zeros(self.system.size + 1)
        coefficients[self._asked[at]] = -imitated
        coefficients[: self.system.base] = imitated @ self._imitated[at] - self._imitated[-1]
        coefficients[-1] = 1.0
        less = self.system.shaken_products(coefficients, self._noise)
        return None if less is None else Shaken(less, solved(self._factor, less[:, : self.system.base].sum(axis=0)))

    def less_noise(self, at: np.ndarray, shaken: Shaken) -> tuple[np.ndarray, np.ndarray]:
        """Return what the products of columns at places `at` (n,) with the measurement gain without noise of positions.

        Over all parts (n,) and in each (P, n).
        """
        less, change = shaken
        of_base, of_own = less[:, : self.system.base] - self._inner @ change, less[:, self._asked[at]]
        across = [self._across(part, at) @ change for part in range(len(self._inner))]
        parts = np.array(across) - of_own + of_base @ self._imitated[at].T
        return self._all[at] @ change - of_own.sum(axis=0), parts


class Shaken(NamedTuple):
    """What noise of positions seems to explain: its products `less` (P, D + 1) with all columns.

    `change` (K,): by how much less the twin's terms imitate of the measurement without it.
    """

    less: np.ndarray
    change: np.ndarray


@dataclass(frozen=True)
class Beside:
    """What the twin's terms and c columns, at places `at`, leave.

    whole, imitated (c, A): products of these columns with all, and how they imitate all; `parts`: of each column, its
    products in each part (A, P); measured (P, c): those with the measurement.
    """

    projection: Projection
    at: np.ndarray
    whole: np.ndarray
    parts: tuple[np.ndarray, ...]
    measured: np.ndarray
    imitated: np.ndarray
    shaken: Shaken | None

    def batches(self, variants: Sequence[Variant]) -> Iterator[tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]]:
        """Yield of the variants of one number of columns, k, which they are (V,), the places of these columns (V, k).

        And the products among these and with the measurement: over all parts beside these columns (V, k, k + 1), and in
        each part beside the twin's terms alone (P, V, k, k + 1).
        """
        for known, of_all, of_parts in self.projection.products:
            some = [(place, known[one.columns]) for place, one in enumerate(variants) if one.columns in known]
            if not some:
                continue
            which, own = np.array(some).T
            columns = self.projection.at([variants[place].columns for place in which])
            whole, parts = of_all[own], of_parts[:, own]
            if self.shaken is not None:
                less, less_in_parts = self.projection.less_noise(columns.ravel(), self.shaken)
                whole[..., -1] += less.reshape(columns.shape)
                parts[..., -1] += less_in_parts.reshape(-1, *columns.shape)
            beside = np.column_stack([columns, np.full(len(columns), -1)])
            whole -= np.einsum("cvi,cvj->vij", self.imitated[:, columns], self.whole[:, beside])
            yield which, columns, whole, parts

    def in_parts(self, columns: np.ndarray, products: np.ndarray, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the squares (P, V) of columns (V, k) times values (V, k), and their products with the measurement.

        In each part beside these columns, of the `products` (P, V, k, k + 1) that `batches` gives.
        """
        weights = np.einsum("cvi,vi->cv", self.imitated[:, columns], values)
        squares = np.einsum("pvij,vi,vj->pv", products[..., :-1], values, values)
        measured = np.einsum("pvi,vi->pv", products[..., -1], values) - self.measured @ weights
        for own, weight, imitated in zip(self.parts, weights, self.imitated[:, -1], strict=True):
            across = np.einsum("vip,vi->pv", own.take(columns, axis=0), values)
            inner = own.take(self.at, axis=0).T @ weights
            squares -= weight * (2 * across - inner)
            measured -= imitated * (across - inner)
        return squares, measured


def _pairs(left: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Return the products (V, i, j) of each variant's rows, (V, i, K) and (V, j, K)."""
    return np.asarray(np.einsum("vik,vjk->vij", left, right))

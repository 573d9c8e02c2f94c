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

    A columns are asked for, the measurement is the last. In R of the parts there are rows; T of these tell of columns:
    what changed is zero where nothing is observed. Raises InputError where they would take too much memory.
    """

    def __init__(self, system: System, noise: np.ndarray, variants: Sequence[Variant]):
        """Take the twin's terms off the columns of variants."""
        self.system, self._noise = system, noise
        self._asked = np.unique([*(k for variant in variants for k in variant.columns), system.size])
        self.parts = np.array([system.rows[group, kind].any() for kind, group in system.parts])  # (P,) with rows
        observed = system.group_observed[[group for _, group in system.parts]][self.parts]
        self._telling = np.flatnonzero(observed | (self._asked[0] < system.changed))  # of those with rows
        every = [own for own, some in zip(system.moments(noise), self.parts, strict=True) if some]
        self._moments = [every[part] for part in self._telling]
        base, size = np.arange(system.base), len(self._telling) * len(self._asked) * system.base
        self._kept = np.empty((len(self._telling), len(self._asked), system.base)) if size <= MOST_HELD else None
        self._all, inner, measured = np.zeros((len(self._asked), system.base)), [], []
        places = {int(part): place for place, part in enumerate(self._telling)}
        for part, own in enumerate(track(every, "parts of what the twin imitates")):
            place = places.get(part)
            products = own.among(base, np.append(base, system.size if place is None else self._asked))
            inner.append(products[:, : system.base])
            measured.append(products[:, -1])
            self._all[-1 if place is None else 0 :] += products[:, system.base :].T
            if place is not None and self._kept is not None:
                self._kept[place] = products[:, system.base :].T
        self._inner = np.array(inner)  # (R, K, K)
        self._measured = np.array(measured)  # (R, K)
        self._factor = factored(self._inner.sum(axis=0), system.prior())
        self.imitated = np.ascontiguousarray(solved(self._factor, self._all.T).T)  # (A, K)
        self._rows: dict[int, tuple[np.ndarray, np.ndarray]] = {}  # of a column: with all (A,), in each part (A, R)
        self.products: dict[int, tuple[dict[tuple[int, ...], int], np.ndarray, np.ndarray]] = {}  # by their number
        self._squares: dict[tuple[int, ...], tuple[float, float]] = {}  # of variants: what is left, and all
        self._project(variants)

    def _project(self, variants: Sequence[Variant]) -> None:
        """Work out the products among each variant's columns, those of one number at once."""
        sizes: dict[int, list[tuple[int, ...]]] = {}
        for variant in variants:
            sizes.setdefault(len(variant.columns), []).append(variant.columns)
        if not sizes:
            return
        by_size = [self.at(own) for own in sizes.values()]
        beside = [np.column_stack([columns, np.full(len(columns), -1)]) for columns in by_size]
        pairs = [
            np.broadcast_arrays(columns[..., None], own[:, None]) for columns, own in zip(by_size, beside, strict=True)
        ]
        flat = [self._asked[np.concatenate([pair[side].ravel() for pair in pairs])] for side in (0, 1)]
        products = self.system.products_of(flat[0], flat[1], self._noise)[self.parts]
        ends = np.cumsum([first.size for first, _ in pairs])[:-1]
        by_part = [
            products_of.reshape(-1, *first.shape)
            for products_of, (first, _) in zip(np.split(products, ends, axis=1), pairs, strict=True)
        ]
        whole = [left.sum(axis=0) for left in by_part]
        imitated = [self.imitated[columns] for columns in by_size]
        places = {int(part): place for place, part in enumerate(self._telling)}
        for part, inner in enumerate(self._inner):
            half = self.imitated @ (inner / -2)  # what is left is symmetric in it
            if part in places:
                half += self._across(places[part])
            else:
                half[-1] += self._measured[part]
            measured = half @ self.imitated[-1] + self.imitated @ half[-1]
            for columns, own, left in zip(by_size, imitated, by_part, strict=True):
                among = _pairs(own, half[columns])
                left[part, ..., :-1] -= among + among.swapaxes(1, 2)
                left[part, ..., -1] -= measured[columns]
        for known, them, own, all_of, left in zip(sizes.values(), beside, imitated, whole, by_part, strict=True):
            after = all_of - _pairs(own, self._all[them])
            squares = zip(*(np.trace(matrices, axis1=1, axis2=2) for matrices in (after, all_of)), strict=True)
            self._squares |= zip(known, squares, strict=True)
            self.products[them.shape[1] - 1] = dict(zip(known, range(len(known)), strict=True)), after, left

    def _across(self, place: int, at: np.ndarray | slice = slice(None)) -> np.ndarray:
        """Return the products (n, K) of what is asked for, at some places, with the twin's terms in a part that tells.

        `place`: which of those.
        """
        if self._kept is not None:
            return np.asarray(self._kept[place][at])
        return self._moments[place].among(np.arange(self.system.base), self._asked[at]).T

    def _along(self, change: np.ndarray, at: np.ndarray) -> np.ndarray:
        """Return (T, n) the products of columns, at some places, with what (K,) makes of the twin's terms."""
        if self._kept is not None and 2 * len(at) > len(self._asked):  # fewer are picked one by one
            tell, asked, terms = self._kept.shape
            return np.asarray((self._kept.reshape(tell * asked, terms) @ change).reshape(tell, asked)[:, at])
        rows = [self._across(place, at) @ change for place in range(len(self._telling))]
        return np.array(rows).reshape(len(rows), len(at))

    def visible(self, variants: Sequence[Variant]) -> np.ndarray:
        """Return (V, 2) what variants add, with coefficients as large as expected, beyond what the twin imitates.

        As a mean square in units of the noise, and as the part of its columns' squares.
        """
        rows = max(float(self.system.rows.sum(axis=0).max(initial=0.0)), 1.0)
        left, every = np.array([self._squares[variant.columns] for variant in variants]).reshape(-1, 2).T
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
        mine = self.imitated[at]
        left, told = -(mine @ self._inner), np.zeros((len(new), len(self._asked)))  # (R, n, K)
        for place, part in enumerate(self._telling):
            left[part] += self._across(place, at)
        own = left @ -self.imitated.T
        own[..., -1] -= self._measured @ mine.T
        for place, part in enumerate(self._telling):
            products = self._moments[place].among(np.array(new), self._asked)
            told += products
            products[:, :-1] -= mine @ self._across(place, slice(-1)).T
            own[part] += products
        whole = told - mine @ self._all.T
        self._rows |= {k: (whole[place], np.ascontiguousarray(own[:, place].T)) for place, k in enumerate(new)}

    def beside(self, chosen: Sequence[int]) -> Beside:
        """Take `chosen` columns off as well, and what noise of positions seems to explain off the measurement."""
        self.prepare(chosen)
        at, rows = self.at(chosen), [self._rows[k] for k in chosen]
        whole = np.array([of_all for of_all, _ in rows]).reshape(-1, len(self._asked))
        parts = tuple(by_part for _, by_part in rows)
        measured = np.array([part[-1] for part in parts]).reshape(-1, len(self._inner)).T
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
        coefficients[: self.system.base] = imitated @ self.imitated[at] - self.imitated[-1]
        coefficients[-1] = 1.0
        less = self.system.shaken_products(coefficients, self._noise)
        if less is None:
            return None
        return Shaken(less[self.parts], solved(self._factor, less[:, : self.system.base].sum(axis=0)))

    def less_noise(self, at: np.ndarray, shaken: Shaken) -> tuple[np.ndarray, np.ndarray]:
        """Return what the products of columns at places `at` (n,) with the measurement gain without noise of positions.

        Over all parts (n,) and in each that has rows (R, n).
        """
        less, change = shaken
        of_base, of_own = less[:, : self.system.base] - self._inner @ change, less[:, self._asked[at]]
        parts = of_base @ self.imitated[at].T - of_own
        parts[self._telling] += self._along(change, at)
        return self._all[at] @ change - of_own.sum(axis=0), parts


class Shaken(NamedTuple):
    """What noise of positions seems to explain: its products `less` (R, D + 1) with all columns.

    `change` (K,): by how much less the twin's terms imitate of the measurement without it.
    """

    less: np.ndarray
    change: np.ndarray


@dataclass(frozen=True)
class Beside:
    """What the twin's terms and c columns, at places `at`, leave.

    whole, imitated (c, A): products of these columns with all, and how they imitate all; `parts`: of each column, its
    products in each part that has rows (A, R); measured (R, c): those with the measurement.
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
        each part that has rows beside the twin's terms alone (R, V, k, k + 1).
        """
        places: dict[int, list[int]] = {}
        for place, variant in enumerate(variants):
            places.setdefault(len(variant.columns), []).append(place)
        if not places:
            return
        by_size = [[variants[place].columns for place in which] for which in places.values()]
        at = [self.projection.at(columns) for columns in by_size]
        less = self._less_noise(at)
        for which, columns, own_at, gained in zip(places.values(), by_size, at, less, strict=True):
            known, of_all, of_parts = self.projection.products[len(columns[0])]
            own = [known[some] for some in columns]
            whole, parts = of_all[own], of_parts[:, own]
            whole[..., -1] += gained[0]
            parts[..., -1] += gained[1:]
            beside = np.column_stack([own_at, np.full(len(own_at), -1)])
            whole -= np.einsum("cvi,cvj->vij", self.imitated[:, own_at], self.whole[:, beside])
            yield np.array(which), own_at, whole, parts

    def _less_noise(self, at: Sequence[np.ndarray]) -> list[np.ndarray]:
        """Return what the products of columns (V, k) each with the measurement gain without noise of positions.

        Over all parts, then in each that has rows, (1 + R, V, k).
        """
        if self.shaken is None:
            return [np.zeros((2, *places.shape)) for places in at]
        gained = np.vstack(self.projection.less_noise(np.concatenate([places.ravel() for places in at]), self.shaken))
        ends = np.cumsum([places.size for places in at])[:-1]
        return [own.reshape(-1, *places.shape) for own, places in zip(np.split(gained, ends, axis=1), at, strict=True)]

    def nearer(self, columns: np.ndarray, values: np.ndarray) -> np.ndarray:
        """Return (V,) by how much nearer the twin is to what is known of it with columns times values (V, k).

        In squares of the prior's rows of the effects whose `prior_tells`.
        """
        of_base, chosen = self.projection.imitated, self.projection.imitated[self.at]
        less = np.einsum("vik,vi->vk", of_base[columns], values)
        less -= np.einsum("cvi,vi->vc", self.imitated[:, columns], values) @ chosen
        before = of_base[-1] - self.imitated[:, -1] @ chosen
        if self.shaken is not None:
            before = before - self.shaken.change
        before, less = (self.projection.system.told_by_prior(off) for off in (before, less))
        return np.asarray(((2 * before - less) * less).sum(axis=1))

    def in_parts(self, columns: np.ndarray, products: np.ndarray, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the squares (P, V) of columns (V, k) times values (V, k), and their products with the measurement.

        In each part beside these columns, of the `products` (R, V, k, k + 1) that `batches` gives.
        """
        weights = np.einsum("cvi,vi->vc", self.imitated[:, columns], values)
        squares = np.einsum("pvij,vi,vj->vp", products[..., :-1], values, values)
        measured = np.einsum("pvi,vi->vp", products[..., -1], values) - weights @ self.measured.T
        for own, weight, imitated in zip(self.parts, weights.T, self.imitated[:, -1], strict=True):
            across = np.einsum("vip,vi->vp", own.take(columns, axis=0), values)
            left = across - weights @ own.take(self.at, axis=0)
            measured -= imitated * left
            left += across
            left *= weight[:, None]
            squares -= left
        among_all = np.zeros((2, len(self.projection.parts), len(columns)))
        among_all[:, self.projection.parts] = squares.T, measured.T
        return among_all[0], among_all[1]


def _pairs(left: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Return the products (V, i, j) of each variant's rows, (V, i, K) and (V, j, K)."""
    return np.asarray(np.einsum("vik,vjk->vij", left, right))

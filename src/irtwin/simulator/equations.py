"""A misfit near some numbers as least squares: the equations of a step from there, the step, and how sure it is."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np


@dataclass(frozen=True)
class Equations:
    """Normal equations of a step of k numbers, by their `rows`: `normal` (..., k, k), `right` (..., k).

    What is before these axes are joints, or stretches and joints, one beside the other.
    """

    rows: Sequence[Any]
    normal: np.ndarray
    right: np.ndarray

    @classmethod
    def of(cls, rows: Sequence[Any], columns: np.ndarray, left: np.ndarray, weight: np.ndarray) -> Equations:
        """Return those of each joint (n, ...): of what is left (N, c, n), a step takes `columns` (k, N, c, n).

        `weight` (c, n): how much a square counts.
        """
        stacked = np.concatenate([columns, left[None]]) * np.sqrt(weight)
        of_joints = np.moveaxis(stacked, -1, 0).reshape(left.shape[-1], len(stacked), -1)
        products = of_joints[:, :-1] @ of_joints.swapaxes(1, 2)
        return cls(rows, products[..., :-1], products[..., -1])

    @classmethod
    def beside(cls, many: Sequence[Equations]) -> Equations:
        """Return some of the same rows, one beside the other."""
        return cls(
            many[0].rows,
            np.array([equations.normal for equations in many]),
            np.array([equations.right for equations in many]),
        )

    def together(self, axis: int = 0) -> Equations:
        """Return the sum over an axis: of numbers that all along it share."""
        return Equations(self.rows, self.normal.sum(axis=axis), self.right.sum(axis=axis))

    def some(self, rows: Sequence[Any]) -> Equations:
        """Return those of some of the rows, in their order; the others stay as they are."""
        at = [list(self.rows).index(row) for row in rows]
        return Equations(rows, self.normal[..., at, :][..., at], self.right[..., at])

    def marginal(self, rows: Sequence[Any]) -> Equations:
        """Return those of some of the rows, the others fitted beside."""
        at = [list(self.rows).index(row) for row in rows]
        others = [place for place, row in enumerate(self.rows) if row not in rows]
        cross = self.normal[np.ix_(others, at)]
        eliminated = np.linalg.solve(self.normal[np.ix_(others, others)], cross)
        normal = self.normal[np.ix_(at, at)] - cross.T @ eliminated
        return Equations(rows, normal, self.right[..., at] - self.right[..., others] @ eliminated)

    def likely(self, off: np.ndarray, deviation: np.ndarray) -> Equations:
        """Return those with what is likely before: numbers are `off` (k,), in deviations (k,) of the chart."""
        return Equations(self.rows, self.normal + np.diag(deviation**-2.0), self.right - off / deviation)

    def damped(self, damping: float) -> Equations:
        """Return those of a step that is held back, by a share of what each number is held by."""
        return Equations(self.rows, self.normal + damping * np.diag(np.diag(self.normal)), self.right)

    def step(self, farthest: np.ndarray | float = np.inf) -> np.ndarray:
        """Return the step (k,), or the part of it that goes no farther than (k,)."""
        step = np.linalg.solve(self.normal, self.right)
        return np.asarray(step / max(1.0, np.abs(step / farthest).max(initial=0.0)))

    @property
    def variance(self) -> np.ndarray:
        """How sure numbers are, (k,), by what is left of them."""
        return np.diag(np.linalg.inv(self.normal))

    def disagreement(self, rights: np.ndarray, count: int) -> np.ndarray:
        """Return the variance (k,) of `count` numbers, by how right sides of stretches (p, k) differ, too."""
        inverse = np.linalg.inv(self.normal)
        between = inverse @ (rights.T @ rights) @ inverse * len(rights) / max(len(rights) - count, 1)
        return np.asarray(np.maximum(np.diag(between), np.diag(inverse)))

    def known(self, deviation: np.ndarray) -> float:
        """Return how much better than before numbers are known: half a log determinant, in deviations (k,)."""
        return float(np.linalg.slogdet(self.normal * deviation * deviation[:, None])[1] / 2)

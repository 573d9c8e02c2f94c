"""How far one set of bodies, and friction at each joint, explain all torques of a robot together.

The same bodies load several joints, so the torques of one joint say what those of another must be. What is compared is
always held out: a stretch of time is predicted by what was fitted to the others, so that freedom alone gains nothing.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from irtwin.check.rigid_body import RigidBodyRows
from irtwin.check.robust_fit import BLOCKS

_LEAST = 0.01  # of a torque's deviation: less is left in simulated logs alone, and means nothing
_TURNS = 4  # of the weights: by then they change by less than 1 %
_OWN = 1e-3  # of a column's squares that nothing else makes up: with less, it is rounding that is fitted
_PRIOR = 1e-8  # of a column's squares: keeps what no motion excites at zero


@dataclass(frozen=True)
class Held:
    """Logarithms of the share of each torque's deviation that is left in each stretch of time, (BLOCKS, n)."""

    left: np.ndarray

    def gain(self, other: Held) -> float:
        """Return the logarithm of the product of all joints' residuals here over the other's."""
        return float(np.mean(np.sum(self.left - other.left, axis=1)))

    def t(self, other: Held) -> float:
        """Return the gain by its standard deviation (Q. H. Vuong, Econometrica 57, 1989, over stretches of time)."""
        gains = np.sum(self.left - other.left, axis=1)
        deviation = float(np.std(gains, ddof=1)) / np.sqrt(len(gains))
        return float(np.mean(gains)) / deviation if deviation > 0 else 0.0


@dataclass(frozen=True)
class WholeBody:
    """Columns (N, n, P) that explain the torques of rows, torques by P numbers that all joints share."""

    columns: np.ndarray
    used: np.ndarray  # of all columns of the rows: those that are not zero throughout

    @classmethod
    def of(cls, rows: RigidBodyRows) -> WholeBody:
        """Return bodies and friction of the rows' motion."""
        columns = rows.columns()
        used = np.any(columns, axis=(0, 1))
        return cls(columns[:, :, used], used)

    @cached_property
    def products(self) -> np.ndarray:
        """The columns' products with each other, (n, P, P)."""
        return _squares(self.columns)

    @cached_property
    def products_of_blocks(self) -> np.ndarray:
        """The same in each stretch of time, (BLOCKS, n, P, P)."""
        return np.array([_squares(part) for part in _blocks(self.columns)])

    def fit(self, torque: np.ndarray) -> Fitted:
        """Fit torques (N, n), each joint weighted by what it leaves."""
        against, variance = _against(self.columns, torque), _variance(torque)
        weights = 1 / variance
        for _ in range(_TURNS):
            coefficients = _solved(np.tensordot(weights, self.products, 1), weights @ against)
            left = np.mean((torque - self.columns @ coefficients) ** 2, axis=0)
            weights = 1 / np.maximum(left, _LEAST**2 * variance)
        return Fitted(self, torque, coefficients, weights)


@dataclass(frozen=True)
class Fitted:
    """Numbers (P,) fitted to torques (N, n), and the weight of each joint (n,), the inverse of what it leaves."""

    body: WholeBody
    torque: np.ndarray
    coefficients: np.ndarray
    weights: np.ndarray

    @cached_property
    def _products(self) -> np.ndarray:
        return np.asarray(np.tensordot(self.weights, self.body.products, 1))

    @property
    def left(self) -> float:
        """The logarithm of the product of the shares that are left of all torques' deviations."""
        return float(-0.5 * np.sum(np.log(self.weights * _variance(self.torque))))

    def held_out(self) -> Held:
        """Return what is left of the torques in each stretch of time, predicted by the others."""
        parts = list(zip(_blocks(self.body.columns), _blocks(self.torque), strict=True))
        products = np.tensordot(self.weights, self.body.products_of_blocks, (0, 1))
        against = np.array([self.weights @ _against(columns, values) for columns, values in parts])
        coefficients = _solved(products.sum(axis=0) - products, against.sum(axis=0) - against)
        left = [
            np.mean((values - columns @ of) ** 2, axis=0)
            for (columns, values), of in zip(parts, coefficients, strict=True)
        ]
        return Held(np.log(np.maximum(np.array(left) / _variance(self.torque), _LEAST**2)) / 2)

    @cached_property
    def explained(self) -> np.ndarray:
        """The torques as the numbers predict them, (N, n)."""
        return np.asarray(self.body.columns @ self.coefficients)

    @cached_property
    def of_bodies(self) -> np.ndarray:
        """What of that the bodies are, (N, n)."""
        bodies = int(self.body.used[: 10 * self.torque.shape[1]].sum())
        return np.asarray(self.body.columns[:, :, :bodies] @ self.coefficients[:bodies])

    def parts(self, columns: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return what bodies, and what rotors and friction, add to torques (N, n), by columns (N, n, 14 n)."""
        numbers = np.zeros(len(self.body.used))
        numbers[self.body.used] = self.coefficients
        bodies = 10 * self.torque.shape[1]
        return columns[:, :, :bodies] @ numbers[:bodies], columns[:, :, bodies:] @ numbers[bodies:]

    def estimate(self, column: np.ndarray, beside: tuple[np.ndarray, ...] = ()) -> tuple[float, float]:
        """Return the number of one more column (N, n) and its standard deviation; infinite where others make it up.

        Bodies, friction, and the columns `beside` (each (N, n)) are free. The deviation is the sandwich estimate over
        stretches of time (Liang and Zeger, Biometrika 73, 1986, eq. 2.4).
        """
        root = np.sqrt(self.weights)[:, None]
        columns = np.ascontiguousarray(self.body.columns * root).reshape(-1, self.body.columns.shape[2])
        others = np.column_stack([np.ravel(extra * root.T) for extra in beside] or [np.empty((len(columns), 0))])
        wanted, torque = (np.ravel(values * root.T) for values in (column, self.torque))
        size, across = float(wanted @ wanted), columns.T @ others
        products = np.block([[self._products, across], [across.T, others.T @ others]])
        weighted = np.concatenate([columns, others], axis=1)
        part, explained = _solved(products, np.stack([wanted @ weighted, torque @ weighted]))
        own = wanted - weighted @ part
        free = float(own @ own)
        if free <= _OWN * size:
            return 0.0, np.inf
        residual = torque - weighted @ explained
        number = float(own @ residual) / free
        scores = (own * (residual - number * own)).reshape(self.torque.shape).sum(axis=1)
        sums = np.array([part.sum() for part in _blocks(scores)])
        return number, float(np.sqrt(np.sum(sums**2) * BLOCKS / (BLOCKS - 1))) / free


def _blocks(values: np.ndarray) -> list[np.ndarray]:
    return np.array_split(values, BLOCKS)


def _squares(columns: np.ndarray) -> np.ndarray:
    by_joint = columns.transpose(1, 2, 0)
    return np.asarray(by_joint @ by_joint.transpose(0, 2, 1))


def _against(columns: np.ndarray, torque: np.ndarray) -> np.ndarray:
    """Return the products of columns (N, n, P) with torques (N, n), (n, P)."""
    return np.asarray((columns.transpose(1, 2, 0) @ torque.T[:, :, None])[:, :, 0])


def _variance(torque: np.ndarray) -> np.ndarray:
    variance = np.var(torque, axis=0)
    return np.where(variance > 0, variance, 1.0)


def _solved(products: np.ndarray, against: np.ndarray) -> np.ndarray:
    """Return the solutions (..., P) of normal equations (..., P, P), columns scaled to one size."""
    sizes = np.sqrt(np.diagonal(products, axis1=-2, axis2=-1))
    sizes = np.where(sizes > 0, sizes, 1.0)
    scaled = products / (sizes[..., :, None] * sizes[..., None, :]) + _PRIOR * np.eye(products.shape[-1])
    return np.asarray(np.linalg.solve(scaled, (against / sizes)[..., None])[..., 0] / sizes)

"""How well a motion's base regressor tells the base parameters, by one of three criteria, and which way that rises."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from irtwin.effects.catalogue import EXCITED
from irtwin.effects.stack import Stack
from irtwin.identification.base_parameters import base_parameters, condition_number
from irtwin.robot.body_regressor import body_regressor, regressor_slope
from irtwin.robot.description import Robot
from irtwin.signals.motion import Motion

Criterion = Callable[[np.ndarray], tuple[float, np.ndarray]]
"""From a base regressor (N n, p) to a cost and its slope over each number, the same shape."""

_ALL = 0.05  # share of what all parameters count beside an energy: what it does not ask for is still told
_SHARPNESS = 4  # of the smooth maximum and minimum of the eigenvalues


MotionGradient = tuple[np.ndarray, np.ndarray, np.ndarray]
"""Derivatives of a number with respect to q, dq and ddq of each sample of a motion, (N, n) each."""


class BaseRegressor:
    """The columns of the effects that torque shows on every robot, and of these the base columns.

    Rows and columns are those of `effects.stack`, here with their derivatives: 10 n of the rigid bodies, then n each.
    criterion: what a motion is to be good for; None: the condition number. tasks: motions whose energy is to be told.
    """

    def __init__(self, robot: Robot, criterion: Criterion | None = None, tasks: Sequence[Motion] = ()) -> None:
        self._model = robot.model
        self._n = len(robot.joints)
        self._base = base_parameters(Stack(robot, EXCITED))
        self.columns = self._base.independent
        self._criterion = energy_variance([self.energy_slope(task) for task in tasks]) if tasks else criterion

    def matrix(self, q: np.ndarray, dq: np.ndarray, ddq: np.ndarray) -> np.ndarray:
        """Return the base regressor W of a motion, (N n, p): joint torque = W times base parameters."""
        return self._all(q, dq, ddq, np.sign(dq))[:, self.columns]

    def condition_number(self, q: np.ndarray, dq: np.ndarray, ddq: np.ndarray) -> float:
        """Return the condition number of W with each column divided by its length; inf where a column is empty."""
        return condition_number(self._all(q, dq, ddq, np.sign(dq)), self._base)

    def energy_slope(self, motion: Motion) -> np.ndarray:
        """Return the slope of a motion's mechanical energy, J, over each base parameter, (p,)."""
        work = np.gradient(motion.time)[:, None] * motion.dq
        return np.asarray(work.ravel() @ self.matrix(motion.q, motion.dq, motion.ddq))

    def rank(self, q: np.ndarray, dq: np.ndarray, ddq: np.ndarray) -> float:
        """Return how bad a motion is by the criterion, of the regressor as it is: less is better."""
        if self._criterion is None:
            return self.condition_number(q, dq, ddq)
        return self._criterion(self.matrix(q, dq, ddq))[0]

    def cost(self, q: np.ndarray, dq: np.ndarray, ddq: np.ndarray, slow: np.ndarray) -> tuple[float, MotionGradient]:
        """Return a smooth cost and its gradient: the criterion's; of None the log condition number of the scaled W less
        the mean log column length.

        The condition number alone is blind to size: a joint that creeps has columns as fine as one that swings. The
        column lengths are what D-optimality adds to it. `slow`: (n,) rad/s, where the sign of speed is rounded.
        """
        n, samples = self._n, len(q)
        sign = np.tanh(dq / slow)
        everything = self._all(q, dq, ddq, sign)
        value, slope = (self._criterion or _smooth_cost)(everything[:, self.columns])
        weight = np.zeros_like(everything)
        weight[:, self.columns] = slope
        weight = weight.reshape(samples, n, -1)
        rigid, joint = weight[:, :, : 10 * n], np.arange(n)
        rotor, viscous, coulomb = (weight[:, joint, (10 + k) * n + joint] for k in range(3))
        by_q, by_dq, by_ddq = regressor_slope(self._model, q, dq, ddq, rigid)
        return value, (by_q, by_dq + viscous + coulomb * (1 - sign**2) / slow, by_ddq + rotor)

    def _all(self, q: np.ndarray, dq: np.ndarray, ddq: np.ndarray, sign: np.ndarray) -> np.ndarray:
        each_joint = [_diagonals(ddq), _diagonals(dq), _diagonals(sign), _diagonals(np.ones_like(dq))]
        stack = np.concatenate([body_regressor(self._model, q, dq, ddq), *each_joint], axis=2)
        return stack.reshape(-1, stack.shape[2])


def determinant(matrix: np.ndarray) -> tuple[float, np.ndarray]:
    """Return the mean log standard deviation of base parameters in units of noise, and its slope: D-optimality."""
    covariance = _covariance(matrix)
    value = np.linalg.slogdet(covariance)[1] / (2 * len(covariance))
    return float(value), -matrix @ covariance / len(covariance)


def energy_variance(slopes: Sequence[np.ndarray]) -> Criterion:
    """Return the criterion of the log deviation of energies whose slopes over the base parameters these are, (p,) each.

    A small share of `determinant` beside it keeps what these energies do not ask for.
    """
    asked = np.transpose(slopes) @ np.array(slopes)

    def criterion(matrix: np.ndarray) -> tuple[float, np.ndarray]:
        covariance = _covariance(matrix)
        variance = float(np.sum(covariance * asked))
        whole, slope = determinant(matrix)
        value = 0.5 * np.log(variance) + _ALL * whole
        return float(value), -matrix @ covariance @ asked @ covariance / variance + _ALL * slope

    return criterion


def _covariance(matrix: np.ndarray) -> np.ndarray:
    """Return the (p, p) covariance of base parameters by equations of unit noise; columns are scaled on the way."""
    length = np.maximum(np.linalg.norm(matrix, axis=0), np.finfo(float).tiny)
    eigenvalues, vectors = _axes(matrix / length)
    return np.asarray((vectors / eigenvalues) @ vectors.T / np.outer(length, length))


def _axes(scaled: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the eigenvalues, (p,), none below rounding, and the eigenvectors of the products of columns."""
    eigenvalues, vectors = np.linalg.eigh(scaled.T @ scaled)
    return np.maximum(eigenvalues, np.finfo(float).eps * eigenvalues[-1]), vectors


def _diagonals(values: np.ndarray) -> np.ndarray:
    """Turn (N, n) into N diagonal matrices (N, n, n)."""
    return values[:, :, None] * np.eye(values.shape[1])


def _smooth_cost(matrix: np.ndarray) -> tuple[float, np.ndarray]:
    """Return log condition number of the scaled `matrix` less mean log column length, and its slope, same shape."""
    length = np.linalg.norm(matrix, axis=0)
    scaled = matrix / length
    eigenvalues, vectors = _axes(scaled)
    large, small = (eigenvalues / eigenvalues[-1]) ** _SHARPNESS, (eigenvalues[0] / eigenvalues) ** _SHARPNESS
    smooth = (np.log(large.sum()) + np.log(small.sum())) / (2 * _SHARPNESS)
    value = smooth + 0.5 * np.log(eigenvalues[-1] / eigenvalues[0]) - float(np.mean(np.log(length)))
    along = (large / large.sum() - small / small.sum()) / (2 * eigenvalues)
    slope = 2 * scaled @ (vectors * along) @ vectors.T
    slope -= scaled * (scaled * slope).sum(axis=0)  # lengths are divided out
    return float(value), (slope - scaled / len(length)) / length

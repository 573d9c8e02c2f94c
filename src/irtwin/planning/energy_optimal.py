"""The motion that costs the least energy in a given time: path and time law changed together, or the law alone."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import product
from typing import TYPE_CHECKING

import numpy as np
import scipy

from irtwin.planning.timing import MotionLimits, States, Timed, Torque, along, shares
from irtwin.robot.collision import CollisionModel
from irtwin.signals.motion import trapezoid

if TYPE_CHECKING:
    from scipy.interpolate import BSpline

Power = Callable[[np.ndarray, np.ndarray, np.ndarray, np.ndarray], np.ndarray]
"""From time (N,), q, dq, ddq (N, n) to electrical power (N,), W."""

_DEGREE = 5
_FREE, _FREE_OF_LAW = 7, 9  # points of the spline between start and goal: of each joint, of a time law
_SAMPLES, _SAMPLES_OF_LAW = 48, 60  # of a motion while it is sought
_DENSE = 1500  # at the end
_POSES = 20  # at which the distance to everything is held
_STIFFNESS = (30.0, 1000.0)  # of the walls, as a share of the energy for a limit passed by all of it
_ITERATIONS = 25  # for each stiffness
_STEP = 1e-4  # rad: of differences
_SHARE = 0.97  # of the limits that the search keeps to at its samples
_NEAR = 0.05  # m: nearer pairs push


@dataclass(frozen=True)
class Movement:
    """From rest to rest in `seconds`; `motion`: from times (N,), s, to q, dq, ddq and jerk, (N, n) each."""

    seconds: float
    motion: Callable[[np.ndarray], States]


def cheapest(
    given: Timed,
    seconds: float,
    limits: MotionLimits,
    torque: Torque,
    power: Power,
    collisions: CollisionModel,
    *,
    on_path: bool = False,
) -> Movement | Timed:
    """Return the motion between the ends of `given` that takes least energy in `seconds`, of all that keep the limits.

    `on_path`: of all along its path that go forward all the way. Sought from the given motion, slowed, by quasi-Newton
    steps (L-BFGS) over the points of a quintic spline, with walls that grow stiffer. What is found counts only if it
    keeps every limit and touches nothing; else the given motion, slowed, is the answer.
    """
    slowed = given.slower(seconds)
    best: Movement | Timed = slowed
    least = energy(best, power)
    search: _Search | _OnPath
    search = _OnPath(slowed, limits, torque, power) if on_path else _Search(slowed, limits, torque, power, collisions)
    points = search.spline.nearest
    for stiffness in _STIFFNESS:
        points = search.improve(points, stiffness * least)
        motion = search.motion(points)
        cost = energy(motion, power)
        forward = isinstance(search, _Search) or search.goes_forward(points)
        if cost < least and forward and keeps(motion, limits, torque, collisions):
            best, least = motion, cost
    return best


def keeps(motion: Movement | Timed, limits: MotionLimits, torque: Torque, collisions: CollisionModel) -> bool:
    """Return whether a motion keeps all limits and touches nothing."""
    states = motion.motion(np.linspace(0, motion.seconds, _DENSE))
    within = all(np.abs(share).max() <= 1 for share in shares(states, limits, torque).values())
    return within and collisions.is_clear(states[0])


def energy(motion: Movement | Timed, power: Power) -> float:
    """Return the energy that a motion takes, J."""
    time = np.linspace(0, motion.seconds, _DENSE)
    return float(np.trapezoid(power(time, *motion.motion(time)[:3]), time))


class _Spline:
    """A quintic spline over time, of free points (k, ...) between fixed ends at rest, near `values` (N, ...)."""

    def __init__(self, time: np.ndarray, free: int, values: np.ndarray) -> None:
        count = free + 6  # three equal points at each end are rest: no speed, no acceleration
        inner = np.linspace(0, time[-1], count - _DEGREE + 1)
        self._knots = np.concatenate([np.zeros(_DEGREE), inner, np.full(_DEGREE, time[-1])])
        basis = scipy.interpolate.BSpline(self._knots, np.eye(count), _DEGREE)
        self.bases = [basis(time, order) for order in range(4)]
        self._ends = values[[0, -1]]
        place = self.bases[0]
        known = np.multiply.outer(place[:, :3].sum(axis=1), values[0])
        known = known + np.multiply.outer(place[:, -3:].sum(axis=1), values[-1])
        self.nearest = np.linalg.lstsq(place[:, 3:-3], values - known, rcond=None)[0]

    def through(self, points: np.ndarray) -> BSpline:
        """Return the spline of free points."""
        return scipy.interpolate.BSpline(self._knots, self._all(points), _DEGREE)

    def states(self, points: np.ndarray) -> list[np.ndarray]:
        """Return its values and their first three derivatives at the times, (N, ...) each."""
        return [basis @ self._all(points) for basis in self.bases]

    def _all(self, points: np.ndarray) -> np.ndarray:
        return np.concatenate([self._ends[[0, 0, 0]], points, self._ends[[1, 1, 1]]])


def _derivatives(spline: BSpline, time: np.ndarray) -> States:
    """Return the values of a spline and their first three derivatives, (N, ...) each, at `time`: (N,) s."""
    place, speed, acceleration, jerk = (spline(np.clip(time, spline.t[0], spline.t[-1]), order) for order in range(4))
    return place, speed, acceleration, jerk


class _OnPath:
    """Costs of the free points, (k,), of a time law between rest at 0 and rest at 1."""

    def __init__(self, given: Timed, limits: MotionLimits, torque: Torque, power: Power) -> None:
        self._path, self._limits, self._torque, self._power = given.path, limits, torque, power
        self._time = np.linspace(0, given.seconds, _SAMPLES_OF_LAW)
        place = given.place(self._time)[0]
        place[[0, -1]] = 0.0, 1.0
        self.spline = _Spline(self._time, _FREE_OF_LAW, place)

    def motion(self, points: np.ndarray) -> Movement:
        """Return the motion of free points (k,)."""
        law = self.spline.through(points)
        return Movement(float(self._time[-1]), lambda time: along(self._path, *_derivatives(law, time)))

    def goes_forward(self, points: np.ndarray) -> bool:
        """Whether a motion never goes back on its path."""
        dense = np.linspace(0, self._time[-1], 20 * _SAMPLES_OF_LAW)
        return bool((np.diff(self.spline.through(points)(dense)) > -1e-12).all())

    def improve(self, points: np.ndarray, stiffness: float) -> np.ndarray:
        """Return points of less cost, with walls of a stiffness, J."""
        options = {"maxiter": _ITERATIONS, "eps": 1e-5}
        return np.asarray(
            scipy.optimize.minimize(self._cost, points, args=(stiffness,), method="L-BFGS-B", options=options).x
        )

    def _cost(self, points: np.ndarray, stiffness: float) -> float:
        s, ds, dds, ddds = self.spline.states(points)
        states = along(self._path, s, ds, dds, ddds)
        taken = float(np.trapezoid(self._power(self._time, *states[:3]), self._time))
        used = shares(states, self._limits, self._torque).values()
        passed = [np.maximum(np.abs(share) - _SHARE, 0) for share in used]
        backward = np.minimum(ds, 0) * self._time[-1]
        return taken + stiffness * float(sum((over**2).sum() for over in (*passed, backward))) / len(self._time)


class _Search:
    """Costs of the free points, (k, n), of a spline between fixed ends at rest."""

    def __init__(
        self, given: Timed, limits: MotionLimits, torque: Torque, power: Power, collisions: CollisionModel
    ) -> None:
        self._limits, self._torque, self._power, self._collisions = limits, torque, power, collisions
        self._seconds = given.seconds
        self._time = np.linspace(0, given.seconds, _SAMPLES)
        self.spline = _Spline(self._time, _FREE, given.motion(self._time)[0])

    def motion(self, points: np.ndarray) -> Movement:
        """Return the motion of free points (k, n)."""
        spline = self.spline.through(points)
        return Movement(self._seconds, lambda time: _derivatives(spline, time))

    def improve(self, points: np.ndarray, stiffness: float) -> np.ndarray:
        """Return points of less cost, with walls of a stiffness, J."""
        optimum = scipy.optimize.minimize(
            lambda x: self._cost(x.reshape(points.shape), stiffness),
            points.ravel(),
            jac=True,
            method="L-BFGS-B",
            options={"maxiter": _ITERATIONS},
        )
        return np.asarray(optimum.x.reshape(points.shape))

    def _cost(self, points: np.ndarray, stiffness: float) -> tuple[float, np.ndarray]:
        states = self.spline.states(points)
        value, slopes = self._energy(states[:3])
        slopes.append(np.zeros_like(states[3]))
        for wall, gradients in (self._walls(states), self._distances(states[0])):
            value += stiffness * wall
            for order, gradient in enumerate(gradients):
                slopes[order] = slopes[order] + stiffness * gradient
        by_points = [basis[:, 3:-3].T @ slope for basis, slope in zip(self.spline.bases, slopes, strict=True)]
        return value, np.sum(by_points, axis=0).ravel()

    def _energy(self, states: list[np.ndarray]) -> tuple[float, list[np.ndarray]]:
        """Return the energy, J, and its slope over each sample's q, dq, ddq, from differences sample by sample."""
        weights = trapezoid(self._time)
        power = self._power(self._time, *states)
        slopes = [np.empty_like(state) for state in states]
        for order, joint, change in self._changes(lambda *moved: self._power(self._time, *moved), states):
            slopes[order][:, joint] = weights * change
        return float(weights @ power), slopes

    def _changes(
        self, of: Callable[..., np.ndarray], states: Sequence[np.ndarray]
    ) -> Iterator[tuple[int, int, np.ndarray]]:
        """Yield, by order and joint, how fast what is `of` q, dq and ddq, (N, ...), changes with each at a sample."""
        own = of(*states)
        for order, joint in product(range(3), range(states[0].shape[1])):
            moved, step = [state.copy() for state in states], _STEP / self._seconds**order
            moved[order][:, joint] += step
            yield order, joint, (of(*moved) - own) / step

    def _walls(self, states: list[np.ndarray]) -> tuple[float, list[np.ndarray]]:
        """Return the mean square by which limits are passed, and its slope over each sample's q, dq, ddq, jerk."""
        limits = self._limits
        value, slopes = 0.0, []
        taken = shares((states[0], states[1], states[2], states[3]), limits, self._torque).values()
        for share, greatest in zip(taken, (*limits.ranges, limits.jerk, limits.torque), strict=True):
            beyond = np.sign(share) * np.maximum(np.abs(share) - _SHARE, 0)
            value += float((beyond**2).sum()) / len(share)
            slopes.append(2 * beyond / greatest / len(share))
        *slopes, by_torque = slopes
        if by_torque.any():
            for order, joint, change in self._changes(self._torque, states[:3]):
                slopes[order][:, joint] += (by_torque * change).sum(axis=1)
        return value, slopes

    def _distances(self, q: np.ndarray) -> tuple[float, list[np.ndarray]]:
        """Return the mean square by which pairs are nearer than they may, over _NEAR, and its slope over q."""
        value, slope = 0.0, np.zeros_like(q)
        rows = np.unique(np.linspace(1, len(q) - 2, _POSES).round().astype(int))
        least = min(_NEAR, self._collisions.clearance(q[0]), self._collisions.clearance(q[-1]))
        for row in rows:
            clearance, change = self._collisions.clearance_slope(q[row])
            lack = (least - clearance) / _NEAR
            if lack > 0:
                value += lack**2 / len(rows)
                slope[row] -= 2 * lack * change / _NEAR / len(rows)
        return value, [slope]

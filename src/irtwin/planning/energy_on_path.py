"""The motion along a given path that costs the least energy in a given time: the time law alone changes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import BSpline
from scipy.optimize import minimize

from irtwin.planning.energy_optimal import Power, energy, keeps
from irtwin.planning.timing import MotionLimits, Timed, Torque, along, shares
from irtwin.robot.collision import CollisionModel

_DEGREE = 5
_FREE = 9  # points of the time law between start and goal
_SAMPLES = 60  # of a motion while it is sought
_STIFFNESS = (30.0, 1000.0)  # of the walls, as a share of the energy for a limit passed by all of it
_ITERATIONS = 25  # for each stiffness
_SHARE = 0.97  # of the limits that the search keeps to at its samples


@dataclass(frozen=True)
class PathMotion:
    """A path, (n,) joints over the place on it from 0 to 1, and that place as a spline over time, from rest to rest."""

    path: BSpline
    law: BSpline
    seconds: float

    def motion(self, time: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Return q, dq, ddq and jerk, (N, n) each, at `time`: (N,) s."""
        s, ds, dds, ddds = (self.law(np.clip(time, 0, self.seconds), order) for order in range(4))
        return along(self.path, s, ds, dds, ddds)


def cheapest_on_path(
    given: Timed, seconds: float, limits: MotionLimits, torque: Torque, power: Power, collisions: CollisionModel
) -> PathMotion | Timed:
    """Return the motion along the path of `given` that takes least energy in `seconds`, of all that keep the limits.

    Sought from the given motion, slowed, by quasi-Newton steps (L-BFGS) over the points of a quintic spline, with walls
    that grow stiffer. It goes forward all the way. What is found counts only if it keeps every limit; else the given
    motion, slowed, is the answer.
    """
    slowed = given.slower(seconds)
    best: PathMotion | Timed = slowed
    least = energy(best, power)
    search = _Search(slowed, limits, torque, power)
    points = search.start
    for stiffness in _STIFFNESS:
        points = search.improve(points, stiffness * least)
        found = search.motion(points)
        cost = energy(found, power)
        if cost < least and search.goes_forward(found) and keeps(found, limits, torque, collisions):
            best, least = found, cost
    return best


class _Search:
    """Costs of the free points, (k,), of a time law between rest at 0 and rest at 1."""

    def __init__(self, given: Timed, limits: MotionLimits, torque: Torque, power: Power) -> None:
        self._path, self._limits, self._torque, self._power = given.path, limits, torque, power
        self._seconds = given.seconds
        self._time = np.linspace(0, given.seconds, _SAMPLES)
        count = _FREE + 6  # three equal points at each end are rest: no speed, no acceleration
        inner = np.linspace(0, given.seconds, count - _DEGREE + 1)
        self._knots = np.concatenate([np.zeros(_DEGREE), inner, np.full(_DEGREE, given.seconds)])
        basis = BSpline(self._knots, np.eye(count), _DEGREE)
        self._bases = [basis(self._time, order) for order in range(4)]
        place = given.place(self._time)[0]
        self.start = np.linalg.lstsq(self._bases[0][:, 3:-3], place - self._bases[0][:, -3:].sum(axis=1), rcond=None)[0]

    def motion(self, points: np.ndarray) -> PathMotion:
        """Return the motion of free points (k,)."""
        return PathMotion(self._path, BSpline(self._knots, self._all(points), _DEGREE), self._seconds)

    def goes_forward(self, found: PathMotion) -> bool:
        """Whether a motion never goes back on its path."""
        return bool((np.diff(found.law(np.linspace(0, self._seconds, 20 * _SAMPLES))) > -1e-12).all())

    def improve(self, points: np.ndarray, stiffness: float) -> np.ndarray:
        """Return points of less cost, with walls of a stiffness, J."""
        found = minimize(
            self._cost, points, args=(stiffness,), method="L-BFGS-B", options={"maxiter": _ITERATIONS, "eps": 1e-5}
        )
        return np.asarray(found.x)

    def _all(self, points: np.ndarray) -> np.ndarray:
        return np.concatenate([np.zeros(3), points, np.ones(3)])

    def _cost(self, points: np.ndarray, stiffness: float) -> float:
        s, ds, dds, ddds = (basis @ self._all(points) for basis in self._bases)
        states = along(self._path, s, ds, dds, ddds)
        taken = float(np.trapezoid(self._power(self._time, *states[:3]), self._time))
        passed = [np.maximum(share - _SHARE, 0) for share in shares(states, self._limits, self._torque).values()]
        backward = np.minimum(ds, 0) * self._seconds
        return taken + stiffness * float(sum((each**2).sum() for each in (*passed, backward))) / _SAMPLES

"""Exciting motions: those that let identification tell the base parameters of a robot apart."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from time import monotonic

import numpy as np
import scipy

from irtwin.errors import InputError
from irtwin.identification.base_condition import BaseRegressor, Criterion
from irtwin.identification.fourier_series import FourierSeries, RestSeries, between_samples
from irtwin.identification.motion_limits import Box, JointLimits, Walls
from irtwin.identification.own_body import OwnBody
from irtwin.identification.two_processes import one_blas_thread
from irtwin.robot.description import Robot
from irtwin.signals.motion import Motion

Progress = Callable[[int, float, float], None]
"""Called with the iteration, the best condition number so far and the seconds since the start."""

_LONGEST_PERIOD = 20.0  # s: longer motions repeat one of at most this
_BARRIERS = (0.3, 0.1, 0.03, 0.01, 0.003)  # weights of the walls, falling: an interior-point method
_RESERVE = 0.99  # share of the joint limits that is used: controllers round, too
_STARTS = 10
_POSTURES = 300
_MOST_WORK = 3e8  # products of regressors' numbers, an iteration asked for: tens of times what seven joints take
_PER_POINT = 3e-5  # s, of each joint at each point of the grid in an iteration, and
_PER_WORK = 4e-10  # s, of each product: chains of 7, 12 and 30 joints took 17, 34 and 91 s, with others beside them
_MOST = 100_000_000  # numbers that a motion is worked out from: 3600 s at 500 Hz of six joints, 0.8 GB
Cost = Callable[[np.ndarray], tuple[float, np.ndarray]]

_SUFFICIENT = 1e-4  # Armijo's share of the promised decrease
_SHORTEN = 0.4
_SHORTEST = 1e-8


@dataclass(frozen=True)
class Excitation:
    """An exciting motion of n joints, `seconds` long, and what is known of it.

    condition_number: of the scaled base regressor at the samples of `rate`, Hz. limit_margin: least distance to a
    joint limit at any time, as a share of it. clearance: lower bound at any time on the distance to the floor and the
    box, m. interrupted: the search was broken off; bounded: it ended at its most work, as that of many joints does.
    Either way this is the best found until then.
    """

    joint_names: tuple[str, ...]
    series: FourierSeries
    seconds: float
    rate: float
    condition_number: float
    limit_margin: float
    clearance: float
    interrupted: bool = False
    bounded: bool = False

    def sample(self, rate: float | None = None) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Return time (N,) s and q, dq, ddq (N, n) in SI from rest to rest, evenly at (nearly) `rate` Hz."""
        time = np.linspace(0.0, self.seconds, 1 + max(1, round(self.seconds * (rate or self.rate))))
        q, dq, ddq = (np.round(values, 12) + 0.0 for values in self.series.motion(time))  # rest is 0, not -1e-16
        return time, q, dq, ddq


def expected_seconds(joints: int, seconds: float, iterations: int = 200) -> float:
    """Return about how many seconds of processor `excite` takes for so many joints, at its most.

    An iteration takes as long as its joints are many, until the search reaches its most work; its starts take as long
    as some more.
    """
    grid = len(_rest_of(seconds).grid)
    work = _work(grid, joints)
    count = min(iterations, iterations * _MOST_WORK / work) + 2 * min(_STARTS, max(iterations, 1))
    return (_PER_POINT * grid * joints + _PER_WORK * work) * count


def _rest_of(seconds: float) -> RestSeries:
    period = seconds / math.ceil(seconds / _LONGEST_PERIOD)
    return RestSeries(period, min(10, max(5, math.ceil(period / 2))))


def _work(grid: int, joints: int) -> float:
    """Return the products of a cost and its gradient: those of all columns, 10 n, of regressors with n rows each."""
    return float(grid * joints * (10 * joints) ** 2)


@one_blas_thread()
def excite(
    robot: Robot,
    seconds: float,
    *,
    rate: float = 100.0,
    seed: int = 0,
    box: Box | None = None,
    criterion: Criterion | None = None,
    tasks: Sequence[Motion] = (),
    iterations: int = 200,
    time_limit: float = math.inf,
    progress: Progress | None = None,
) -> Excitation:
    """Search a motion of `seconds` whose scaled base regressor has the least condition number (Yan 2018, eq. 4).

    criterion: what else is to be least, as `base_condition.determinant`; with `tasks`, the variance of their energy.
    The limits of the joints, the floor and the `box` are kept at every instant; the robot's collision shapes keep off
    one another, and the torque by the URDF's bodies within its limits. Equal seeds give equal motions, other
    seeds other ones, unless `time_limit` (s) ends the search before its `iterations`. Its most work, for robots of many
    joints, or a KeyboardInterrupt ends it with the best motion so far. Raises InputError where limits are missing or
    contradictory or the box is out of reach.
    """
    if not 0.5 <= seconds <= 3600:
        raise InputError(f"an exciting motion cannot last {seconds:g} s; give 0.5 to 3600 s")
    if not (math.isfinite(rate) and 1 <= rate <= 10_000):
        raise InputError(f"the rate cannot be {rate:g} Hz; give 1 to 10000 Hz")
    most = _MOST // (20 + 6 * len(robot.joints))
    if seconds * rate > most:
        raise InputError(
            f"{seconds:g} s at {rate:g} Hz are {seconds * rate:.0f} samples of {len(robot.joints)} joints; ask for at "
            f"most {most}: less time, or a lower rate"
        )
    search = _Search(robot, seconds, box, np.random.default_rng(seed), criterion, tasks)
    began = monotonic()
    interrupted = False
    try:
        for iteration, _ in enumerate(search.run(iterations)):
            elapsed = monotonic() - began
            if progress is not None:
                progress(iteration, search.best_condition, elapsed)
            if elapsed > time_limit:
                break
    except KeyboardInterrupt:
        if search.best is None:
            raise
        interrupted = True
    return search.result(seconds, rate, interrupted)


class _MostWork(Exception):
    """The search has done the work that it may."""


class _Search:
    """Interior-point search over the coefficients x: (2 K - 1, n); `best` is always a motion that keeps all limits."""

    def __init__(
        self,
        robot: Robot,
        seconds: float,
        box: Box | None,
        random: np.random.Generator,
        criterion: Criterion | None,
        tasks: Sequence[Motion],
    ) -> None:
        self._robot = robot
        self._limits = JointLimits.of(robot)
        self._workspace = Walls(robot, self._limits, box)
        self._body = OwnBody(robot)
        self._regressor = BaseRegressor(robot, criterion, tasks)
        self._random = random
        self._rest = _rest_of(seconds)
        factor = between_samples(self._rest.harmonics, len(self._rest.grid))
        self._ranges = tuple(_RESERVE * limit / factor for limit in self._limits.ranges)
        self._box = box
        self._keep_off = 0.03 * self._workspace.reach  # from walls at the grid: for what happens in between
        self._work = 0.0
        self.bounded = False
        self._better: list[FourierSeries] = []  # than all before, the best last
        self.best_condition = math.inf
        self._best_rank = math.inf

    @property
    def best(self) -> FourierSeries | None:
        """The best motion so far."""
        return self._better[-1] if self._better else None

    def run(self, iterations: int) -> Iterator[None]:
        """Improve `best` step by step."""
        postures = self._postures()
        starts = []
        for _ in range(min(_STARTS, max(iterations, 1))):
            start = self._start(postures[self._random.integers(len(postures))])
            starts.append((self._consider(start), start.ravel()))
            yield
        x = min(starts, key=lambda start: start[0])[1]
        most = iterations * _MOST_WORK
        for weight in _BARRIERS:

            def cost(x: np.ndarray, weight: float = weight) -> tuple[float, np.ndarray]:
                self._spend(most)
                return self._cost(x, weight)

            try:
                for x in descend(cost, x, iterations // len(_BARRIERS)):  # noqa: B020 - the next barrier goes on from here
                    self._consider(self._shaped(x))
                    yield
            except _MostWork:
                self.bounded = True
                return

    def result(self, seconds: float, rate: float, interrupted: bool) -> Excitation:
        """Return the best motion and what is known of it."""
        while self.best is not None and not self._body.proves(self.best):
            self._better.pop()
        if self.best is None:
            raise InputError(f"{self._robot.name}: found no motion in which it does not meet itself; try another seed")
        count = max(2, round(self.best.period * rate))
        motion = self.best.motion(np.arange(count) * (self.best.period / count))
        return Excitation(
            joint_names=self._robot.joint_names,
            series=self.best,
            seconds=seconds,
            rate=rate,
            condition_number=self._regressor.condition_number(*motion),
            limit_margin=self._limits.margin(self.best),
            clearance=self._workspace.least_clearance(self.best),
            interrupted=interrupted,
            bounded=self.bounded,
        )

    def _spend(self, most: float) -> None:
        """Count the products of a cost and its gradient."""
        self._work += _work(len(self._rest.grid), len(self._robot.joints))
        if self._work > most:
            raise _MostWork

    def _shaped(self, x: np.ndarray) -> np.ndarray:
        return x.reshape(-1, len(self._robot.joints))

    def _motion(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        position, speed, acceleration = self._rest.bases
        return position @ x, speed @ x, acceleration @ x

    def _consider(self, x: np.ndarray) -> float:
        """Return how bad the motion is, and keep it if it is the best and proven to keep the limits."""
        rank = self._regressor.rank(*self._motion(x))
        if self.best is None or rank < self._best_rank:
            series = self._rest.series(x)
            if self._keeps(series):
                self._better.append(series)
                self._best_rank = rank
                self.best_condition = self._regressor.condition_number(*self._motion(x))
        return rank

    def _keeps(self, series: FourierSeries) -> bool:
        inside = self._limits.margin(series) > 0 and self._workspace.least_clearance(series) > 0
        return inside and self._body.allows(series)

    def _cost(self, flat: np.ndarray, weight: float) -> tuple[float, np.ndarray]:
        """Return cost plus logarithmic barriers at the limits, and its gradient; infinite where a limit is broken."""
        x = self._shaped(flat)
        motion = self._motion(x)
        about = (self._limits.centre, 0.0, 0.0)  # shares of what the grid may show, -1..1
        shares = [(v - c) / r for v, c, r in zip(motion, about, self._ranges, strict=True)]
        clearance, clearance_slope = self._workspace.clearance_slope(motion[0])
        room = (clearance - self._keep_off) / self._workspace.reach
        if max(float(np.abs(share).max()) for share in shares) >= 1 or room.min(initial=1.0) <= 0:
            return math.inf, flat
        nearness, nearness_slope = self._body.barrier(motion[0])
        if nearness == math.inf:
            return math.inf, flat
        weight /= len(motion[0])
        value, slopes = self._regressor.cost(*motion, slow=0.02 * self._limits.speed)
        value -= weight * (sum(float(np.log1p(-(share**2)).sum()) for share in shares) + float(np.log(room).sum()))
        barriers = [
            weight * 2 * share / (1 - share**2) / limit for share, limit in zip(shares, self._ranges, strict=True)
        ]
        barriers[0] -= weight * np.einsum("nw,nwj->nj", 1 / (room * self._workspace.reach), clearance_slope)
        value += weight * nearness
        barriers[0] += weight * nearness_slope
        gradient = sum(b.T @ (s + r) for b, s, r in zip(self._rest.bases, slopes, barriers, strict=True))
        return value, np.asarray(gradient).ravel()

    def _postures(self) -> np.ndarray:
        """Return postures clear of the walls, (p, n), about which to start; raise InputError where there is none."""
        n = len(self._robot.joints)
        q = self._limits.centre + self._ranges[0] * self._random.uniform(-0.7, 0.7, (_POSTURES, n))
        clearance = self._workspace.clearance(q).min(axis=1, initial=self._workspace.reach)
        if clearance.max() <= 0:
            q = np.array([self._towards(posture) for posture in q[np.argsort(-clearance)[:10]]])
            clearance = self._workspace.clearance(q).min(axis=1)
        best = float(clearance.max())
        if best <= 4 * self._workspace.resolution:
            raise InputError(
                f"{self._robot.name}: found no posture within the joint limits with every link above the floor"
                + (
                    ", z = 0 of the base frame; raise the first joint's origin in the URDF"
                    if self._box is None
                    else " and the flange inside the box; give a larger box, in metres in the base frame"
                )
            )
        self._keep_off = min(self._keep_off, best / 3)
        return self._body.postures(np.asarray(q[clearance >= 0.5 * best]))

    def _towards(self, posture: np.ndarray) -> np.ndarray:
        """Return a posture nearer to the inside of all walls, within the joint limits: (n,)."""

        def outside(q: np.ndarray) -> tuple[float, np.ndarray]:
            clearance, slope = self._workspace.clearance_slope(q[None])
            lack = np.minimum(clearance[0] - 0.02 * self._workspace.reach, 0)
            return float(lack @ lack), 2 * lack @ slope[0]

        room = 0.9 * self._limits.ranges[0]
        bounds = list(zip(self._limits.centre - room, self._limits.centre + room, strict=True))
        return np.asarray(scipy.optimize.minimize(outside, posture, jac=True, bounds=bounds, method="L-BFGS-B").x)

    def _start(self, posture: np.ndarray) -> np.ndarray:
        """Return a random motion about the posture, as large as the limits let it be: (2 K - 1, n)."""
        x = self._random.normal(size=(2 * self._rest.harmonics - 1, len(posture)))
        x[0] = 0
        room = (self._ranges[0] - np.abs(posture - self._limits.centre), *self._ranges[1:])
        largest = [np.abs(v).max(axis=0) for v in self._motion(x)]
        x *= 0.9 * np.min([r / v for r, v in zip(room, largest, strict=True)], axis=0)
        x[0] = posture

        def clear() -> bool:
            at_grid = self._workspace.clearance(self._motion(x)[0]).min(initial=math.inf)
            return at_grid > self._keep_off and self._keeps(self._rest.series(x))

        while not clear():
            x[1:] *= 0.8
        return x


def descend(cost: Cost, start: np.ndarray, iterations: int, tolerance: float = 1e-4) -> Iterator[np.ndarray]:
    """Yield ever better points, (k,) each, by BFGS with backtracking.

    `cost` gives value and gradient, or an infinite value outside the region; `start` lies inside. Ends after
    `iterations` steps, or where a step gains less than `tolerance` or no step helps.
    Source: Nocedal and Wright, Numerical Optimization, 2006, section 6.1.
    """
    x = start
    value, gradient = cost(x)
    inverse: np.ndarray | None = None
    for _ in range(iterations):
        if inverse is None:
            direction = -gradient * (0.01 * np.linalg.norm(x) / np.linalg.norm(gradient))
        else:
            direction = -inverse @ gradient
        slope = float(direction @ gradient)
        if slope >= 0:
            return
        length = 1.0
        while True:
            new_value, new_gradient = cost(x + length * direction)
            if new_value < value + _SUFFICIENT * length * slope:
                break
            length *= _SHORTEN
            if length < _SHORTEST:
                return
        step, change = length * direction, new_gradient - gradient
        inverse = _update(inverse, step, change)
        gain = value - new_value
        x, value, gradient = x + step, new_value, new_gradient
        yield x
        if gain < tolerance:
            return


def _update(inverse: np.ndarray | None, step: np.ndarray, change: np.ndarray) -> np.ndarray | None:
    """Return the inverse Hessian, (k, k), that maps the gradient's change to the step (BFGS)."""
    curvature = float(step @ change)
    if curvature <= 1e-10 * np.linalg.norm(step) * np.linalg.norm(change):
        return inverse
    if inverse is None:
        inverse = np.eye(len(step)) * (curvature / float(change @ change))
    turned = inverse @ change
    scale = (1 + float(change @ turned) / curvature) / curvature
    return inverse + scale * np.outer(step, step) - (np.outer(turned, step) + np.outer(step, turned)) / curvature

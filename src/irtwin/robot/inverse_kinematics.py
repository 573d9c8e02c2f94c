"""Inverse kinematics: the joint positions that bring the flange to a pose."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from irtwin.errors import InputError
from irtwin.robot.description import Robot
from irtwin.robot.kinematics import flange, link_frame, ranges

_STARTS = 200  # of the search: one given or the middle of the ranges, the others drawn
_STEPS = 60  # from each start
_REACHED = 1e-9  # m and rad
_SAME = 1e-4  # rad, m: solutions nearer than this are one
_NEAR = 1e-5  # m: a position that is missed by less can be reached
_DAMPING, _LEAST_DAMPING = 1e-3, 1e-12

_Error = Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]]  # of a pose: what is left (m,), and its slope (m, n)


@dataclass(frozen=True)
class Found:
    """What a search found: `solutions` (k, n) rad or m, nearest to the start first; k is 0 where the pose is missed.

    `distance`, m, is how far from the wanted position the flange stays at least; `angle`, rad, how far from the wanted
    orientation where the position is reached. `redundant`: more joints than the pose needs, so that there are more
    solutions without end.
    """

    solutions: np.ndarray
    distance: float
    angle: float
    redundant: bool


def solve(
    robot: Robot, pose: np.ndarray, *, start: np.ndarray | None = None, link: str | None = None, seed: int = 0
) -> Found:
    """Find the joint positions that bring a link (the flange) to a (4, 4) pose in the base frame, within the limits.

    Damped least squares from `start` (n,) and from positions drawn within the limits. Solutions that differ by whole
    turns of a joint are one: the turn nearest to the start is given. Raises InputError on a start of another length or
    out of the limits, and on an unknown link.
    """
    lower, upper = robot.limits
    near = np.clip(np.zeros(len(lower)), lower, upper) if start is None else _checked(robot, start, lower, upper)
    frame = link_frame(robot, link or flange(robot))
    search = _Search(robot, frame, pin.SE3(pose), lower, upper)
    starts = [near, *search.draw(np.random.default_rng(seed), _STARTS - 1)]
    ends = [search.descend(search.whole, each) for each in starts]
    solutions: list[np.ndarray] = []
    for q, left in ends:
        if left < _REACHED:
            turned = search.turned(q, near)
            if all(np.abs(search.between(turned, other)).max() > _SAME for other in solutions):
                solutions.append(turned)
    solutions.sort(key=lambda q: float(np.abs(q - near).max()))
    redundant = len(robot.joints) > 6
    if solutions:
        return Found(np.array(solutions), 0.0, 0.0, redundant)
    places = [search.descend(search.position, each) for each in starts[: _STARTS // 8]]
    distance = min(left for _, left in places)
    angle = search.least_angle([q for q, _ in ends]) if distance < _NEAR else np.nan
    return Found(np.empty((0, len(lower))), distance, angle, redundant)


def nearest(
    robot: Robot, target: pin.SE3, start: np.ndarray, lower: np.ndarray, upper: np.ndarray
) -> tuple[np.ndarray, float, float]:
    """Return where a descent of the flange to a target from `start` (n,) ends, and what is left: m, rad."""
    search = _Search(robot, link_frame(robot, flange(robot)), target, lower, upper)
    q, _ = search.descend(search.whole, np.clip(start, lower, upper))
    left = target.actInv(search.place(q))
    return q, float(np.linalg.norm(left.translation)), float(np.linalg.norm(pin.log3(left.rotation)))


def _damped_step(slope: np.ndarray, value: np.ndarray, damping: float) -> np.ndarray:
    """Return x, (n,), of least |slope x - value|^2 + damping |x|^2; slope: (m, n), value: (m,).

    Nakamura and Hanafusa (1986). The slope is not squared: links may be kilometres long.
    """
    count = slope.shape[1]
    stacked = np.vstack([slope, np.sqrt(damping) * np.eye(count)])
    return np.asarray(np.linalg.lstsq(stacked, np.append(value, np.zeros(count)))[0])


def _checked(robot: Robot, start: np.ndarray, lower: np.ndarray, upper: np.ndarray) -> np.ndarray:
    start = np.asarray(start, dtype=float)
    if start.shape != lower.shape:
        raise InputError(f"{robot.name} has {len(lower)} moving joints, and the start gives {start.size} positions")
    for value, low, high, joint in zip(start, lower, upper, robot.joints, strict=True):
        if not low <= value <= high:
            raise InputError(
                f"{robot.name}: the start has {joint.name} at {value:g} {joint.unit}, "
                f"outside its limits {low:g} to {high:g}"
            )
    return start


class _Search:
    """Damped least squares within limits."""

    def __init__(self, robot: Robot, frame: int, goal: pin.SE3, lower: np.ndarray, upper: np.ndarray) -> None:
        self._model, self._data, self._frame = robot.model, robot.model.createData(), frame
        self._goal, self._lower, self._upper = goal, lower, upper
        self._ranges = ranges(robot)
        self._turns = np.array([joint.kind != "prismatic" for joint in robot.joints])

    def draw(self, random: np.random.Generator, count: int) -> np.ndarray:
        """Return (count, n) joint positions within the limits."""
        return random.uniform(*self._ranges, (count, len(self._lower)))

    def whole(self, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return (6,) m and rad from the pose to the goal, and (6, n) its slope."""
        place = self.place(q)
        jacobian = np.reshape(pin.getFrameJacobian(self._model, self._data, self._frame, pin.LOCAL), (6, -1))
        left = self._goal.actInv(place)
        return np.asarray(pin.log6(left).vector), np.asarray(pin.Jlog6(left) @ jacobian)

    def position(self, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return (3,) m from the flange's position to the goal's, and (3, n) its slope."""
        place = self.place(q)
        frame = pin.getFrameJacobian(self._model, self._data, self._frame, pin.LOCAL_WORLD_ALIGNED)
        return np.asarray(place.translation - self._goal.translation), np.reshape(frame, (6, -1))[:3]

    def place(self, q: np.ndarray) -> pin.SE3:
        """Return the link's placement."""
        pin.computeJointJacobians(self._model, self._data, q)
        return pin.updateFramePlacement(self._model, self._data, self._frame)

    def descend(self, error: _Error, q: np.ndarray) -> tuple[np.ndarray, float]:
        """Return where the descent from `q` ends, and the norm of what is left there."""
        damping = _DAMPING
        value, slope = error(q)
        for _ in range(_STEPS):
            if np.linalg.norm(value) < _REACHED * 1e-2:
                break
            free = ~(((q <= self._lower) & (slope.T @ value > 0)) | ((q >= self._upper) & (slope.T @ value < 0)))
            part = slope[:, free]
            step = np.zeros_like(q)
            step[free] = -_damped_step(part, value, damping)
            tried = np.clip(q + step, self._lower, self._upper)
            new, new_slope = error(tried)
            if new @ new < value @ value:
                q, value, slope = tried, new, new_slope
                damping = max(damping * 0.2, _LEAST_DAMPING)
            else:
                damping *= 10
                if damping > 1e6:
                    break
        return q, float(np.linalg.norm(value))

    def turned(self, q: np.ndarray, near: np.ndarray) -> np.ndarray:
        """Return the same pose with each joint at the turn that lies within the limits and nearest to `near`."""
        result = q.copy()
        for joint in np.flatnonzero(self._turns):
            turns = q[joint] + 2 * np.pi * np.arange(-3, 4)
            within = turns[(turns >= self._lower[joint]) & (turns <= self._upper[joint])]
            if len(within):
                result[joint] = within[np.argmin(np.abs(within - near[joint]))]
        return result

    def between(self, q: np.ndarray, other: np.ndarray) -> np.ndarray:
        """Return (n,) how far two positions are apart, whole turns left out."""
        apart = q - other
        return np.asarray(np.where(self._turns, np.mod(apart + np.pi, 2 * np.pi) - np.pi, apart))

    def least_angle(self, candidates: list[np.ndarray]) -> float:
        """Return the least angle, rad, to the goal's orientation among poses at the goal's position."""
        angles = []
        for q in candidates:
            q, left = self.descend(self.position, q)
            if left < _NEAR:
                angles.append(float(np.linalg.norm(pin.log3(self._goal.rotation.T @ self.place(q).rotation))))
        return min(angles, default=np.nan)

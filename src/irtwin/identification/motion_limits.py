"""What a motion must keep to: limits of the joints, and walls in space, also between the samples."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from irtwin.errors import InputError
from irtwin.identification.fourier_series import FourierSeries, between_samples
from irtwin.robot.description import Joint, Robot
from irtwin.robot.kinematics import flange, levers

FULL_SPEED_AFTER = 0.3  # s: the acceleration limit of a joint whose maker gives none is speed / 0.3 s
_SMALLEST, _LARGEST = 1e-6, 1e4  # rad, rad/s, m, m/s: of limits that a machine has
_FARTHEST = 1e6  # m
_MOST_POSES = 50_000  # for one proof of clearance
CLEARANCE = 0.1  # m above the floor, or a tenth of the reach if that is less


@dataclass(frozen=True)
class Box:
    """Where the flange must stay: lower and upper corner in the base frame, m; infinite where nothing bounds it."""

    lower: tuple[float, float, float]
    upper: tuple[float, float, float]


@dataclass(frozen=True)
class JointLimits:
    """Limits of n joints, (n,) each: rad, rad/s, rad/s^2 (m for prismatic ones)."""

    lower: np.ndarray
    upper: np.ndarray
    speed: np.ndarray
    acceleration: np.ndarray

    @classmethod
    def of(cls, robot: Robot) -> JointLimits:
        """Take the limits of a robot; raise InputError where they are missing or contradict one another.

        A continuous joint may turn half a revolution either way. Where the acceleration is not given, a joint
        reaches its full speed in FULL_SPEED_AFTER seconds, which is gentler than the makers of arms allow.
        """
        if not robot.joints:
            raise InputError(f"{robot.name}: no joint moves, so there is no motion to design")
        rows = np.array([_limits(robot.name, joint) for joint in robot.joints])
        return cls(*rows.T)

    @property
    def centre(self) -> np.ndarray:
        """The middle of the position ranges, (n,)."""
        return np.asarray((self.lower + self.upper) / 2)

    @property
    def ranges(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Largest |q - centre|, |dq| and |ddq|, (n,) each."""
        return (self.upper - self.lower) / 2, self.speed, self.acceleration

    def margin(self, series: FourierSeries) -> float:
        """Return the least distance to a limit at any time, as a share of the limit; negative where one is broken."""
        grid = series.grid()
        factor = between_samples(series.harmonics, len(grid))
        q, dq, ddq = series.motion(grid)
        off = zip((q - self.centre, dq, ddq), self.ranges, strict=True)
        return 1 - factor * max(float((np.abs(values) / most).max()) for values, most in off)


def _limits(robot: str, joint: Joint) -> tuple[float, float, float, float]:
    where = f'{robot}: joint "{joint.name}"'
    lower, upper = joint.lower, joint.upper
    if joint.kind == "continuous":
        lower, upper = max(lower, -np.pi), min(upper, np.pi)
    if not (np.isfinite(lower) and np.isfinite(upper)):
        raise InputError(f'{where} has no position limits; give <limit lower="..." upper="..."/> in the URDF')
    if lower >= upper:
        raise InputError(f"{where} cannot move: its lower limit {lower:g} is not below its upper limit {upper:g}")
    if not (np.isfinite(joint.velocity) and joint.velocity > 0):
        raise InputError(f'{where} has no speed limit; give <limit velocity="..."/> in the URDF')
    acceleration = joint.velocity / FULL_SPEED_AFTER if joint.acceleration is None else joint.acceleration
    if not (np.isfinite(acceleration) and acceleration > 0):
        raise InputError(f"{where} has the acceleration limit {acceleration:g}; it must be positive")
    for kind, size in (("range", upper - lower), ("speed limit", joint.velocity), ("acceleration limit", acceleration)):
        if not _SMALLEST <= size <= _LARGEST / FULL_SPEED_AFTER:
            raise InputError(
                f"{where} has a {kind} of {size:g}, which is not plausible; correct its <limit> in the URDF"
            )
    return lower, upper, joint.velocity, acceleration


@dataclass(frozen=True)
class _Wall:
    """A link's origin must keep side * (position[axis] - bound) above zero."""

    frame: int
    axis: int
    side: float
    bound: float


class Walls:
    """Walls: the floor for the origin of every link that moves up or down, the box for the flange."""

    def __init__(self, robot: Robot, limits: JointLimits, box: Box | None) -> None:
        self._model = robot.model
        self._data = robot.model.createData()
        with np.errstate(over="ignore"):  # what is infinite is refused below
            self._levers = _levers(robot, limits)
        self.reach = max(0.01, float(max(lever.max() for lever in self._levers)))  # m
        if not self.reach <= _FARTHEST:
            raise InputError(
                f"{robot.name}: reaches {self.reach:g} m, which is not plausible; correct the origins in the URDF"
            )
        self.resolution = self.reach / 1000  # m: what the proof of clearance gives away
        self._walls = self._floor(robot, limits) + self._box(robot, box)
        self._frames = sorted({wall.frame for wall in self._walls})

    def clearance(self, q: np.ndarray) -> np.ndarray:
        """Return the distance to each wall, (N, w) m, at the joint positions `q`: (N, n); negative behind a wall."""
        result = np.empty((len(q), len(self._walls)))
        for row, sample in enumerate(q):
            pin.forwardKinematics(self._model, self._data, sample)
            result[row] = self._distances()
        return result

    def clearance_slope(self, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the clearance (N, w) and its derivative with respect to each joint, (N, w, n)."""
        value = np.empty((len(q), len(self._walls)))
        slope = np.empty((*value.shape, q.shape[1]))
        for row, sample in enumerate(q):
            pin.computeJointJacobians(self._model, self._data, sample)
            value[row] = self._distances()
            jacobians = {
                frame: pin.getFrameJacobian(self._model, self._data, frame, pin.LOCAL_WORLD_ALIGNED)
                for frame in self._frames
            }
            for place, wall in enumerate(self._walls):
                slope[row, place] = wall.side * jacobians[wall.frame][wall.axis]
        return value, slope

    def least_clearance(self, series: FourierSeries) -> float:
        """Return a lower bound, in m, on the clearance at any time of the motion.

        Between two instants h apart a function lies within h^2 / 8 max|x''| of the straight line. With the speeds V
        and accelerations A that the series never passes, the acceleration of a point at most r_k from joint k is at
        most sum_k r_k A_k + sum_kl r_max(k,l) V_k V_l: the joint farther down the chain turns the shorter lever.
        h is chosen so that `resolution` is given away. Nothing bounds a motion that would take too many poses: -inf.
        """
        grid = series.grid()
        factor = between_samples(series.harmonics, len(grid))
        speed, acceleration = (factor * np.abs(v).max(axis=0) for v in series.motion(grid)[1:])
        farther = np.maximum.outer(np.arange(len(speed)), np.arange(len(speed)))
        worst = max(float(r @ acceleration + speed @ r[farther] @ speed) for r in self._levers)
        poses = float(np.ceil(series.period * np.sqrt(worst / (8 * self.resolution))))
        if not poses <= _MOST_POSES:
            return -np.inf
        count = max(len(grid), int(poses))
        q = series.motion(np.arange(count) * (series.period / count))[0]
        return float(self.clearance(q).min(initial=np.inf)) - self.resolution

    def _distances(self) -> list[float]:
        places = {frame: pin.updateFramePlacement(self._model, self._data, frame).translation for frame in self._frames}
        return [wall.side * (places[wall.frame][wall.axis] - wall.bound) for wall in self._walls]

    def _floor(self, robot: Robot, limits: JointLimits) -> list[_Wall]:
        bound = min(CLEARANCE, self.reach / 10)
        walls = [_Wall(frame, 2, 1.0, bound) for frame in _guarded(robot)]
        self._walls, self._frames = walls, [wall.frame for wall in walls]
        heights = self.clearance(np.random.default_rng(0).uniform(limits.lower, limits.upper, (50, len(limits.lower))))
        return [wall for wall, moves in zip(walls, np.ptp(heights, axis=0) > 1e-9, strict=True) if moves]

    def _box(self, robot: Robot, box: Box | None) -> list[_Wall]:
        if box is None:
            return []
        frame = robot.model.getFrameId(flange(robot), pin.FrameType.BODY)
        corners = np.array([box.lower, box.upper], dtype=float)
        if corners.shape != (2, 3) or not (corners[0] < corners[1]).all():
            raise InputError(f"box {box.lower} to {box.upper}: every lower bound must be below its upper bound")
        return [
            _Wall(frame, axis, side, float(bound))
            for side, corner in ((1.0, corners[0]), (-1.0, corners[1]))
            for axis, bound in enumerate(corner)
            if np.isfinite(bound)
        ]


def _guarded(robot: Robot) -> list[int]:
    """Return the frames of the links; a tool frame at the flange is left out, as it would count the flange twice."""
    model = robot.model
    tip = model.frames[model.getFrameId(flange(robot), pin.FrameType.BODY)]
    kept = []
    for link in robot.links:
        number = model.getFrameId(link.name, pin.FrameType.BODY)
        frame = model.frames[number]
        again = frame.parentJoint == tip.parentJoint and np.array_equal(
            frame.placement.translation, tip.placement.translation
        )
        if not again or link.mass > 0 or frame.name == tip.name:
            kept.append(number)
    return kept


def _levers(robot: Robot, limits: JointLimits) -> list[np.ndarray]:
    """Return for each link how far, (n,) m, its origin can be from each joint, as `levers` has it."""
    frames = [frame for frame in robot.model.frames if frame.type == pin.FrameType.BODY]
    distances = [float(np.linalg.norm(frame.placement.translation)) for frame in frames]
    places = zip((frame.parentJoint for frame in frames), distances, strict=True)
    return [levers(robot, joint, distance, limits.lower, limits.upper) for joint, distance in places]

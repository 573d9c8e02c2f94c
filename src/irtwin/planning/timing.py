"""When a robot is where on its path: as fast as speed, acceleration, jerk and torque allow."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import scipy

from irtwin.errors import InputError
from irtwin.identification.motion_limits import JointLimits
from irtwin.planning.path import way_along
from irtwin.robot.description import Robot
from irtwin.signals.sampling import interpolated

if TYPE_CHECKING:
    from scipy.interpolate import BSpline, PPoly

Torque = Callable[[np.ndarray, np.ndarray, np.ndarray], np.ndarray]
"""From q, dq, ddq, (N, n) each, to the joint torques (N, n), N m."""
States = tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]
"""What a motion is at N instants: q, dq, ddq and jerk, (N, n) each; or a place on a path and its derivatives, (N,)."""

FULL_ACCELERATION_AFTER = 0.1  # s: the jerk limit of a joint is its acceleration limit / 0.1 s
_POINTS = 200  # of the path at which TOPP-RA bounds its speed
_DENSE = 1500  # instants at which limits are checked
_WINDOWS = (0.05, 0.1, 0.15, 0.2, 0.3)  # s: over which the motion along the path is averaged
_RESERVE = 0.99  # share of the limits that is used: between the instants
_SLOWER = 1.02
_SLOWEST = 50.0
_DEGREE = 4  # of the spline that rounds corners: jerk has no jumps then
_PIECES, _MOST_PIECES = 6, 1000  # of the path between points of its spline, more until it is clear
_BEND = 0.5  # share of the jerk limit that the path's own bends may take


@dataclass(frozen=True)
class MotionLimits(JointLimits):
    """What a motion of n joints must keep to besides, (n,) each: rad/s^3, N m (m, N where they slide)."""

    jerk: np.ndarray
    torque: np.ndarray  # infinite where the URDF says none

    @classmethod
    def of(cls, robot: Robot) -> MotionLimits:
        """Take the limits of a robot. Raise InputError where some are missing or contradict one another."""
        limits = JointLimits.of(robot)
        jerk = limits.acceleration / FULL_ACCELERATION_AFTER
        torque = np.array([joint.effort for joint in robot.joints])
        return cls(**vars(limits), jerk=jerk, torque=torque)


@dataclass(frozen=True)
class Timed:
    """A path with its time law: `q(t)` of n joints from rest to rest in `seconds`."""

    path: BSpline  # (n,) of the place on the path
    law: PPoly  # integral of the unsmoothed place over time
    window: float  # s, over which the place is averaged
    stretch: float  # how much slower than the law it goes

    @property
    def seconds(self) -> float:
        """How long the motion takes."""
        return float(self.stretch * (self.law.x[-1] - self.law.x[0] - self.window))

    def slower(self, seconds: float) -> Timed:
        """Return the same path, evenly slowed to last `seconds`."""
        return Timed(self.path, self.law, self.window, self.stretch * seconds / self.seconds)

    def motion(self, time: np.ndarray) -> States:
        """Return q, dq, ddq and jerk, (N, n) each, at `time`: (N,) s."""
        return along(self.path, *self.place(time))

    def place(self, time: np.ndarray) -> States:
        """Return the place on the path and its first three derivatives, (N,) each, at `time`: (N,) s."""
        law_time = time / self.stretch + self.law.x[0] + self.window / 2
        ends = (law_time + self.window / 2, law_time - self.window / 2)
        s, ds, dds, ddds = (
            (self.law(ends[0], order) - self.law(ends[1], order)) / self.window / self.stretch**order
            for order in range(4)
        )
        return s, ds, dds, ddds


def along(path: BSpline, s: np.ndarray, ds: np.ndarray, dds: np.ndarray, ddds: np.ndarray) -> States:
    """Return q, dq, ddq and jerk, (N, n) each, at places on a path that change so, (N,) each."""
    p, p1, p2, p3 = (path(np.clip(s, path.t[path.k], path.t[-path.k - 1]), nu) for nu in range(4))
    v, a, j = ds[:, None], dds[:, None], ddds[:, None]
    return p, p1 * v, p2 * v**2 + p1 * a, p3 * v**3 + 3 * p2 * v * a + p1 * j


def rounded(corners: np.ndarray, is_clear: Callable[[np.ndarray], bool]) -> BSpline:
    """Return a smooth path near the corners (k, n): each of its points lies between neighbours on the corners' path.

    `is_clear` judges dense points (N, n) of it. With ever shorter pieces it comes as near to the corners as need be.
    """
    way = way_along(corners)
    pieces = _PIECES
    while True:
        at = np.linspace(0, way[-1], pieces + 1)
        inner = np.linspace(0, 1, pieces - _DEGREE + 2)
        knots = np.concatenate([np.zeros(_DEGREE), inner, np.ones(_DEGREE)])
        path = scipy.interpolate.BSpline(knots, interpolated(way, corners, at), _DEGREE)
        if pieces > _MOST_PIECES or is_clear(path(np.linspace(0, 1, 400))):
            return path
        pieces = pieces * 3 // 2


def through(poses: np.ndarray) -> BSpline:
    """Return the smooth path through near poses (k, n)."""
    way = way_along(poses)
    return scipy.interpolate.make_interp_spline(way / way[-1], poses, k=5)


def fastest(path: BSpline, limits: MotionLimits, torque: Torque) -> Timed:
    """Return the fastest motion along a path that keeps all limits: TOPP-RA, then smoothed.

    TOPP-RA (Pham and Pham, 2018) bounds speed, acceleration and torque; it jumps in acceleration. Its place on the
    path is averaged over a window of time, so that acceleration is continuous and jerk bounded; the path stays what
    it is. What then passes a limit is slowed evenly. The window that ends first is taken.
    Raises InputError where torque does not suffice at any speed.
    """
    time, place, speed = _topp_ra(path, limits, torque)
    tried = [_within(_smoothed(path, time, place, speed, window), limits, torque) for window in _WINDOWS]
    feasible = [timed for timed in tried if timed is not None]
    if not feasible:
        raise InputError(_too_heavy(path, limits, torque))
    return min(feasible, key=lambda timed: timed.seconds)


def shares(motion: States, limits: MotionLimits, torque: Torque) -> dict[str, np.ndarray]:
    """Return how much of each limit a motion (q, dq, ddq, jerk) takes, (N, n) each; beyond -1 or 1 where it passes."""
    q, dq, ddq, jerk = motion
    return {
        "position": (q - limits.centre) / limits.ranges[0],
        "speed": dq / limits.speed,
        "acceleration": ddq / limits.acceleration,
        "jerk": jerk / limits.jerk,
        "torque": torque(q, dq, ddq) / limits.torque,
    }


def _topp_ra(path: BSpline, limits: MotionLimits, torque: Torque) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return times (k,), places on the path and speeds along it there, constant acceleration in between."""
    toppra = _toppra()
    places = np.linspace(0, 1, _POINTS + 1)
    constraints = [
        toppra.constraint.JointVelocityConstraint(_both(limits.speed)),
        toppra.constraint.JointAccelerationConstraint(_both(limits.acceleration)),
    ]
    constraints.append(_bend_constraint(toppra, path, places, limits))
    if np.isfinite(limits.torque).any():
        constraints.append(_torque_constraint(toppra, path, places, limits, torque))
    method = toppra.algorithm.TOPPRA(
        constraints, _as_geometry(toppra, path), gridpoints=places, solver_wrapper="seidel"
    )
    _, speed, _ = method.compute_parameterization(0, 0)
    if speed is None or not np.isfinite(speed).all():
        raise InputError(_too_heavy(path, limits, torque))
    steps = 2 * np.diff(places) / np.maximum(speed[1:] + speed[:-1], 1e-9)
    return np.concatenate([[0.0], np.cumsum(steps)]), places, speed


def _bend_constraint(toppra: Any, path: BSpline, places: np.ndarray, limits: MotionLimits) -> Any:
    """Return a bound on the speed along the path, so that q''' s'^3 leaves some of the jerk limit."""
    bend = np.abs(path(places, 3)) / (_BEND * limits.jerk)
    bounds = np.column_stack([np.zeros(len(places)), np.maximum(bend.max(axis=1), 1e-9) ** (-2 / 3)])

    return _constraint(toppra, path, (None, None, None, None, None, None, bounds))


def _torque_constraint(toppra: Any, path: BSpline, places: np.ndarray, limits: MotionLimits, torque: Torque) -> Any:
    """Return |a s'' + b s'^2 + c| <= limit with the twin's torque.

    c is gravity and dry friction. Viscous friction is no square of speed: b is exact at the greatest speed that the
    joints' limits allow there, and too small below; what that leaves is slowed down afterwards.
    """
    q, along, bend = (path(places, nu) for nu in range(3))
    still = np.zeros_like(q)
    slow = torque(q, 0.02 * along / np.maximum(np.abs(along).max(axis=1, keepdims=True), 1e-9), still)
    rest = torque(q, still, still)
    a = torque(q, still, along) - rest
    top = (limits.speed / np.maximum(np.abs(along), 1e-9)).min(axis=1, keepdims=True)
    b = (torque(q, along * top, bend * top**2) - slow) / top**2
    bound = np.where(np.isfinite(limits.torque), limits.torque, 1e9)
    sides, bounds = np.vstack([np.eye(len(bound)), -np.eye(len(bound))]), np.concatenate([bound, bound])

    return _constraint(toppra, path, (a, b, slow, sides, bounds, None, None))


def _constraint(toppra: Any, path: BSpline, parameters: tuple[np.ndarray | None, ...]) -> Any:
    """Return TOPP-RA's constraint of a, b, c, F, g and bounds of s'' and of s'^2; F and g are those of all places."""

    class Given(toppra.constraint.LinearConstraint):  # type: ignore[misc]
        def __init__(self) -> None:
            super().__init__()
            self.dof = path.c.shape[1]
            self.identical = True
            self.set_discretization_type(toppra.constraint.DiscretizationType.Collocation)

        def compute_constraint_params(self, *_: Any) -> Any:
            return parameters

    return Given()


def _as_geometry(toppra: Any, path: BSpline) -> Any:
    class Geometry(toppra.interpolator.AbstractGeometricPath):  # type: ignore[misc]
        dof = path.c.shape[1]
        path_interval = np.array([0.0, 1.0])
        waypoints = None

        def __call__(self, places: Any, order: int = 0) -> Any:
            return path(places, order)

    return Geometry()


def _smoothed(path: BSpline, time: np.ndarray, place: np.ndarray, speed: np.ndarray, window: float) -> Timed:
    """Return the place on the path to be averaged over a window; it rests for a window before and after."""
    times = np.concatenate([[-window], time, [time[-1] + window]])
    gains = np.diff(speed) / np.diff(time)
    squares = np.concatenate([[0.0], gains / 2, [0.0]])
    slopes = np.concatenate([[0.0], speed[:-1], [0.0]])
    starts = np.concatenate([[0.0], place[:-1], [place[-1]]])
    speeds = scipy.interpolate.PPoly(np.array([squares, slopes, starts]), times)
    return Timed(path, speeds.antiderivative(), window, 1.0)


def _within(timed: Timed, limits: MotionLimits, torque: Torque) -> Timed | None:
    """Return the motion as much slower as a limit asks; None where torque is short at any speed."""
    used = shares(timed.motion(np.linspace(0, timed.seconds, _DENSE)), limits, torque)
    most = [float(np.abs(used[name]).max()) / _RESERVE for name in ("speed", "acceleration", "jerk")]
    timed = timed.slower(timed.seconds * max(most[0], most[1] ** 0.5, most[2] ** (1 / 3)))
    while timed.stretch < _SLOWEST:
        motion = timed.motion(np.linspace(0, timed.seconds, _DENSE))
        if np.abs(shares(motion, limits, torque)["torque"]).max() <= _RESERVE:
            return timed
        timed = timed.slower(timed.seconds * _SLOWER)
    return None


def _too_heavy(path: BSpline, limits: MotionLimits, torque: Torque) -> str:
    q = path(np.linspace(0, 1, _POINTS))
    share = (np.abs(torque(q, np.zeros_like(q), np.zeros_like(q))) / limits.torque).max(axis=0)
    joint = int(np.argmax(share))
    return (
        f"holding the arm takes {100 * share[joint]:.0f} % of the torque limit of joint {joint + 1} somewhere on the "
        "way; take a smaller payload or another way"
    )


def _both(limit: np.ndarray) -> np.ndarray:
    return np.column_stack([-limit, limit])


def _toppra() -> Any:
    try:
        import toppra
        import toppra.algorithm
        import toppra.constraint
    except ImportError as error:
        raise InputError('planning needs OMPL and TOPP-RA; install them with pip install "irtwin[plan]"') from error
    toppra.setup_logging("ERROR")
    return toppra

"""Placement of the base: where a robot would stand better, for the same way of its flange through the room."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio as pin
import scipy

from irtwin.identification.progress import tell_step
from irtwin.robot.inverse_kinematics import nearest
from irtwin.robot.kinematics import placements
from irtwin.signals.motion import Motion
from irtwin.twin.price import Figure, saving
from irtwin.twin.twin import Twin

FARTHEST = 0.3  # m, along each axis: farther the cell is another one
_FIRST, _ENOUGH, _TRIED = 0.05, 0.01, 60  # m, the first steps, and the last; places at most
_RATE = 25.0  # Hz, at which poses are followed: joints are smooth between
_REACHED = 1e-5  # m and rad
_JUMP = 0.5  # rad or m from one pose to the next: another branch of the arm


@dataclass(frozen=True)
class Placement:
    """The base moved by `shift` (3,) m in its own frame: the `motion` there, and what it saves a cycle, J."""

    shift: np.ndarray
    motion: Motion
    saved: Figure


def better_placement(twin: Twin, motion: Motion) -> Placement | None:
    """Return the place of the base from which a motion's way of the flange takes least, at the same times.

    Of places up to `FARTHEST` away by Nelder and Mead's search; none where the arm cannot follow within its limits of
    position, speed and torque. None where none is expected to save anything. What stands around is not known.
    """
    way = _Way(twin, motion)

    def energy(shift: np.ndarray) -> float:
        tell_step("  places of the base")
        moved = None if np.abs(shift).max() > FARTHEST else way.from_base(shift)
        return np.inf if moved is None else twin.energy(moved)

    first = np.vstack([np.zeros(3), _FIRST * np.eye(3)])
    options = {"initial_simplex": first, "maxfev": _TRIED, "xatol": _ENOUGH, "fatol": np.inf}
    with np.errstate(invalid="ignore"):  # two places that cannot be are infinitely far from neither
        best = scipy.optimize.minimize(energy, np.zeros(3), method="Nelder-Mead", options=options)
    moved = way.from_base(best.x) if np.any(best.x) else None
    if moved is None:
        return None
    saved = saving(twin, moved, way.smooth)
    return Placement(best.x, moved, saved) if saved.value > 0 else None


class _Way:
    """The way of a motion's flange through the room, and how the arm follows it from other places of its base."""

    def __init__(self, twin: Twin, motion: Motion):
        """Take the way as the motion makes it."""
        self._twin, self._motion = twin, motion
        every = max(1, round(motion.rate / _RATE))
        self._knots = np.unique(np.append(np.arange(0, len(motion.time), every), len(motion.time) - 1))
        self._q = motion.q[self._knots]
        self._poses = placements(twin.robot, self._q)
        self.smooth = self._smooth(self._q)  # the motion itself, as smooth as it is from elsewhere
        self._lower, self._upper = np.array([(joint.lower, joint.upper) for joint in twin.robot.joints]).T

    def from_base(self, shift: np.ndarray) -> Motion | None:
        """Return the motion that makes the way from a base moved by `shift` (3,) m; None where the arm cannot."""
        q, rows = self._q[0], list[np.ndarray]()
        # joints step as they did, so that an arm of seven joints keeps to its way of going among many
        for pose, step in zip(self._poses, np.diff(self._q, axis=0, prepend=self._q[:1]), strict=True):
            target = pin.SE3(pose[:3, :3], pose[:3, 3] - shift)
            reached, meters, radians = nearest(self._twin.robot, target, q + step, self._lower, self._upper)
            if max(meters, radians) > _REACHED or (rows and np.abs(reached - q).max() > _JUMP):
                return None
            q = reached
            rows.append(q)
        moved = self._smooth(np.array(rows))
        return moved if not np.any(shift) or self._allowed(moved) else None

    def _smooth(self, q: np.ndarray) -> Motion:
        """Return the motion through positions at the poses, (M, n)."""
        time = self._motion.time
        spline = scipy.interpolate.CubicSpline(time[self._knots], q)
        return self._motion.moved(time, *(spline(time, order) for order in range(3)))

    def _allowed(self, moved: Motion) -> bool:
        """Return whether joints keep to their limits of speed and torque, or to what they do today."""
        joints = self._twin.robot.joints
        for limit, values, today in (
            ("velocity", moved.dq, self._motion.dq),
            ("effort", self._twin.joint_torque(moved), self._twin.joint_torque(self._motion)),
        ):
            most = np.maximum([getattr(joint, limit) for joint in joints], np.abs(today).max(axis=0))
            if (np.abs(values) > most).any():
                return False
        return True

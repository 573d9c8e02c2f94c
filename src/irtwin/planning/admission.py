"""Whether a robot can make a motion at all: within its limits, and without touching itself."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from irtwin.errors import InputError
from irtwin.robot.collision import CollisionModel
from irtwin.signals.motion import Motion
from irtwin.twin.twin import Twin

# shares by which a motion from elsewhere may pass a limit: positions and speeds of a log waver, torque is predicted
_POSITION, _SPEED, _TORQUE = 0.01, 0.05, 0.05


def check_motion(twin: Twin, motion: Motion, collisions: CollisionModel, file: Path) -> float:
    """Raise InputError where a robot cannot make a motion: the time, and the limit or the pair of links.

    A motion whose torque, current or power was measured did happen, whatever its sheet says of speed and torque.
    Return the least distance between two of its links, m; infinite where none is checked.
    """
    _check_positions(twin, motion, file)
    if motion.torque is None and motion.current is None and motion.power is None:
        _check_drives(twin, motion, file)
    meeting, clearance = collisions.first_meeting(motion.time, motion.q)
    if meeting is not None:
        raise InputError(f"{file}: at {meeting.time:.3f} s {meeting}; give a motion that does not collide")
    return clearance


def _check_positions(twin: Twin, motion: Motion, file: Path) -> None:
    for joint, q in zip(twin.robot.joints, motion.q.T, strict=True):
        room = _POSITION * (joint.upper - joint.lower) if np.isfinite(joint.upper - joint.lower) else 0.0
        beyond = (q < joint.lower - room) | (q > joint.upper + room)
        if beyond.any():
            row = int(np.argmax(beyond))
            raise InputError(
                f"{file}: at {motion.time[row]:.3f} s {joint.name} is at {q[row]:.4g} {joint.unit}, outside its "
                f"limits, {joint.lower:.4g} to {joint.upper:.4g} {joint.unit}; give a motion within them"
            )


def _check_drives(twin: Twin, motion: Motion, file: Path) -> None:
    torque = twin.joint_torque(motion)
    for number, joint in enumerate(twin.robot.joints):
        force = "N" if joint.kind == "prismatic" else "N m"
        for verb, values, limit, room, unit in (
            ("moves at", motion.dq[:, number], joint.velocity, _SPEED, f"{joint.unit}/s"),
            ("takes", torque[:, number], joint.effort, _TORQUE, force),
        ):
            beyond = np.abs(values) > (1 + room) * limit
            if beyond.any():
                row = int(np.argmax(beyond))
                raise InputError(
                    f"{file}: at {motion.time[row]:.3f} s {joint.name} {verb} {abs(values[row]):.4g} {unit}, above its "
                    f"limit of {limit:.4g} {unit}; give a slower motion"
                )

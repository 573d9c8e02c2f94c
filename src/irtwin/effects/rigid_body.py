"""The rigid bodies that a robot moves."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
import pinocchio as pin

from irtwin.effects.effect import Effect, Term
from irtwin.robot.description import Robot
from irtwin.robot.kinematics import flange
from irtwin.signals.motion import Motion

# Pinocchio's order; first moments and inertias about the joint's frame
NAMES = ("m", "mx", "my", "mz", "Ixx", "Ixy", "Iyy", "Ixz", "Iyz", "Izz")
_UNITS = ("kg",) + ("kg m",) * 3 + ("kg m^2",) * 6
_SPREAD = 50.0  # kg: no link of an arm that lifts up to some ten kg is farther off


class RigidBody(Effect):
    """M(q) ddq + C(q, dq) dq + G(q): linear in ten inertial parameters per moving body (Yan 2018, eqs. 1, 2)."""

    id: ClassVar[str] = "rigid_body"
    channel: ClassVar[str] = "torque"

    def terms(self, robot: Robot) -> tuple[Term, ...]:
        """Return ten terms per moving body, expected as in the URDF."""
        model = robot.model
        spread = max(_SPREAD, robot.weight or 0.0)
        reach = sum(float(np.linalg.norm(place.translation)) for place in model.jointPlacements[1:]) / model.njoints
        arm = max(reach, 0.1)
        spreads = [spread] + [spread * arm] * 3 + [spread * arm**2] * 6
        return tuple(
            Term(name, unit, joint=joint, link=_body(model, index), expected=float(value), spread=width)
            for index, joint in enumerate(model.names[1:], start=1)
            for name, unit, value, width in zip(
                NAMES, _UNITS, model.inertias[index].toDynamicParameters(), spreads, strict=True
            )
        )

    def columns(self, robot: Robot, motion: Motion, torque: np.ndarray | None = None) -> np.ndarray:
        """Return the (N, n, 10 n) torque regressor."""
        model = robot.model
        data = model.createData()
        regressor = np.empty((len(motion.time), model.nv, 10 * model.nv))
        regress = pin.computeJointTorqueRegressor
        for row, state in enumerate(zip(motion.q, motion.dq, motion.ddq, strict=True)):
            regressor[row] = regress(model, data, *state)
        return regressor

    def shift(self, robot: Robot, motion: Motion) -> np.ndarray:
        """Return the payload that the controller was told, as a point mass on the last body."""
        model = robot.model
        added = np.zeros(10 * model.nv)
        if motion.payload_mass:
            frame = model.frames[model.getFrameId(flange(robot), pin.FrameType.BODY)]
            centre = frame.placement.act(np.array(motion.payload_com, dtype=float))
            load = pin.Inertia(motion.payload_mass, centre, np.zeros((3, 3)))
            first = 10 * (frame.parentJoint - 1)
            added[first : first + 10] = load.toDynamicParameters()
        return added


def _body(model: pin.Model, joint: int) -> str | None:
    """Return the link that the joint moves: of those fixed together, the one next to the joint."""
    for frame in model.frames:
        if frame.type == pin.FrameType.BODY and frame.parentJoint == joint:
            return str(frame.name)
    return None

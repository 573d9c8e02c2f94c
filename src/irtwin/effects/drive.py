"""The drives: rotors that turn with the joints, and windings that heat."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from irtwin.effects.effect import Effect, JointEffect, Term, force_unit, inertia_unit
from irtwin.robot.description import Joint, Robot
from irtwin.signals.motion import Motion


class RotorInertia(JointEffect):
    """Ia ddq: rotor and gear, reflected to the joint."""

    id: ClassVar[str] = "rotor_inertia"
    channel: ClassVar[str] = "torque"

    def term(self, joint: Joint) -> Term:
        """Return Ia, expected as the data sheet says."""
        expected = joint.rotor_inertia or 0.0
        return Term("Ia", inertia_unit(joint), joint=joint.name, expected=expected, spread=5.0, lowest=0.0)

    def column(self, motion: Motion) -> np.ndarray:
        """Return ddq."""
        return motion.ddq


class CopperLoss(Effect):
    """R i^2, the current i being predicted torque by torque constant.

    Where no torque constant is known the coefficient multiplies the torque squared, W/(N m)^2.
    """

    id: ClassVar[str] = "copper_loss"
    channel: ClassVar[str] = "power"

    def terms(self, robot: Robot) -> tuple[Term, ...]:
        """Return R per joint, expected as the data sheet says."""
        return tuple(
            Term("R", "ohm", joint=joint.name, expected=joint.winding_resistance or 0.0, spread=20.0, lowest=0.0)
            if joint.torque_constant
            else Term("R", f"W/({force_unit(joint)})^2", joint=joint.name, spread=1.0, lowest=0.0)
            for joint in robot.joints
        )

    def columns(self, robot: Robot, motion: Motion, torque: np.ndarray | None = None) -> np.ndarray:
        """Return (N, n) currents squared."""
        assert torque is not None
        constants = np.array([joint.torque_constant or 1.0 for joint in robot.joints])
        return np.asarray((torque / constants) ** 2)

"""The drives: rotors that turn with the joints, and windings that heat.

What a data sheet says of them is taken to be as unsure as it is large: it leaves out gears, phases and warmth.
"""

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
        known = joint.rotor_inertia
        return Term("Ia", inertia_unit(joint), joint.name, expected=known or 0.0, spread=known or 5.0, lowest=0.0)

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
            Term("R", "ohm", joint.name, expected=known or 0.0, spread=known or 20.0, lowest=0.0)
            if joint.torque_constant
            else Term("R", f"W/({force_unit(joint)})^2", joint.name, spread=1.0, lowest=0.0)
            for joint in robot.joints
            for known in [joint.winding_resistance]
        )

    def columns(self, robot: Robot, motion: Motion, torque: np.ndarray | None = None) -> np.ndarray:
        """Return (N, n) currents squared."""
        assert torque is not None
        constants = np.array([joint.torque_constant or 1.0 for joint in robot.joints])
        return np.asarray((torque / constants) ** 2)

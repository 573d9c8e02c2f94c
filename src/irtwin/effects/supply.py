"""What the supply delivers: mechanical power, and what the controller takes at rest."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from irtwin.effects.effect import Effect, Term
from irtwin.robot.description import Robot
from irtwin.signals.motion import Motion


class MechanicalPower(Effect):
    """sum_j tau_j dq_j (Yan 2018, eq. 7 and the sum in eq. 8): a coefficient of one in every joint."""

    id: ClassVar[str] = "mechanical_power"
    channel: ClassVar[str] = "power"

    def terms(self, robot: Robot) -> tuple[Term, ...]:
        """Return a fixed one per joint."""
        return tuple(Term("", "1", joint=joint.name, expected=1.0, fixed=True) for joint in robot.joints)

    def columns(self, robot: Robot, motion: Motion, torque: np.ndarray | None = None) -> np.ndarray:
        """Return (N, n) tau_j dq_j."""
        assert torque is not None
        return np.asarray(torque * motion.dq)


class StandbyPower(Effect):
    """P0: controller, fans, brakes held open; Pconstant of Yan 2018, eq. 8."""

    id: ClassVar[str] = "standby_power"
    channel: ClassVar[str] = "power"

    def terms(self, robot: Robot) -> tuple[Term, ...]:
        """Return P0."""
        return (Term("P0", "W", spread=600.0, lowest=0.0),)

    def columns(self, robot: Robot, motion: Motion, torque: np.ndarray | None = None) -> np.ndarray:
        """Return (N, 1) ones."""
        return np.ones((len(motion.time), 1))

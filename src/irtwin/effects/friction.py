"""Friction in the joints (Yan 2018, eq. 3)."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from irtwin.effects.effect import JointEffect, Term, force_unit
from irtwin.robot.description import Joint
from irtwin.signals.motion import Motion

_STANDSTILL = 1e-3  # rad/s: below, the sign of a speed is that of its noise


class CoulombFriction(JointEffect):
    """Fc sign(dq). At standstill friction holds what it has to, up to Fc either way: undecided, predicted as none."""

    id: ClassVar[str] = "coulomb_friction"
    channel: ClassVar[str] = "torque"

    def term(self, joint: Joint) -> Term:
        """Return Fc."""
        return Term("Fc", force_unit(joint), joint=joint.name, spread=15.0, lowest=0.0)

    def column(self, motion: Motion) -> np.ndarray:
        """Return sign(dq)."""
        return np.where(self.undecided(motion), 0.0, np.sign(motion.dq))

    def undecided(self, motion: Motion) -> np.ndarray:
        """Return where a joint stands still."""
        return np.asarray(np.abs(motion.dq) < _STANDSTILL)


class ViscousFriction(JointEffect):
    """Fv dq."""

    id: ClassVar[str] = "viscous_friction"
    channel: ClassVar[str] = "torque"

    def term(self, joint: Joint) -> Term:
        """Return Fv."""
        return Term("Fv", f"{force_unit(joint)} s/{joint.unit}", joint=joint.name, spread=30.0, lowest=0.0)

    def column(self, motion: Motion) -> np.ndarray:
        """Return dq."""
        return motion.dq

"""What a torque measurement shows beside the torque."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from irtwin.effects.effect import JointEffect, Term, force_unit
from irtwin.robot.description import Joint
from irtwin.signals.motion import Motion


class TorqueOffset(JointEffect):
    """c: the reading where there is no torque."""

    id: ClassVar[str] = "torque_offset"
    channel: ClassVar[str] = "measurement"

    def term(self, joint: Joint) -> Term:
        """Return c."""
        return Term("c", force_unit(joint), joint=joint.name, spread=5.0)

    def column(self, motion: Motion) -> np.ndarray:
        """Return ones."""
        return np.ones_like(motion.dq)

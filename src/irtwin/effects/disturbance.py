"""What does not repeat: a torque that swings by itself, a load beside the robot that goes on and off."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from irtwin.effects.effect import Coefficients, Effect, JointEffect, Predicted, Quantity, Term, force_unit, quantity
from irtwin.robot.description import Joint, Robot
from irtwin.signals.motion import Motion


@dataclass(frozen=True)
class PeriodicDisturbance(JointEffect):
    """a cos(2 pi f t) + b sin(2 pi f t): a torque that swings at its own frequency, whatever the robot does."""

    id: ClassVar[str] = "periodic_disturbance"
    family: ClassVar[str] = "environment"
    disturbance: ClassVar[str | None] = "line"
    manual_test: ClassVar[str | None] = "holding one pose for a minute, twice, with pumps and fans around on, then off"
    ranges: ClassVar[dict[str, tuple[float, float]]] = {"f": (0.3, 500.0)}

    f: float = 1.0  # Hz

    def joint_terms(self, joint: Joint) -> tuple[Term, ...]:
        """Return the torques that go with cosine and sine of the run's clock."""
        return tuple(Term(name, force_unit(joint), joint.name, spread=20.0) for name in ("a", "b"))

    def samples(self, robot: Robot, motion: Motion, predicted: Predicted | None) -> tuple[np.ndarray, ...]:
        """Return cosine and sine."""
        angle = np.broadcast_to(2 * np.pi * self.f * motion.time[:, None], motion.dq.shape)
        return np.cos(angle), np.sin(angle)

    def parameters(self, robot: Robot, given: Coefficients) -> tuple[Quantity, ...]:
        """Return frequency and amplitude."""
        quantities = []
        for place, joint in enumerate(self.acting(robot)):
            amplitude, deviation = given.size(slice(2 * place, 2 * place + 2))
            quantities.append(quantity("f", joint.name, self.f, "Hz"))
            quantities.append(quantity("A", joint.name, amplitude, force_unit(joint), deviation))
        return tuple(quantities)


@dataclass(frozen=True)
class SwitchingLoad(Effect):
    """P while on: a compressor, a heater or a fan on the same supply, `duty` of each `period` from `start` on."""

    id: ClassVar[str] = "switching_load"
    family: ClassVar[str] = "supply"
    disturbance: ClassVar[str | None] = "switching"
    manual_test: ClassVar[str | None] = "logging power for ten minutes with the robot at rest"
    channel: ClassVar[str] = "power"
    signal: ClassVar[str] = "power"
    ranges: ClassVar[dict[str, tuple[float, float]]] = {"period": (0.2, 3600.0), "duty": (0.0, 1.0)}

    period: float = 10.0  # s
    duty: float = 0.5
    start: float = 0.0  # s of the run's clock

    def terms(self, robot: Robot) -> tuple[Term, ...]:
        """Return P."""
        return (Term("P", "W", spread=500.0, lowest=0.0),)

    def columns(self, robot: Robot, motion: Motion, predicted: Predicted | None = None) -> np.ndarray:
        """Return (N, 1) one while on."""
        return (((motion.time - self.start) / self.period % 1 < self.duty).astype(float))[:, None]

    def parameters(self, robot: Robot, given: Coefficients) -> tuple[Quantity, ...]:
        """Return P, the share of time that it is on, and the period."""
        shape = (quantity("duty", None, self.duty, "1"), quantity("period", None, self.period, "s"))
        return (*super().parameters(robot, given), *shape)

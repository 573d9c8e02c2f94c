"""The drives: rotors that turn with the joints, and windings, iron and inverters that heat.

What a data sheet says of them is taken to be as unsure as it is large: it leaves out gears, phases and warmth.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from irtwin.effects.effect import (
    Coefficients,
    JointEffect,
    Possible,
    Predicted,
    Quantity,
    Stated,
    Term,
    force_unit,
    inertia_unit,
    quantity,
    ratio,
)
from irtwin.robot.description import Joint, Robot
from irtwin.signals.motion import Motion

_WARMEST = 180.0  # K above the surroundings: insulation of class H ends there
COPPER = 0.0039  # 1/K: how resistance grows


def currents(robot: Robot, predicted: Predicted | None) -> np.ndarray:
    """Return (N, n) predicted currents, A; torques where no torque constant is known."""
    assert predicted is not None
    return np.asarray(predicted.torque / np.array([joint.torque_constant or 1.0 for joint in robot.joints]))


@dataclass(frozen=True)
class RotorInertia(JointEffect):
    """Ia ddq: rotor and gear, reflected to the joint."""

    id: ClassVar[str] = "rotor_inertia"
    family: ClassVar[str] = "bodies"
    in_mjcf: ClassVar[Mapping[str, str]] = {"Ia": "armature"}

    def joint_terms(self, joint: Joint) -> tuple[Term, ...]:
        """Return Ia, expected as the data sheet says."""
        known = joint.rotor_inertia
        return (Term("Ia", inertia_unit(joint), joint.name, expected=known or 0.0, spread=known or 5.0, lowest=0.0),)

    def samples(self, robot: Robot, motion: Motion, predicted: Predicted | None) -> tuple[np.ndarray, ...]:
        """Return ddq."""
        return (motion.ddq,)


class _DriveLoss(JointEffect):
    """What all of them share: power that a joint's drive turns into heat."""

    family: ClassVar[str] = "drive"
    electrical_loss: ClassVar[bool] = True
    channel: ClassVar[str] = "power"
    signal: ClassVar[str] = "power"


@dataclass(frozen=True)
class CopperLoss(_DriveLoss):
    """R i^2, the current i being predicted torque by torque constant.

    Where no torque constant is known the coefficient multiplies the torque squared, W/(N m)^2.
    """

    id: ClassVar[str] = "copper_loss"
    of_every_drive: ClassVar[bool] = True
    manual_test: ClassVar[str | None] = "log power while holding loaded poses, then unloaded ones, brakes open"
    needs: ClassVar[str | None] = "torque"

    def joint_terms(self, joint: Joint) -> tuple[Term, ...]:
        """Return R, expected as the data sheet says."""
        known = joint.winding_resistance
        if joint.torque_constant:
            return (Term("R", "ohm", joint.name, expected=known or 0.0, spread=known or 20.0, lowest=0.0),)
        return (Term("R", f"W/({force_unit(joint)})^2", joint.name, spread=1.0, lowest=0.0),)

    def samples(self, robot: Robot, motion: Motion, predicted: Predicted | None) -> tuple[np.ndarray, ...]:
        """Return currents squared."""
        return (currents(robot, predicted) ** 2,)


@dataclass(frozen=True)
class WindingTemperature(_DriveLoss):
    """R 0.0039 (T - T0) i^2: copper that is warmer than its data sheet. The coefficient is R (T - T0), ohm K.

    Where temperatures were measured, the rise of the winding goes with them, and the coefficient is that where the
    measured one is `rise` above `T0`.
    """

    id: ClassVar[str] = "winding_temperature"
    requires: ClassVar[frozenset[str]] = frozenset({"temperature"})
    alters: ClassVar[str | None] = "copper_loss"
    manual_test: ClassVar[str | None] = "log power and temperatures from a cold start"
    needs: ClassVar[str | None] = "torque"

    T0: float = 25.0  # degC
    rise: float = 30.0  # K

    def joint_terms(self, joint: Joint) -> tuple[Term, ...]:
        """Return R (T - T0)."""
        unit = "ohm K" if joint.torque_constant else f"W K/({force_unit(joint)})^2"
        return (Term("R T", unit, joint.name, spread=80.0 * (joint.winding_resistance or 20.0), lowest=0.0),)

    def samples(self, robot: Robot, motion: Motion, predicted: Predicted | None) -> tuple[np.ndarray, ...]:
        """Return 0.0039 i^2, by the measured rise in units of `rise`."""
        warmth = 1.0 if motion.temperature is None else (motion.temperature - self.T0) / self.rise
        return (COPPER * warmth * currents(robot, predicted) ** 2,)

    def possible(self, robot: Robot, stated: Stated) -> Mapping[str, Possible]:
        """Return how warm a winding gets."""
        return {"T": Possible(0.0, _WARMEST, "a winding that is warmer has burnt")}

    def parameters(self, robot: Robot, given: Coefficients) -> tuple[Quantity, ...]:
        """Return T, the rise, relative to the joint's R; nothing where that is not known."""
        return tuple(
            quantity("T", joint.name, ratio(value, copper), "K", ratio(deviation, copper))
            for joint, value, deviation in zip(self.acting(robot), given.values, given.deviations, strict=True)
            for copper in [given.known.get(("copper_loss", joint.name, "R"), joint.winding_resistance)]
            if copper
        )


@dataclass(frozen=True)
class IronLoss(_DriveLoss):
    """k1 |w| + k2 w^2: hysteresis and eddy currents; w is the motor's speed, the joint's where no gear is known."""

    id: ClassVar[str] = "iron_loss"
    of_every_drive: ClassVar[bool] = True
    manual_test: ClassVar[str | None] = "log power at constant speeds up to the limit in poses without load"

    def joint_terms(self, joint: Joint) -> tuple[Term, ...]:
        """Return k1 and k2."""
        gear = joint.gear_ratio or 1.0
        return (
            Term("k1", f"W s/{joint.unit}", joint.name, spread=50.0 / gear, lowest=0.0),
            Term("k2", f"W s^2/{joint.unit}^2", joint.name, spread=10.0 / gear**2, lowest=0.0),
        )

    def samples(self, robot: Robot, motion: Motion, predicted: Predicted | None) -> tuple[np.ndarray, ...]:
        """Return |w| and w^2."""
        speeds = motion.dq * np.array([joint.gear_ratio or 1.0 for joint in robot.joints])
        return np.abs(speeds), speeds**2


@dataclass(frozen=True)
class InverterLoss(_DriveLoss):
    """V0 |i|: the voltage that transistors and diodes drop."""

    id: ClassVar[str] = "inverter_loss"
    of_every_drive: ClassVar[bool] = True
    manual_test: ClassVar[str | None] = "log power while holding poses of rising load, brakes open"
    needs: ClassVar[str | None] = "torque"

    def joint_terms(self, joint: Joint) -> tuple[Term, ...]:
        """Return V0."""
        unit = "V" if joint.torque_constant else f"W/({force_unit(joint)})"
        return (Term("V0", unit, joint.name, spread=10.0, lowest=0.0),)

    def samples(self, robot: Robot, motion: Motion, predicted: Predicted | None) -> tuple[np.ndarray, ...]:
        """Return |i|."""
        return (np.abs(currents(robot, predicted)),)

"""The drives: current loop, motor torque, and what is lost in copper, iron and inverter."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

COPPER_COEFFICIENT = 0.0039  # 1/K
MAGNET_COEFFICIENT = 0.0011  # 1/K, NdFeB


@dataclass(frozen=True)
class DriveData:
    """Motors and inverters per joint, (n,). `resistance` turns i^2 into the loss of all three phases."""

    gear_ratio: np.ndarray
    rotor_inertia: np.ndarray  # kg m^2, at the motor
    torque_constant: np.ndarray  # N m/A (rms), at the motor, at 25 degC
    resistance: np.ndarray  # ohm, at 25 degC
    iron_loss: np.ndarray  # W at 314 rad/s (3000 rpm)
    inverter_voltage: np.ndarray  # V, drop across the switches
    inverter_resistance: np.ndarray  # ohm
    maximum_torque: np.ndarray  # N m, joint side
    current_time_constant: float  # s

    @property
    def joint_inertia(self) -> np.ndarray:
        """Rotor inertia reflected to the joint, kg m^2."""
        return np.asarray(self.rotor_inertia * self.gear_ratio**2)

    @property
    def joint_torque_constant(self) -> np.ndarray:
        """Torque constant reflected to the joint, N m/A."""
        return np.asarray(self.torque_constant * self.gear_ratio)


@dataclass(frozen=True)
class Losses:
    """Electrical losses per joint, (n,) W."""

    copper: np.ndarray
    iron: np.ndarray
    inverter: np.ndarray

    @property
    def total(self) -> float:
        """All of them together, W."""
        return float(self.copper.sum() + self.iron.sum() + self.inverter.sum())


class Drive:
    """Motors of all joints behind their current loops; the state is the current, (n,) A."""

    def __init__(self, data: DriveData) -> None:
        self.data = data
        self.current = np.zeros_like(data.gear_ratio)

    def torque(self, wanted: np.ndarray, magnet_temperature: np.ndarray, step: float) -> np.ndarray:
        """Let the current follow the wanted joint torque for `step` s; return the real one, (n,) N m."""
        d = self.data
        wanted_current = wanted / d.joint_torque_constant
        self.current = self.current + (1 - np.exp(-step / d.current_time_constant)) * (wanted_current - self.current)
        weakened = 1 - MAGNET_COEFFICIENT * (magnet_temperature - 25)
        return np.asarray(d.joint_torque_constant * weakened * self.current)

    def losses(self, dq: np.ndarray, winding_temperature: np.ndarray) -> Losses:
        """Return the losses at the present current and the joint speeds `dq`: (n,) rad/s."""
        d = self.data
        i = np.abs(self.current)
        resistance = d.resistance * (1 + COPPER_COEFFICIENT * (winding_temperature - 25))
        iron = d.iron_loss * (np.abs(dq) * d.gear_ratio / 314.16) ** 1.5
        inverter = d.inverter_voltage * i**2 / (i + 0.15) + d.inverter_resistance * i**2
        return Losses(resistance * i**2, iron, inverter)

"""Sensors: encoders, current sensors, thermometers and the power meter, as the log shows them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class SensorData:
    """How well each sensor sees; (n,) where it is per joint."""

    encoder_bits: int  # per turn of the motor
    torque_noise: np.ndarray  # N m, standard deviation
    torque_offset: np.ndarray  # N m, standard deviation over days
    torque_resolution: np.ndarray  # N m
    temperature_resolution: float  # K
    winding_share: float  # how far the thermometer on the housing feels the winding
    meter_time_constant: float  # s
    meter_gain_error: float  # standard deviation, relative
    meter_noise: float  # W, standard deviation
    meter_resolution: float  # W


def encoder_steps(data: SensorData, gear_ratio: np.ndarray) -> np.ndarray:
    """Return the resolution of the motor encoders on the joint side, (n,) rad."""
    return np.asarray(2 * np.pi / 2**data.encoder_bits / gear_ratio)


def quantise(value: np.ndarray | float, resolution: np.ndarray | float) -> np.ndarray:
    """Return the value on the grid of a resolution."""
    return np.asarray(np.round(np.asarray(value) / resolution) * resolution)


class TorqueSensors:
    """Motor current times nominal torque constant and gear ratio, N m."""

    def __init__(self, data: SensorData, offset: np.ndarray, rng: np.random.Generator) -> None:
        self.data, self.offset, self.rng = data, offset, rng

    def read(self, torque: np.ndarray) -> np.ndarray:
        """Return torques (n,) N m as current sensors show them."""
        noise = self.data.torque_noise * self.rng.standard_normal(len(torque))
        return quantise(torque + self.offset + noise, self.data.torque_resolution)


class PowerMeter:
    """A meter in the mains lead; `gain` is its calibration."""

    def __init__(self, data: SensorData, gain: float, power: float, rng: np.random.Generator) -> None:
        self.data, self.gain, self.rng = data, gain, rng
        self.filtered = power

    def advance(self, power: float, step: float) -> None:
        """Let the meter follow a power, W, for `step` s."""
        self.filtered += (1 - np.exp(-step / self.data.meter_time_constant)) * (power - self.filtered)

    def read(self) -> float:
        """Return the power that the meter shows, W."""
        value = self.gain * self.filtered + self.data.meter_noise * self.rng.standard_normal()
        return float(quantise(value, self.data.meter_resolution))

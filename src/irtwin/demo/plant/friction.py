"""Friction of the gears: LuGre bristles, oil that thins with temperature and speed, load, mesh ripple."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class FrictionData:
    """Friction per joint, (n,), at the reference temperature, on the joint side."""

    coulomb: np.ndarray  # N m
    stiction: np.ndarray  # N m, on top of coulomb at standstill
    stribeck_speed: np.ndarray  # rad/s
    viscous: np.ndarray  # N m s/rad, slope at low speed
    thinning_speed: np.ndarray  # rad/s, where the oil's shear thinning sets in
    load: np.ndarray  # share of the load torque
    deflection: np.ndarray  # rad, bristle deflection at breakaway
    mesh_ripple: np.ndarray  # share of coulomb
    mesh_teeth: np.ndarray  # periods a turn of the joint
    reference_temperature: float  # degC
    coulomb_slope: float  # 1/K, falls with temperature
    vogel: float  # K, viscosity ~ exp(vogel / (T + vogel_offset))
    vogel_offset: float  # K


class Friction:
    """The friction torque of all joints; its state is the mean deflection of the bristles."""

    def __init__(self, data: FrictionData, inertia: np.ndarray) -> None:
        """`inertia`: (n,) kg m^2 at the joint, to damp the bristles."""
        self.data = data
        self.stiffness = data.coulomb / data.deflection
        self.damping = 0.4 * np.sqrt(self.stiffness * inertia)
        self.deflection = np.zeros_like(data.coulomb)

    def torque(
        self, q: np.ndarray, dq: np.ndarray, load: np.ndarray, temperature: np.ndarray, step: float
    ) -> np.ndarray:
        """Advance the bristles by `step` (s) and return the friction, (n,) N m, positive against positive speed."""
        d = self.data
        speed = np.abs(dq)
        level = self._coulomb(q, load, temperature) + d.stiction * np.exp(-((speed / d.stribeck_speed) ** 2))
        rate = self.stiffness * speed / level
        old = self.deflection
        self.deflection = (old + step * dq) / (1 + step * rate)  # implicit: stable at any speed
        bristle_speed = (self.deflection - old) / step
        damping = self.damping * np.exp(-((speed / (3 * d.stribeck_speed)) ** 2))
        bristles = self.stiffness * self.deflection + damping * bristle_speed
        return np.asarray(bristles + self._viscous(dq, temperature))

    def _coulomb(self, q: np.ndarray, load: np.ndarray, temperature: np.ndarray) -> np.ndarray:
        d = self.data
        warm = 1 - d.coulomb_slope * (temperature - d.reference_temperature)
        ripple = 1 + d.mesh_ripple * np.sin(d.mesh_teeth * q)
        return np.asarray(d.coulomb * warm * ripple + d.load * np.abs(load))

    def _viscous(self, dq: np.ndarray, temperature: np.ndarray) -> np.ndarray:
        d = self.data
        oil = np.exp(d.vogel / (temperature + d.vogel_offset) - d.vogel / (d.reference_temperature + d.vogel_offset))
        return np.asarray(d.viscous * oil * d.thinning_speed * np.arcsinh(dq / d.thinning_speed))

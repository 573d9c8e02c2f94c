"""Warmth: per joint a winding, and a body of housing, gear and oil."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class ThermalData:
    """Thermal network per joint, (n,): resistances in K/W, capacities in J/K; ambient in degC."""

    winding_resistance: np.ndarray
    winding_capacity: np.ndarray
    body_resistance: np.ndarray
    body_capacity: np.ndarray
    ambient: float


class Thermal:
    """Temperatures of winding and body, (n,) degC each."""

    def __init__(self, data: ThermalData) -> None:
        self.data = data
        self.winding = np.full_like(data.body_capacity, data.ambient)
        self.body = self.winding.copy()

    def advance(self, winding_loss: np.ndarray, body_loss: np.ndarray, seconds: float) -> None:
        """Warm up or cool down for `seconds` under constant losses, (n,) W, in one Euler step."""
        d = self.data
        across = (self.winding - self.body) / d.winding_resistance
        outward = (self.body - d.ambient) / d.body_resistance
        self.winding = self.winding + seconds * (winding_loss - across) / d.winding_capacity
        self.body = self.body + seconds * (body_loss + across - outward) / d.body_capacity

    def wait(self, winding_loss: np.ndarray, body_loss: np.ndarray, seconds: float) -> None:
        """Let minutes or hours pass under mean losses, in steps well below every time constant."""
        steps = max(1, int(np.ceil(seconds / 5.0)))
        for _ in range(steps):
            self.advance(winding_loss, body_loss, seconds / steps)

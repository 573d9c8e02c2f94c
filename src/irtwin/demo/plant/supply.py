"""The supply: rectifier, bus capacitor, brake chopper, and the controller that always draws power."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class SupplyData:
    """One DC bus for all axes, behind a diode bridge."""

    standby: float  # W, controller, fans and released brakes, straight from the mains
    mains_voltage: float  # V, rectified
    source_resistance: float  # ohm
    diode_drop: float  # V
    capacitance: float  # F
    chopper_on: float  # V
    chopper_off: float  # V
    chopper_resistance: float  # ohm


@dataclass(frozen=True)
class Flow:
    """Where the power goes in one step, W."""

    grid: float
    rectifier: float
    chopper: float


class Supply:
    """The bus voltage (V) and whether the chopper is on."""

    def __init__(self, data: SupplyData) -> None:
        self.data = data
        self.voltage = data.mains_voltage - data.diode_drop
        self.chopping = False

    @property
    def stored(self) -> float:
        """Energy in the bus capacitor, J."""
        return 0.5 * self.data.capacitance * self.voltage**2

    def advance(self, demand: float, step: float) -> Flow:
        """Feed the axes with `demand` (W, negative: they give back) for `step` s."""
        d = self.data
        if self.voltage > d.chopper_on:
            self.chopping = True
        elif self.voltage < d.chopper_off:
            self.chopping = False
        current = max(0.0, (d.mains_voltage - d.diode_drop - self.voltage) / d.source_resistance)
        into_bus = current * self.voltage
        chopper = self.voltage**2 / d.chopper_resistance if self.chopping else 0.0
        energy = self.stored + step * (into_bus - demand - chopper)
        self.voltage = (2 * energy / d.capacitance) ** 0.5
        drawn = d.mains_voltage * current
        return Flow(grid=d.standby + drawn, rectifier=drawn - into_bus, chopper=chopper)

"""What the logger of a fleet writes: torque, power, temperatures and poses as sensors show them, with effects."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from irtwin.demo.plant.drive import COPPER_COEFFICIENT
from irtwin.demo.plant.machine import Machine
from plant.effects import Effect
from plant.fleet import Traces

SENSOR_LAG = 2e-4  # s, of the current sensors: a drive samples at 4 to 16 kHz


def lagged(signal: np.ndarray, time_constant: float, step: float) -> np.ndarray:
    """Return a signal (T, ...) behind a first-order lag that starts at its first value."""
    blend = 1 - np.exp(-step / max(time_constant, 1e-9))
    out, value = np.empty_like(signal), signal[0].copy()
    for row, now in enumerate(signal):
        value = value + blend * (now - value)
        out[row] = value
    return out


def torque(traces: Traces, machine: Machine, effects: tuple[Effect, ...], step: float) -> np.ndarray:
    """Return the torque that the log shows, before noise: (T, R, n)."""
    n = traces.q.shape[2]
    true = lagged(traces.torque, SENSOR_LAG, step)
    seen = true.copy()
    time = step * np.arange(len(seen))[:, None, None]
    for effect in effects:
        mask = effect.mask(n)
        if effect.id == "torque_constant_error":
            seen += mask * true * (1 - 0.1 * (true / machine.drive.maximum_torque) ** 2)
        elif effect.id == "torque_drift":
            seen += mask * 12.0 * (1 - np.exp(-time / 12.0))
        elif effect.id == "time_delay":
            late = lagged(lagged(true, effect.strength / 2, step), effect.strength / 2, step)
            seen = np.where(mask > 0, late, seen)
        elif effect.id == "crosstalk":
            seen += mask * np.roll(true, 1, axis=2)
        elif effect.id == "field_weakening":
            seen += mask * true * traces.dq**2
    return seen + machine.torque_offset


def power(traces: Traces, machine: Machine, effects: tuple[Effect, ...], step: float) -> np.ndarray:
    """Return the power that the meter shows, before noise: (T, R) W. Without effects: mechanical and standby."""
    drive, by_id = machine.drive, {effect.id: effect for effect in effects}
    speed = np.abs(traces.dq)
    current = np.abs(traces.torque) / drive.joint_torque_constant
    runs = np.ones((traces.q.shape[1], 1))

    def strength(name: str) -> np.ndarray:
        effect = by_id.get(name)
        return effect.strength * effect.runs[:, None] if effect else 0 * runs

    copper = drive.resistance * current**2
    losses = strength("copper_loss") * copper * (1 + 0.05 * (1 - np.exp(-speed)))
    losses = losses + COPPER_COEFFICIENT * winding_rise(effects, traces, step) * copper
    losses = losses + strength("iron_loss") * drive.iron_loss * (speed * drive.gear_ratio / 314.16) ** 1.5
    losses = losses + strength("inverter_loss") * 2.0 * current**2 / (current + 0.15)
    axes = (traces.torque * traces.dq + losses).sum(axis=2)
    axes = _bus(axes, strength("no_regeneration")[:, 0], strength("bus_capacitor")[:, 0], step)
    standby = machine.drawings.supply.standby
    total = axes + standby + strength("holding_brakes")[:, 0] * released(traces, step)
    time = step * np.arange(len(total))[:, None]
    total = total + strength("cycling_fan")[:, 0] * (np.sin(2 * np.pi * time / 2.7) > 0.4)
    total = total * (1 + strength("meter_gain")[:, 0] * (1 - 2e-5 * total))
    lag = by_id.get("meter_lag")
    seen = lagged(total, machine.drawings.sensors.meter_time_constant, step)
    if lag is None:
        return seen
    return np.where(lag.runs, lagged(lagged(seen, lag.strength / 2, step), lag.strength / 2, step), seen)


def winding_rise(effects: Iterable[Effect], traces: Traces, step: float) -> np.ndarray:
    """Return how much warmer the windings are than their twin thinks: (T, R, 1) K."""
    time = step * np.arange(len(traces.q))[:, None, None]
    rise = np.zeros((*traces.q.shape[:2], 1))
    for effect in effects:
        if effect.id == "winding_temperature":
            warm = 45 * effect.shape["warmth"][:, None] + 12 * (1 - np.exp(-time / 5))
            rise += effect.strength * warm * effect.runs[:, None]
    return rise


def _bus(axes: np.ndarray, burnt: np.ndarray, capacity: np.ndarray, step: float) -> np.ndarray:
    """Return what the mains gives: (T, R) W. A capacitor (J) is filled by returned energy and emptied first."""
    if not burnt.any() and not capacity.any():
        return axes
    grid, stored = np.empty_like(axes), np.zeros(axes.shape[1])
    for row, demand in enumerate(axes):
        into = np.where(demand < 0, np.minimum(-demand * step, capacity - stored), -np.minimum(demand * step, stored))
        into = np.where(capacity > 0, into, 0) * (1 - 0.15 * stored / np.maximum(capacity, 1e-9))
        stored = stored + into
        grid[row] = demand + into / step
    return np.where(grid < 0, grid * (1 - burnt), grid)


def released(traces: Traces, step: float) -> np.ndarray:
    """Share of the coils' power: brakes open just before a motion, close 0.4 s after it, and take more to open."""
    moving = (np.abs(traces.dq) > 0.01).any(axis=2)
    reach, early = round(0.4 / step), round(0.05 / step)
    wide = np.zeros_like(moving)
    total = np.vstack([np.zeros((1, moving.shape[1]), int), np.cumsum(moving, axis=0)])
    for row in range(len(moving)):
        low, high = max(0, row - reach), min(len(moving), row + early)
        wide[row] = total[high] > total[low]
    return np.asarray(lagged(wide.astype(float), 0.03, step))


def coloured(rng: np.random.Generator, shape: tuple[int, ...]) -> np.ndarray:
    """Return noise of unit variance: mostly white, a part that wanders over some samples."""
    white, driven = rng.standard_normal(shape), rng.standard_normal(shape)
    slow = lagged(driven, 4.0, 1.0)
    return np.asarray(0.9 * white + 0.43 * slow / slow.std())

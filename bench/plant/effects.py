"""Effects that a plant can be given, each with a strength; their laws are not those of the twin's catalogue.

A law returns what it adds at strength 1, (R, n), for R runs side by side. Lengths rad, torques N m.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np


@dataclass(frozen=True)
class State:
    """What a law may look at in one step, (R, n) each; `time` in s since the log started."""

    time: float
    q: np.ndarray
    dq: np.ndarray
    ddq: np.ndarray
    load: np.ndarray
    temperature: np.ndarray


@dataclass(frozen=True)
class Effect:
    """One effect on some joints (indices) and runs (mask), `strength` times its law."""

    id: str
    joints: tuple[int, ...]
    runs: np.ndarray
    strength: float
    shape: dict[str, Any] = field(default_factory=dict)

    def mask(self, joints: int) -> np.ndarray:
        """Return strength where the effect acts, zero elsewhere: (R, n)."""
        chosen = np.zeros(joints)
        chosen[list(self.joints)] = 1.0
        return self.strength * self.runs[:, None] * chosen

    def at(self, strength: float) -> Effect:
        return replace(self, strength=strength)


Law = Callable[[State, dict[str, Any]], np.ndarray]


def _partner(state: State, joints: tuple[int, int]) -> np.ndarray:
    """Return each joint's partner in a coupled pair, as column order."""
    order = np.arange(state.q.shape[1])
    order[list(joints)] = order[list(joints)[::-1]]
    return order


def _coupling(state: State, shape: dict[str, Any]) -> np.ndarray:
    order = _partner(state, shape["pair"])
    both, other = state.dq + state.dq[:, order], state.dq[:, order]
    return np.asarray(shape["coulomb"] * np.tanh(both / 0.05) + shape["viscous"] * other)


def _strut(state: State, shape: dict[str, Any]) -> np.ndarray:
    """A gas strut between base and arm: its force rises as the gas is pressed together."""
    a, b, gas = 0.10, 0.45, 0.9
    angle = state.q + shape["angle"]
    length = np.sqrt(a * a + b * b + 2 * a * b * np.cos(angle))
    lever = a * b * np.sin(angle) / length
    return np.asarray(lever / (a * b) * (gas / (gas - (b + a - length))) ** 1.3)


def _hose(state: State, shape: dict[str, Any]) -> np.ndarray:
    """A hose that becomes tight beyond an angle, softly at first, and stiffens."""
    beyond = shape["side"] * (state.q - shape["at"])
    tight = 0.03 * np.logaddexp(0, beyond / 0.03)
    return np.asarray(shape["side"] * tight * (1 + 0.4 * tight))


# level of the bristles: what sliding friction is multiplied from
LEVEL: dict[str, Law] = {
    "stribeck_friction": lambda s, p: 1 / (1 + (s.dq / p["speed"]) ** 2),
    "load_dependent_friction": lambda s, p: (np.sqrt(s.load**2 + 4) - 2) * (1 + 0.25 * np.tanh(s.load * s.dq)),
    "position_dependent_friction": lambda s, p: np.exp(1.2 * (np.cos(s.q - p["angle"]) - 1)) - 0.4,
    "warm_run_in": lambda s, p: np.full_like(s.q, np.exp(-s.time / 2.5)),
    "local_wear": lambda s, p: 1 / (1 + ((s.q - p["at"]) / p["width"]) ** 4),
}
# torque against the motion or the pose
PASSIVE: dict[str, Law] = {
    "nonlinear_viscous_friction": lambda s, p: (
        p["sign"] * np.arcsinh(s.dq / p["speed"]) if p["thinning"] else s.dq * np.abs(s.dq) / (1 + 0.1 * np.abs(s.dq))
    ),
    "asymmetric_friction": lambda s, p: np.tanh(np.abs(s.dq) / 0.03) * (1 + 0.3 * np.sqrt(np.abs(s.dq))),
    "temperature_dependent_friction": lambda s, p: (
        s.dq * (np.exp(700 / (s.temperature + 95) - 700 / 130.0) - 1)  # Vogel
    ),
    "torque_ripple": lambda s, p: np.sin(p["order"] * s.q + p["phase"]) + 0.25 * np.sin(2 * p["order"] * s.q),
    "cable_drag": lambda s, p: (s.q - p["rest"]) + 0.15 * (s.q - p["rest"]) ** 3,
    "gravity_compensation": _strut,
    "joint_coupling": _coupling,
    "joint_limit_spring": _hose,
    "machine_shake": lambda s, p: np.full_like(s.q, np.sin(2 * np.pi * p["frequency"] * s.time)),
}
# what the log says of the torque, after the fact; (T, n) arrays of one run
SENSED = {"torque_constant_error", "torque_drift", "time_delay", "crosstalk", "field_weakening"}
POWER = {
    "copper_loss",
    "winding_temperature",
    "iron_loss",
    "inverter_loss",
    "no_regeneration",
    "bus_capacitor",
    "holding_brakes",
    "meter_lag",
    "meter_gain",
    "cycling_fan",
}
ARM = {"payload", "base_tilt", "external_contact"}
TRANSMISSION = {"joint_elasticity", "backlash"}
UNKNOWN = ("warm_run_in", "machine_shake", "crosstalk", "field_weakening", "cycling_fan")

"""What a case can hold: each effect with the joints it may sit on, a first strength and the most that it may have."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from irtwin.demo.plant.machine import Machine
from plant.effects import UNKNOWN, Effect

TORQUE = (
    "stribeck_friction",
    "nonlinear_viscous_friction",
    "asymmetric_friction",
    "load_dependent_friction",
    "temperature_dependent_friction",
    "presliding_hysteresis",
    "backlash",
    "joint_elasticity",
    "torque_ripple",
    "position_dependent_friction",
    "joint_coupling",
    "cable_drag",
    "gravity_compensation",
    "payload",
    "base_tilt",
    "external_contact",
    "torque_constant_error",
    "torque_drift",
    "encoder_offset",
    "time_delay",
)
POWER = (
    "copper_loss",
    "winding_temperature",
    "iron_loss",
    "inverter_loss",
    "no_regeneration",
    "bus_capacitor",
    "holding_brakes",
    "meter_lag",
    "meter_gain",
)
# about a place of a joint: in splits of their own, as one effect more would change every draw of the others
LOCAL = ("local_wear", "joint_limit_spring")
ALL_JOINTS = {
    "copper_loss",
    "winding_temperature",
    "iron_loss",
    "inverter_loss",
    "machine_shake",
    "field_weakening",
    "warm_run_in",
}
WHOLE_ROBOT = {
    "payload",
    "base_tilt",
    "external_contact",
    "no_regeneration",
    "bus_capacitor",
    "holding_brakes",
    "meter_lag",
    "meter_gain",
}
SLIGHT = ("stribeck_friction", "load_dependent_friction", "torque_ripple", "asymmetric_friction", "cable_drag")
UNKNOWN_EFFECTS = UNKNOWN
# regimes in which an effect shows, in the words of contract/DIAGNOSIS.md
REGIMES = {
    "stribeck_friction": {"low_speed", "reversal"},
    "presliding_hysteresis": {"reversal", "low_speed"},
    "backlash": {"reversal", "low_speed", "accelerating", "braking"},
    "joint_elasticity": {"accelerating", "braking"},
    "time_delay": {"accelerating", "braking", "reversal"},
    "nonlinear_viscous_friction": {"steady_speed", "accelerating", "braking", "low_speed"},
    "load_dependent_friction": {"loaded", "steady_speed", "accelerating", "braking"},
    "copper_loss": {"loaded", "standstill", "accelerating", "braking"},
    "winding_temperature": {"loaded", "standstill", "accelerating", "braking"},
    "inverter_loss": {"loaded", "standstill", "accelerating", "braking"},
    "no_regeneration": {"regenerating", "braking"},
    "bus_capacitor": {"regenerating", "braking", "accelerating"},
    "holding_brakes": {"standstill"},
    "torque_constant_error": {"loaded", "accelerating", "braking", "standstill"},
    "local_wear": {"steady_speed", "accelerating", "braking"},
    "joint_limit_spring": {"reversal", "low_speed", "accelerating", "braking", "standstill"},
}


@dataclass(frozen=True)
class Draw:
    """An effect at its first strength, and the most of it that is still a robot."""

    effect: Effect
    most: float


def draw(name: str, machine: Machine, runs: np.ndarray, everywhere: bool, rng: np.random.Generator) -> Draw:  # noqa: C901
    """Draw joints and shape. `runs`: mask of those that may have it; `everywhere`: it changed since the reference."""
    n = len(machine.drawings.joints)
    fc, fv = machine.friction.coulomb, machine.friction.viscous
    joints = _joints(name, n, rng)
    j = joints[0]
    where = runs.copy()
    shape: dict[str, object] = {}
    guess, most = 1.0, 100.0
    if name == "stribeck_friction":
        shape, guess = {"speed": rng.uniform(0.04, 0.12)}, 0.5 * fc[j]
    elif name == "nonlinear_viscous_friction":
        thinning = rng.random() < 0.7
        shape = {"thinning": thinning, "speed": rng.uniform(0.1, 0.3), "sign": rng.choice([-1, 1])}
        guess = 0.4 * fc[j] if thinning else 0.3 * fv[j]
    elif name == "asymmetric_friction":
        guess = 0.3 * fc[j]
    elif name == "load_dependent_friction":
        guess, most = 0.08, 0.6
    elif name == "temperature_dependent_friction":
        guess, most = 0.8 * fv[j], 8 * fv[j]
    elif name == "presliding_hysteresis":
        guess, most = 0.03, 0.5
    elif name == "backlash":
        guess, most = 2e-3, 0.03
    elif name == "joint_elasticity":
        guess, most = 40.0, 225.0
    elif name == "torque_ripple":
        shape, guess = {"order": int(rng.integers(3, 25)), "phase": rng.uniform(0, 6.28)}, 0.3 * fc[j]
    elif name == "position_dependent_friction":
        shape, guess, most = {"angle": rng.uniform(-1, 1)}, 0.4 * fc[j], 4 * fc[j]
    elif name == "joint_coupling":
        shape = {"pair": joints, "coulomb": 0.5, "viscous": 0.4}
        guess = 0.6 * fc[j]
    elif name == "cable_drag":
        shape, guess = {"rest": rng.uniform(-0.5, 0.5)}, 0.4 * fc[j]
    elif name == "local_wear":
        middle, half = _range(machine, j)
        shape = {"at": middle + half * rng.uniform(-0.4, 0.4), "width": rng.uniform(0.06, 0.18)}
        guess, most = fc[j], 8 * fc[j]
    elif name == "joint_limit_spring":
        (middle, half), side = _range(machine, j), float(rng.choice([-1, 1]))
        shape = {"at": middle + side * half * rng.uniform(0.2, 0.45), "side": side}
        guess, most = 3 * fc[j], 200 * fc[j]
    elif name == "gravity_compensation":
        shape, guess, most = {"angle": rng.uniform(0.3, 0.8)}, 5 * fc[j], 200 * fc[j]
    elif name == "payload":
        shape = {"com": tuple(rng.uniform([-0.05, -0.05, 0.0], [0.05, 0.05, 0.1]))}
        guess, most = 0.1 * machine.drawings.rated_payload, 1.5 * machine.drawings.rated_payload
        if not everywhere:
            where &= rng.random(len(runs)) < 0.5
            where[rng.choice(np.flatnonzero(runs))] = True
    elif name == "base_tilt":
        shape, guess, most = {"towards": rng.uniform(0, 6.28)}, 0.02, 0.3
    elif name == "external_contact":
        direction = rng.standard_normal(3)
        shape = {
            "start": rng.uniform(1.5, 4),
            "length": rng.uniform(1.0, 2.5),
            "direction": tuple(direction / np.linalg.norm(direction)),
        }
        guess, most = 15.0, 400.0
        few = rng.choice(np.flatnonzero(runs), size=min(3, runs.sum()), replace=False)
        where = np.isin(np.arange(len(runs)), few)
    elif name == "torque_constant_error":
        guess, most = 0.06 * rng.choice([-1, 1]), 0.5
    elif name == "torque_drift":
        guess = 0.02 * fc[j] * rng.choice([-1, 1])
    elif name == "encoder_offset":
        shape, guess, most = {"phase": rng.uniform(0, 6.28)}, 0.01 * rng.choice([-1, 1]), 0.15
    elif name == "time_delay":
        guess, most = 0.02, 0.6
    elif name == "winding_temperature":
        shape, guess, most = {"warmth": rng.permutation(np.linspace(0, 1, len(runs)))}, 1.0, 2.5
    elif name == "no_regeneration":
        guess, most = 0.5, 1.0
    elif name == "bus_capacitor":
        guess, most = 30.0, 600.0
    elif name == "holding_brakes":
        guess, most = 20.0, 200.0
    elif name == "meter_lag":
        guess, most = 0.08, 2.0
    elif name == "meter_gain":
        guess, most = 0.05 * rng.choice([-1, 1]), 0.5
    elif name == "warm_run_in":
        guess = float(fc.mean() * 0.3)
    elif name == "machine_shake":
        shape, guess = {"frequency": rng.uniform(1.5, 4)}, 0.2 * fc[j]
    elif name == "crosstalk":
        guess, most = 0.1, 2.0
    elif name == "field_weakening":
        guess, most = 0.03, 0.5
    elif name == "cycling_fan":
        guess, most = 10.0, 200.0
    return Draw(Effect(name, joints, where, guess, shape), most)


def _range(machine: Machine, joint: int) -> tuple[float, float]:
    """Return the middle of a joint's range, and half of what motions use of it, rad."""
    limits = machine.drawings.limits
    lower, upper = float(limits.lower[joint]), float(limits.upper[joint])
    return (upper + lower) / 2, min((upper - lower) / 2, 1.6)


def _joints(name: str, n: int, rng: np.random.Generator) -> tuple[int, ...]:
    if name in ALL_JOINTS or name in WHOLE_ROBOT or name == "cycling_fan":
        return tuple(range(n))
    if name == "joint_coupling":
        return (n - 2, n - 1)
    if name == "gravity_compensation":
        return (1,)
    eligible = {
        "load_dependent_friction": [1, 2] if n < 7 else [1, 3],
        "encoder_offset": [1, 2] if n < 7 else [1, 3],
        "joint_elasticity": list(range(3)),
        "backlash": list(range(3)),
        "torque_constant_error": list(range(n - 1)),
        "time_delay": list(range(3)),
        "crosstalk": [1, 2],
        "local_wear": list(range(n - 1)),
        "joint_limit_spring": list(range(n - 1)),
    }.get(name, list(range(n)))
    count = (
        2
        if rng.random() < 0.2 and name not in {"encoder_offset", "joint_elasticity", "backlash", "crosstalk", *LOCAL}
        else 1
    )
    return tuple(sorted(int(j) for j in rng.choice(eligible, size=min(count, len(eligible)), replace=False)))

"""Effects that a machine can be given, by MuJoCo's own means where it has them, else as forces or in the log.

An effect acts on some runs and joints (indices), `strength` times; what its shape holds is drawn.
"""

from __future__ import annotations

import copy
from dataclasses import dataclass, field, replace
from typing import Any

import mujoco
import numpy as np

from closed_loop.machine import Machine

# changed since the reference only: a twin has them
IN_THE_TWIN = ("coulomb_friction", "viscous_friction", "rotor_inertia", "torque_offset")
# missing only: it needs runs of all temperatures
NEVER_CHANGED = ("temperature_dependent_friction",)
EITHER = (
    "payload",
    "cable_drag",
    "gravity_compensation",
    "joint_coupling",
    "base_tilt",
    "stribeck_friction",
    "nonlinear_viscous_friction",
    "asymmetric_friction",
    "external_contact",
    "torque_ripple",
    "torque_constant_error",
    "torque_drift",
    "time_delay",
)
WHOLE_ROBOT = ("payload", "base_tilt", "external_contact")
RAMP = 0.1  # s, in which a contact comes and goes
TURN = 0.01  # rad/s, over which the sign of added friction turns
COLD = 30.0  # degC, at which a joint's damping is what the model says


@dataclass(frozen=True)
class Effect:
    """One effect on some joints (indices) and runs (mask); `most` bounds its strength."""

    id: str
    joints: tuple[int, ...]
    runs: np.ndarray
    strength: float
    most: float
    shape: dict[str, Any] = field(default_factory=dict)

    def at(self, strength: float) -> Effect:
        return replace(self, strength=float(np.clip(strength, -self.most, self.most)))


def draw(name: str, machine: Machine, runs: np.ndarray, missing: bool, rng: np.random.Generator) -> Effect:  # noqa: C901
    """Draw joints, shape and a first strength; `runs`: mask of those that were observed."""
    n = len(machine.model.joints)
    real, torque = machine.real, machine.model.torque
    joint = int(rng.integers(n))
    sign = float(rng.choice([-1, 1]))
    shape: dict[str, Any] = {}
    guess, most = 1.0, 1.0
    where = runs.copy()
    if name == "payload":
        shape = {"com": rng.uniform([-0.05, -0.05, 0.0], [0.05, 0.05, 0.12])}
        guess, most = 0.3, 0.04 * float(torque[1]) + 0.5
        if missing:
            few = rng.permutation(np.flatnonzero(runs))[: max(runs.sum() // 2, 1)]
            where = np.isin(np.arange(len(runs)), few)
    elif name == "cable_drag":
        shape = {"rest": rng.uniform(-0.8, 0.8)}
        guess, most = 0.02 * torque[joint], 0.3 * torque[joint]
    elif name == "gravity_compensation":
        joint, guess, most = 1, 100.0, 40 * torque[1]
    elif name == "joint_coupling":
        joint, guess, most = n - 2, 0.01 * torque[n - 1], 0.15 * torque[n - 1]
    elif name == "base_tilt":
        shape, guess, most = {"towards": rng.uniform(0, 2 * np.pi)}, 0.01, 0.12
    elif name in {"stribeck_friction", "nonlinear_viscous_friction", "asymmetric_friction", "torque_ripple"}:
        guess, most = 0.3 * real.dof_frictionloss[joint], 1.5 * real.dof_frictionloss[joint]
        shape = {
            "speed": rng.uniform(0.03, 0.1),
            "power": float(rng.choice([0.5, 2.0])),
            "order": int(rng.integers(2, 20)),
            "phase": rng.uniform(0, 2 * np.pi),
        }
        guess *= sign if name == "asymmetric_friction" else 1
    elif name == "external_contact":
        direction = rng.standard_normal(3)
        shape = {
            "direction": direction / np.linalg.norm(direction),
            "start": rng.uniform(0.8, 2.5),
            "length": rng.uniform(1.0, 2.5),
        }
        guess, most = 5.0, 0.6 * float(torque[1])
        few = rng.permutation(np.flatnonzero(runs))[: rng.integers(1, 4)]
        where = np.isin(np.arange(len(runs)), few)
    elif name == "torque_constant_error":
        joint, guess, most = int(rng.integers(n - 1)), 0.05 * sign, 0.4
    elif name == "torque_drift":
        guess, most = 1e-3 * torque[joint] * sign, 0.02 * torque[joint]
    elif name == "torque_offset":
        guess, most = 0.01 * torque[joint] * sign, 0.1 * torque[joint]
    elif name == "time_delay":
        joint, guess, most = int(rng.integers(3)), 0.01, 0.1
    elif name in {"coulomb_friction", "viscous_friction"}:
        guess, most = 0.2 * (sign if rng.random() < 0.5 else 1.0), 1.5
    elif name == "rotor_inertia":
        guess, most = 0.2, 2.0
    elif name == "temperature_dependent_friction":
        guess, most = 0.01, 0.06
    joints = (n - 2, n - 1) if name == "joint_coupling" else (joint,)
    return Effect(name, joints, where, guess, float(most), shape)


def altered(machine: Machine, effects: tuple[Effect, ...], run: int, friction: float = 1.0) -> mujoco.MjModel:
    """Return the robot of one run: the model with what the effects change in it, and its friction `friction` times."""
    model = copy.copy(machine.real)
    model.dof_frictionloss[:] *= friction
    model.dof_damping[:] *= friction
    for effect in effects:
        if effect.runs[run]:
            _alter(model, effect)
    mujoco.mj_setConst(model, mujoco.MjData(model))
    return model


def _alter(model: mujoco.MjModel, effect: Effect) -> None:
    joint, size = effect.joints[0], effect.strength
    if effect.id == "payload":
        load = model.body("load").id
        model.body_mass[load], model.body_ipos[load] = size, effect.shape["com"]
        model.body_inertia[load] = size * (0.08 * size ** (1 / 3)) ** 2 / 6  # a cube
    elif effect.id == "cable_drag":
        model.jnt_stiffness[joint], model.qpos_spring[joint] = size, _middle(model, joint) + effect.shape["rest"]
    elif effect.id == "gravity_compensation":
        model.tendon_stiffness[model.tendon("counterbalance").id] = size
    elif effect.id == "joint_coupling":
        wrist = model.tendon("wrist").id
        model.tendon_frictionloss[wrist], model.tendon_damping[wrist] = size, 0.5 * size
        model.tendon_solref_fri[wrist] = model.dof_solref[joint]
        model.tendon_solimp_fri[wrist] = model.dof_solimp[joint]
    elif effect.id == "base_tilt":
        towards = effect.shape["towards"]
        weight = np.linalg.norm(model.opt.gravity)
        level = np.sin(size) * np.array([np.cos(towards), np.sin(towards)])
        model.opt.gravity[:] = weight * np.array([*level, -np.cos(size)])
    elif effect.id == "coulomb_friction":
        model.dof_frictionloss[joint] *= max(1 + size, 0.05)
    elif effect.id == "viscous_friction":
        model.dof_damping[joint] *= max(1 + size, 0.05)
    elif effect.id == "rotor_inertia":
        model.dof_armature[joint] *= 1 + size


def _middle(model: mujoco.MjModel, joint: int) -> float:
    return float(model.jnt_range[joint].mean())


def pushed(
    effects: tuple[Effect, ...], model: mujoco.MjModel, data: mujoco.MjData, time: float, warmth: np.ndarray
) -> np.ndarray:
    """Return the joint torque that acts besides the drives', (n,) N m, at the state of `data`; `warmth` (n,) degC."""
    out = np.zeros(model.nv)
    for effect in effects:
        joint = effect.joints[0]
        speed, size, shape = float(data.qvel[joint]), effect.strength, effect.shape
        direction = np.tanh(speed / TURN)
        if effect.id == "stribeck_friction":
            out[joint] -= size * direction * np.exp(-((speed / shape["speed"]) ** 2))
        elif effect.id == "nonlinear_viscous_friction":
            out[joint] -= size * direction * abs(speed) ** shape["power"]
        elif effect.id == "asymmetric_friction":
            out[joint] -= size * (0.3 * abs(direction) + abs(speed))
        elif effect.id == "torque_ripple":
            out[joint] -= size * np.sin(shape["order"] * data.qpos[joint] + shape["phase"])
        elif effect.id == "temperature_dependent_friction":
            thinner = np.exp(-size * (warmth[joint] - COLD)) - 1
            out[joint] -= model.dof_damping[joint] * thinner * speed
        elif effect.id == "external_contact":
            into = time - shape["start"]
            share = np.clip(min(into, shape["length"] - into) / RAMP, 0, 1)
            if share > 0:
                load, pull = model.body("load").id, np.zeros(model.nv)
                force = size * share * shape["direction"]
                mujoco.mj_applyFT(model, data, force, np.zeros(3), data.xipos[load], load, pull)
                out += pull
    return out


def sensed(effects: tuple[Effect, ...], tau: np.ndarray, step: float, run: int) -> np.ndarray:
    """Return the torque (T, n) of one run as the log shows it, before noise."""
    time, seen = step * np.arange(len(tau)), tau.copy()
    for effect in effects:
        if not effect.runs[run]:
            continue
        joint = effect.joints[0]
        if effect.id == "torque_constant_error":
            seen[:, joint] *= 1 + effect.strength
        elif effect.id == "torque_offset":
            seen[:, joint] += effect.strength
        elif effect.id == "torque_drift":
            seen[:, joint] += effect.strength * time
        elif effect.id == "time_delay":
            seen[:, joint] = np.interp(time - abs(effect.strength), time, seen[:, joint])
    return seen

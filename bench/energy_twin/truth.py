"""What is true of a case: the numbers of its robot, and where the energy of its runs went."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np

from irtwin.demo.plant.arm import PlantPayload
from irtwin.demo.plant.machine import Machine
from irtwin.effects.stack import Stack
from irtwin.identification.base_parameters import base_parameters
from irtwin.signals.motion import Motion
from plant.fleet import Traces

Parts = dict[str, np.ndarray]  # by effect
Place = tuple[str, str | None]  # effect and joint, None for the whole robot

_RATED = 314.16  # rad/s
_STATES = 300


@dataclass(frozen=True)
class Truth:
    """True `numbers` by effect, joint and name, where a law of the plant is the catalogue's.

    `energies` by run and effect, J, of the robot or of its n joints; `plain`: friction is dry and viscous alone.
    """

    joints: list[str]
    machine: Machine
    numbers: dict[tuple[str, str | None, str], float]
    energies: dict[str, Parts]
    plain: bool

    def energy(self, run: str, place: Place) -> float | None:
        """Return what a part of a run took, J: nothing where the plant has no such effect; None where not known."""
        effect, joint = place
        parts = self.energies[run]
        if effect not in parts:
            return 0.0 if "kinetic_energy" in parts else None
        return float(parts[effect] if joint is None else parts[effect][self.joints.index(joint)])

    def base(self, stack: Stack) -> np.ndarray:
        """Return the true base parameters of a stack of rigid bodies, rotors, dry and viscous friction and offsets."""
        rng, n = np.random.default_rng(1), len(self.joints)
        q, ddq = (rng.uniform(-most, most, (_STATES, n)) for most in (3, 5))
        dq = rng.uniform(1, 2, (_STATES, n)) * rng.choice([-1, 1], (_STATES, n))  # dry friction as it slides
        arm, friction = self.machine.arm(PlantPayload()), self.machine.friction
        torque = np.array([arm.inverse_dynamics(*state) for state in zip(q, dq, ddq, strict=True)])
        torque = torque + friction.coulomb * np.sign(dq) + friction.viscous * dq + self.machine.torque_offset
        columns = stack.torque_columns(Motion(np.arange(float(_STATES)), q, dq, ddq, run="random"))
        independent = columns[:, :, base_parameters(stack).independent]
        return np.asarray(np.linalg.lstsq(independent.reshape(-1, independent.shape[2]), torque.ravel())[0])


def numbers(machine: Machine, *, exact: bool, more: bool) -> dict[tuple[str, str | None, str], float]:
    """Return the true numbers: `exact` where losses of drives, friction and brakes have the catalogue's laws."""
    drive, friction = machine.drive, machine.friction
    of_joints = {("torque_offset", "c"): machine.torque_offset, ("rotor_inertia", "Ia"): drive.joint_inertia}
    if exact or not more:
        of_joints |= {
            ("coulomb_friction", "Fc"): friction.coulomb,
            ("viscous_friction", "Fv"): friction.viscous,
        }
    if exact:
        of_joints |= {
            ("copper_loss", "R"): drive.resistance,
            ("iron_loss", "k1"): 0.5 * drive.iron_loss / _RATED,
            ("iron_loss", "k2"): 0.5 * drive.iron_loss / _RATED**2,
            ("inverter_loss", "V0"): np.full_like(drive.resistance, 2.0),
        }
    names = machine.drawings.joints
    found: dict[tuple[str, str | None, str], float] = {
        (effect, joint, name): float(values[k])
        for ((effect, name), values), (k, joint) in product(of_joints.items(), enumerate(names))
    }
    return found | {("standby_power", None, "P0"): machine.drawings.supply.standby}


def mechanical(machine: Machine, traces: Traces, friction: Parts) -> Parts:
    """Return the power of joints, (T, R, n) W, by the torque that takes it, where friction (T, R, n) N m is known."""
    work = traces.torque * traces.dq
    if not friction:
        return {"joints": work}
    known = {name: own * traces.dq for name, own in friction.items()}
    turned = (traces.torque != 0) * machine.drive.joint_inertia * traces.ddq
    known["rotor_inertia"] = turned * traces.dq
    arm, still = machine.arm(PlantPayload()), np.zeros(work.shape[2])
    weight = np.array([arm.inverse_dynamics(q, still, still) for q in traces.q.reshape(-1, len(still))])
    known["potential_energy"] = (traces.torque != 0) * weight.reshape(work.shape) * traces.dq
    return {**known, "kinetic_energy": work - sum(known.values())}


def drives(machine: Machine, traces: Traces, *, exact: bool) -> Parts:
    """Return what drives lose, (T, R, n) W: by the catalogue's laws, or by others."""
    drive, speed = machine.drive, np.abs(traces.dq)
    current, turning = np.abs(traces.torque) / drive.joint_torque_constant, speed * drive.gear_ratio / _RATED
    copper = drive.resistance * current**2
    if exact:
        iron, inverter = drive.iron_loss * (0.5 * turning + 0.5 * turning**2), 2.0 * current
    else:
        copper = copper * (1 + 0.05 * (1 - np.exp(-speed)))
        iron, inverter = drive.iron_loss * turning**1.5, 2.0 * current**2 / (current + 0.15)
    return {"copper_loss": copper, "iron_loss": iron, "inverter_loss": inverter}


def power_of(parts: Parts) -> np.ndarray:
    """Return the power that parts sum to, (T, R) W."""
    return np.asarray(sum(watts.sum(axis=2) if watts.ndim == 3 else watts for watts in parts.values()))

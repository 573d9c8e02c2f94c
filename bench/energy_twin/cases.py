"""Robots whose energy is known part by part: logs in memory, and what was true of them.

Two plants. `exact` has the catalogue's own laws on motions that are followed exactly; `plant` is the bench's own, under
a controller in MuJoCo, whose laws of iron, inverter, friction and brakes are others.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path

import numpy as np

from blind.motions import exciting, work
from energy_twin.truth import Parts, Truth, drives, mechanical, numbers, power_of
from irtwin.demo.plant.arm import PlantPayload
from irtwin.demo.plant.machine import Machine, build
from irtwin.demo.plant.motion import PlantMotion
from irtwin.robot.description import Robot
from irtwin.robot.urdf import parse_urdf
from irtwin.signals.channels import Signals
from irtwin.signals.log import DataSet, Run
from plant.drawings import read_drawings
from plant.effects import Effect
from plant.fleet import Fleet, Traces
from plant.logger import coloured, lagged
from plant.logger import released as brakes_released
from plant.logger import torque as shown

ROBOTS = {"kuka_kr6_r700": "KR6", "elbow6": "UR10-like", "slim7": "Panda-like"}
LAYOUT = "xwxwxxwxwwxw"  # exciting motions, and work with pauses
SECONDS, STEP, STRIDE = 9.6, 0.002, 4  # s; 1,200 samples a run
BRAKES, STICKING, LOADED = 30.0, 0.4, 0.05  # W; of Coulomb friction; of the load
SUPPLY = ("copper_loss", "iron_loss", "inverter_loss", "no_regeneration")
MORE = ("holding_brakes", "stribeck_friction", "load_dependent_friction")


@dataclass(frozen=True)
class Case:
    """A data set and its truth; `effects`: those beyond the baseline.

    `plant`: what a motion takes when it is executed with a payload by a day's friction, (N,) W each `STEP`, before any
    sensor.
    """

    name: str
    data_set: DataSet
    effects: tuple[str, ...]
    truth: Truth
    plant: Callable[[PlantMotion, PlantPayload, np.random.Generator], np.ndarray]


def cases(seeds: Sequence[int], only: str = "", *, motor_current: bool = False) -> Iterator[Case]:
    """Yield each robot of each plant, with and without what is more than losses of drives; `only` in their names.

    `motor_current`: torque is logged as that of the motors, none while brakes are closed.
    """
    for exact, robot, more, seed in product((True, False), ROBOTS, (False, True), seeds):
        name = f"{'exact' if exact else 'plant'} {ROBOTS[robot]}{' more' if more else ''} {seed}"
        if only in name:
            yield _case(name, robot, seed, exact=exact, more=more, motor_current=motor_current)


def _case(name: str, robot: str, seed: int, *, exact: bool, more: bool, motor_current: bool) -> Case:
    drawings = replace(read_drawings(robot), step=STEP)
    machine = build(drawings, 300 + seed)
    rng = np.random.default_rng([7, seed, exact, more])
    n = len(drawings.joints)
    motions = [
        exciting(drawings, SECONDS, 0.8, 0.6, rng) if kind == "x" else work(drawings, SECONDS, n, 0.6, rng)
        for kind in LAYOUT
    ]
    effects = _effects(machine, len(motions), more)

    def executed(
        motions: list[PlantMotion], payload: PlantPayload, rng: np.random.Generator
    ) -> tuple[Traces, np.ndarray, Parts]:
        """Return what motions do, their power, (T, R) W, and its parts, (T, R) W or a joint's, (T, R, n)."""
        told = np.stack([motion.dq for motion in motions], axis=1)
        released = _released(told) if more else np.ones(told.shape[:2])
        traces, friction = (
            _followed(machine, motions, payload, more)
            if exact
            else _simulated(machine, motions, payload, effects, rng, 1 - released)
        )
        driven = replace(traces, torque=traces.torque * released[:, :, None])  # closed brakes carry the links
        parts = {
            **mechanical(machine, driven, {name: own * released[:, :, None] for name, own in friction.items()}),
            **drives(machine, driven, exact=exact),
        }
        parts["no_regeneration"] = np.maximum(-power_of(parts), 0.0)
        parts["standby_power"] = np.full(told.shape[:2], machine.drawings.supply.standby)
        drawn = power_of(parts)
        if not exact:
            drawn = lagged(drawn, drawings.sensors.meter_time_constant, STEP)
        if more:
            parts["holding_brakes"] = BRAKES * (released if exact else brakes_released(replace(traces, dq=told), STEP))
            drawn = drawn + parts["holding_brakes"]
        return (driven if motor_current else traces), drawn, parts

    traces, drawn, parts = executed(motions, PlantPayload(), rng)
    sensed = shown(traces, machine, (), STEP)[::STRIDE]
    sensors, cut = drawings.sensors, slice(None, None, STRIDE)
    noise = np.random.default_rng([9, seed])
    sensed = sensed + sensors.torque_noise * coloured(noise, sensed.shape)
    drawn = drawn[cut] + sensors.meter_noise * coloured(noise, drawn[cut].shape)
    q = traces.q[cut] + 2e-6 * noise.standard_normal(traces.q[cut].shape)
    time = STEP * STRIDE * np.arange(len(q))
    runs = [
        _run(f"run_{k + 1:02d}", Signals(time, q[:, k], torque=sensed[:, k], power=drawn[:, k]))
        for k in range(len(motions))
    ]
    listed = (*SUPPLY, *(MORE if more else ()))
    known = DataSet(Path(robot), _described(machine), tuple(runs), None, None, "dc_bus", True, {})
    logged = {part: np.trapezoid(watts[cut], dx=STEP * STRIDE, axis=0) for part, watts in parts.items()}
    energies = {run.name: {part: joules[k] for part, joules in logged.items()} for k, run in enumerate(runs)}
    truth = Truth(drawings.joints, machine, numbers(machine, exact=exact, more=more), energies, plain=not more)
    return Case(name, known, listed, truth, lambda motion, payload, day: executed([motion], payload, day)[1][:, 0])


def _run(name: str, signals: Signals) -> Run:
    return Run(name, Path(name), "", "observed", 0.0, (0.0, 0.0, 0.0), None, None, {}, signals)


def _described(machine: Machine) -> Robot:
    """Return the robot as its maker draws it, with the name plates of its drives."""
    drawings, drive = machine.drawings, machine.drawings.drive
    robot = parse_urdf(drawings.urdf)
    plates = zip(robot.joints, drive.gear_ratio, drive.joint_torque_constant, drive.resistance, strict=True)
    return replace(
        robot,
        joints=tuple(
            replace(joint, gear_ratio=float(gear), torque_constant=float(constant), winding_resistance=float(ohm))
            for joint, gear, constant, ohm in plates
        ),
    )


def _effects(machine: Machine, runs: int, more: bool) -> tuple[Effect, ...]:
    every, joints = np.ones(runs, dtype=bool), tuple(range(len(machine.drawings.joints)))
    found = [Effect(name, joints, every, 1.0) for name in SUPPLY]
    if more:
        found.append(Effect("holding_brakes", joints, every, BRAKES))
        found.append(Effect("load_dependent_friction", joints, every, LOADED))
        for joint, level in enumerate(machine.friction.coulomb):
            found.append(Effect("stribeck_friction", (joint,), every, STICKING * level, {"speed": 0.06}))
    return tuple(found)


def _simulated(
    machine: Machine,
    motions: list[PlantMotion],
    payload: PlantPayload,
    effects: tuple[Effect, ...],
    rng: np.random.Generator,
    braked: np.ndarray,
) -> tuple[Traces, Parts]:
    """Return what a controller in MuJoCo makes of motions, and its friction, (T, R, n) N m, where laws are simple."""
    runs, n = len(motions), len(machine.drawings.joints)
    jitter = 1 + machine.drawings.tolerance.friction_per_run * rng.standard_normal((runs, 2, n)).clip(-2, 2)
    traces = Fleet(machine, motions, [payload] * runs, np.full((runs, n), 35.0), jitter, STEP, braked=braked).run(
        effects
    )
    if any(effect.id == "stribeck_friction" for effect in effects):
        return traces, {}
    dry, oil = machine.friction.coulomb * jitter[:, 0], machine.friction.viscous * jitter[:, 1]
    return traces, {"coulomb_friction": dry * np.sign(traces.dq), "viscous_friction": oil * traces.dq}


def _followed(machine: Machine, motions: list[PlantMotion], payload: PlantPayload, more: bool) -> tuple[Traces, Parts]:
    """Return the motions followed exactly, and friction by the catalogue's laws, (T, R, n) N m."""
    arm, friction, rotor = machine.arm(payload), machine.friction, machine.drive.joint_inertia
    arm.model.dof_armature[:] = 0.0
    q, dq, ddq = (np.stack([getattr(one, name) for one in motions], axis=1) for name in ("q", "dq", "ddq"))
    flat = (x.reshape(-1, x.shape[2]) for x in (q, dq, ddq))
    load = np.array([arm.inverse_dynamics(*state) for state in zip(*flat, strict=True)])
    torque = load.reshape(q.shape) + rotor * ddq
    sign = np.where(np.abs(dq) < 1e-6, 0.0, np.sign(dq))
    laws = {"coulomb_friction": friction.coulomb * sign, "viscous_friction": friction.viscous * dq}
    if more:
        laws["stribeck_friction"] = STICKING * friction.coulomb * sign * np.exp(-np.abs(dq) / 0.05)
    torque = torque + sum(laws.values())
    if more:
        laws["load_dependent_friction"] = LOADED * np.abs(torque) * sign
        torque = torque + laws["load_dependent_friction"]
    return Traces(q, dq, ddq, torque, np.full_like(q, 35.0)), laws


def _released(told: np.ndarray) -> np.ndarray:
    """Return (T, R) whether brakes are open: half a second longer than a joint is told to move, (T, R, n) rad/s."""
    moving = (np.abs(told) > 0.01).any(axis=2)
    last = np.maximum.accumulate(np.where(moving, np.arange(len(moving))[:, None], -(10**9)), axis=0)
    return ((np.arange(len(moving))[:, None] - last) * STEP <= 0.5).astype(float)

"""Robots and motions whose truth is known: torque from Pinocchio's inverse dynamics, not from any regressor."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import replace
from itertools import cycle
from pathlib import Path

import numpy as np

from irtwin.robot.description import Robot
from irtwin.robot.model import inverse_dynamics
from irtwin.robot.urdf import parse_urdf
from irtwin.signals.channels import Signals
from irtwin.signals.log import DataSet, Run
from irtwin.signals.motion import Motion

AXES = ("0 0 1", "0 1 0", "0 1 0", "1 0 0", "0 1 0", "1 0 0", "0 1 0")


def arm(joints: int, slides: tuple[int, ...] = ()) -> Robot:
    """A generic arm of up to seven joints, no two links alike; joints in `slides` (from 0) are prismatic."""
    parts = ['<link name="base"/>']
    for k in range(joints):
        mass = 8.0 / (k + 1)
        inertia = f'ixx="{0.05 * mass}" iyy="{0.06 * mass}" izz="{0.04 * mass}" ixy="0.01" ixz="-0.005" iyz="0.008"'
        kind = "prismatic" if k in slides else "revolute"
        parts.append(
            f'<link name="link_{k + 1}"><inertial><origin xyz="{0.1 - 0.02 * k} 0.03 {0.12 - 0.01 * k}"/>'
            f'<mass value="{mass}"/><inertia {inertia}/></inertial></link>'
            f'<joint name="joint_{k + 1}" type="{kind}"><parent link="{"base" if k == 0 else f"link_{k}"}"/>'
            f'<child link="link_{k + 1}"/><origin xyz="{0.03 * k} {0.02 * k} {0.35 - 0.03 * k}"/>'
            f'<axis xyz="{AXES[k]}"/><limit lower="-2.5" upper="2.5" velocity="4" effort="300"/></joint>'
        )
    flange = f'<link name="flange"/><joint name="flange" type="fixed"><parent link="link_{joints}"/>'
    flange += '<child link="flange"/><origin xyz="0.05 0 0.1" rpy="0.3 0 0"/></joint>'
    return parse_urdf(f'<robot name="arm_{joints}">{"".join(parts)}{flange}</robot>')


def heavier(robot: Robot, *times: float) -> Robot:
    """The robot, each of whose links weighs so many times as much as it does, in turn."""
    each = cycle(times)
    return parse_urdf(re.sub(r'mass value="(.*?)"', lambda it: f'mass value="{next(each) * float(it[1])}"', robot.urdf))


def swing(robot: Robot, seed: int, seconds: float = 20.0, rate: float = 100.0) -> Motion:
    """Sums of sines in every joint, with exact derivatives."""
    rng = np.random.default_rng(seed)
    n = len(robot.joints)
    time = np.arange(round(seconds * rate)) / rate
    speeds = 2 * np.pi * rng.uniform(0.1, 0.6, (4, n))
    sizes, phases = rng.uniform(0.1, 0.35, (4, n)), rng.uniform(0, 2 * np.pi, (4, n))
    angle = time[:, None, None] * speeds + phases
    return Motion(
        time,
        (sizes * np.sin(angle)).sum(axis=1),
        (sizes * speeds * np.cos(angle)).sum(axis=1),
        -(sizes * speeds**2 * np.sin(angle)).sum(axis=1),
        run=f"swing_{seed}",
    )


def truth(robot: Robot) -> dict[str, np.ndarray]:
    """Friction, rotor inertia, offsets and losses of each joint, in the units of the effects."""
    n = len(robot.joints)
    fall = 1 / np.arange(1, n + 1)
    return {
        "Fc": 6.0 * fall,
        "Fv": 9.0 * fall,
        "Ia": 0.8 * fall,
        "c": np.linspace(-1, 1, n),
        "R": 0.6 / fall,
        "P0": np.array(120.0),
    }


def rigid_torque(robot: Robot, motion: Motion) -> np.ndarray:
    """Inverse dynamics by recursive Newton-Euler, (N, n)."""
    return inverse_dynamics(robot.model, motion.q, motion.dq, motion.ddq)


def measure(robot: Robot, motion: Motion, noise: float = 0.0, constant: float = 8.0, seed: int = 0) -> Motion:
    """Add what a robot of the `truth` would show: torque (noise in N m), current (A) and power (noise in W)."""
    rng = np.random.default_rng(seed)
    true = truth(robot)
    torque = rigid_torque(robot, motion) + true["Ia"] * motion.ddq
    torque += true["Fc"] * np.sign(motion.dq) + true["Fv"] * motion.dq
    current = torque / constant
    power = true["P0"] + (torque * motion.dq).sum(axis=1) + (true["R"] * current**2).sum(axis=1)
    return replace(
        motion,
        torque=torque + true["c"] + noise * rng.standard_normal(torque.shape),
        current=current,
        power=power + noise * rng.standard_normal(len(power)),
    )


def with_torque(robot: Robot, shown: Motion, added: np.ndarray, constant: float = 8.0) -> Motion:
    """Return what is shown with some more joint torque, (N, n) N m, and the power that this takes; without current."""
    heat = truth(robot)["R"] * (2 * shown.current + added / constant) * added / constant
    power = shown.power + (added * shown.dq + heat).sum(axis=1)
    return replace(shown, torque=shown.torque + added, power=power, current=None)


def with_constants(robot: Robot, constant: float = 8.0) -> Robot:
    """Give every joint the torque constant that `measure` takes."""
    return replace(robot, joints=tuple(replace(joint, torque_constant=constant) for joint in robot.joints))


def data_set(
    robot: Robot, runs: Iterable[Run], effects: Sequence[str] | None = None, power_at: str | None = "mains"
) -> DataSet:
    """A data set of a robot that a simulator logged."""
    return DataSet(Path("arm"), robot, tuple(runs), effects, None, power_at, True, {})


def as_run(motion: Motion, **changes: np.ndarray | None) -> Run:
    """The motion's positions, torque and power as a log would have them."""
    signals = Signals(motion.time, motion.q, torque=motion.torque, current=motion.current, power=motion.power)
    return Run(
        name=motion.run,
        file=Path(f"{motion.run}.csv"),
        sha256="",
        role="observed",
        payload_mass=motion.payload_mass,
        payload_com=motion.payload_com,
        repeat_of=None,
        started=None,
        notes={},
        signals=replace(signals, **changes),
    )

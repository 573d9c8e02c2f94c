"""An arm of two joints with position servos: its model in MuJoCo, and logs of it with commands and no torque."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet

from irtwin.robot.description import Robot
from irtwin.robot.urdf import read_urdf
from irtwin.signals.channels import Signals, columns_of
from irtwin.signals.log import DataSet, read_data_set
from irtwin.simulator.model import Model, read_model
from irtwin.simulator.play import Push, play, whole
from irtwin.simulator.servos import NAMES, Servos, servos

MODEL = """<mujoco model="arm">
  <compiler angle="radian"/>
  <!-- servos as the maker says -->
  <default><joint damping="0.1" armature="0.02" frictionloss="0.05"/></default>
  <worldbody>
    <body name="upper"><joint name="lift" axis="0 1 0"/>
      <inertial pos="0.1 0 0" mass="0.2" diaginertia="0.001 0.001 0.001"/>
      <body name="lower" pos="0.2 0 0"><joint name="elbow" axis="0 1 0"/>
        <inertial pos="0.1 0 0" mass="0.1" diaginertia="0.0005 0.0005 0.0005"/>
      </body>
    </body>
  </worldbody>
  <actuator>
    <position joint="lift" kp="20" kv="0.8" ctrlrange="-1.5 1.5" forcerange="-5 5"/>
    <position joint="elbow" kp="15" kv="0.6" ctrlrange="-1.5 1.5"/>
  </actuator>
</mujoco>
"""
STOPPED = MODEL.replace('name="lift"', 'name="lift" limited="true" range="-1.2 1.2"')  # what falls ends there
GAINS = "[robot.joint.lift]\nkp = 20.0\nkd = 0.8\n[robot.joint.elbow]\nkp = 15.0\nkd = 0.6\n"
_LINK = """<link name="{}"><inertial><origin xyz="0.1 0 0"/><mass value="{}"/>
<inertia ixx="0.001" ixy="0" ixz="0" iyy="0.001" iyz="0" izz="0.001"/></inertial></link>"""
_JOINT = """<joint name="{}" type="revolute"><parent link="{}"/><child link="{}"/><origin xyz="{} 0 0"/>
<axis xyz="0 1 0"/><limit lower="-3" upper="3" effort="10" velocity="10"/></joint>"""
_REST = 1.0  # s that an arm rests before it swings
URDF = (
    '<robot name="arm"><link name="base"/>'
    + _LINK.format("upper", 0.2)
    + _LINK.format("lower", 0.1)
    + _JOINT.format("lift", "base", "upper", 0)
    + _JOINT.format("elbow", "upper", "lower", 0.2)
    + "</robot>"
)


def write(folder: Path, commands: dict[str, np.ndarray], text: str = MODEL, rate: float = 50.0) -> tuple[Path, Path]:
    """Write a data set whose positions are the commands (N, 2) of each run, and the model; return both places."""
    (folder / "data" / "runs").mkdir(parents=True)
    (folder / "data" / "robot.urdf").write_text(URDF, encoding="utf-8")
    lines = ['[robot]\nname = "arm"\nurdf = "robot.urdf"']
    robot = read_urdf(folder / "data" / "robot.urdf")
    for name, told in commands.items():
        lines.append(f'[[run]]\nfile = "runs/{name}.parquet"')
        log(
            folder / "data" / "runs" / f"{name}.parquet",
            robot,
            Signals(np.arange(len(told)) / rate, told, command=told),
        )
    (folder / "data" / "dataset.toml").write_text("\n".join(lines) + "\n", encoding="utf-8")
    (folder / "arm.xml").write_text(text, encoding="utf-8")
    return folder / "data", folder / "arm.xml"


def log(file: Path, robot: Robot, signals: Signals) -> None:
    """Write signals as a log."""
    pa.parquet.write_table(pa.table(columns_of(signals, robot.joint_names)), file)


def swings(seconds: float, seed: int, rate: float = 50.0) -> np.ndarray:
    """Return commands (N, 2) of sines and steps, rad."""
    time, rng = np.arange(int(seconds * rate)) / rate, np.random.default_rng(seed)
    sines = sum(0.25 * np.sin(2 * np.pi * f * time[:, None] + rng.uniform(0, 6, 2)) for f in (0.3, 0.9, 1.6))
    swing = sines + 0.2 * np.sign(np.sin(time[:, None] * np.array([1.1, 1.7])))
    return np.asarray(swing * np.clip(time - _REST, 0.0, 1.0)[:, None])


def read(data: Path, model: Path) -> tuple[DataSet, Model, Servos]:
    """Read a data set of commands and a model."""
    data_set = read_data_set(data, commanded=True)
    found = read_model(model, data_set.robot)
    return data_set, found, servos(found)


def changed(own: Servos, **changes: tuple[float, float]) -> np.ndarray:
    """Return the servos' numbers (k, 2) with some of them others."""
    numbers = own.numbers.copy()
    for name, values in changes.items():
        numbers[NAMES.index(name)] = values
    return numbers


def played(
    data_set: DataSet, own: Servos, numbers: np.ndarray, noise: float = 1e-3, torque_noise: float | None = None,
    pushes: tuple[Push, ...] = (),
) -> DataSet:  # fmt: skip
    """Return the data set with the positions that a robot of these numbers would have, from where it rests on.

    With `torque_noise`, N m, the torque of its servos is logged, too.
    """
    rng, runs = np.random.default_rng(7), []
    for run in data_set.runs:
        logged = replace(run.signals, torque=None if torque_noise is None else np.zeros(run.signals.q.shape))
        for _ in range(3 if pushes else 1):  # a push pulls joints as the arm stands, which it changes
            moved = play(own, [numbers], [whole(replace(run, signals=logged), pushes)])[0][0]
            logged = replace(logged, q=moved[:, 0])
        signals = replace(logged, q=moved[:, 0] + noise * rng.standard_normal(logged.q.shape))
        if torque_noise is not None:
            torque = moved[:, 1] + torque_noise * rng.standard_normal(logged.q.shape)
            signals = replace(signals, torque=torque)
        runs.append(replace(run, signals=signals.rows(run.signals.time >= _REST / 2)))
    return replace(data_set, runs=tuple(runs))

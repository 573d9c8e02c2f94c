"""The robot of these notebooks: a turntable with a lift. Its logs are computed, so that what is true of it is known.

torque of the turntable, N m = 4 ddq + 6 sign(dq) + 9 dq
force of the lift, N         = 12 (ddq + 9.81) + 20 sign(dq) + 80 dq
power at the mains, W        = 90 + the work of both axes
"""

from itertools import pairwise
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.csv

RATE = 200  # samples a second
EFFECTS = ["rigid_body", "coulomb_friction", "viscous_friction", "mechanical_power", "standby_power"]
URDF = """<robot name="Crane">
  <link name="base"><visual><geometry><cylinder radius="0.4" length="0.1"/></geometry></visual></link>
  <link name="table"><inertial><mass value="20"/>
    <inertia ixx="2" iyy="2" izz="4" ixy="0" ixz="0" iyz="0"/></inertial>
    <visual><origin xyz="-0.2 0 0.9"/><geometry><box size="0.1 0.2 1.7"/></geometry></visual></link>
  <link name="carriage"><inertial><mass value="12"/>
    <inertia ixx="0.1" iyy="0.1" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial>
    <visual><origin xyz="0.2 0 0.1"/><geometry><box size="0.8 0.1 0.1"/></geometry></visual></link>
  <joint name="turn" type="revolute"><parent link="base"/><child link="table"/><axis xyz="0 0 1"/>
    <limit lower="-3.1" upper="3.1" velocity="4" effort="150"/></joint>
  <joint name="lift" type="prismatic"><parent link="table"/><child link="carriage"/><axis xyz="0 0 1"/>
    <limit lower="0" upper="1.5" velocity="2" effort="600"/></joint>
</robot>
"""


def exciting(seed: int, seconds: float = 8.0) -> np.ndarray:
    """Return positions (N, 2), rad and m, of a motion in which everything shows: sums of sines."""
    random, time = np.random.default_rng(seed), np.arange(0, seconds, 1 / RATE)
    waves = [sum(random.uniform(-1, 1) * np.sin(2 * np.pi * k * time / seconds) for k in range(1, 6)) for _ in "12"]
    return np.stack([0.8 * waves[0], 0.7 + 0.2 * waves[1]], axis=1)


def work() -> np.ndarray:
    """Return positions (N, 2), rad and m, of a cycle: quick moves between three places, with waiting after each."""
    places = np.array([[0.0, 0.3], [2.0, 1.2], [-1.0, 0.6], [0.0, 0.3]])
    share = np.linspace(0, 1, int(1.2 * RATE))[:, None]
    smooth = 10 * share**3 - 15 * share**4 + 6 * share**5
    parts = [np.repeat(places[:1], RATE, axis=0)]
    for start, end in pairwise(places):
        parts += [start + (end - start) * smooth, np.repeat(end[None], 2 * RATE, axis=0)]
    return np.concatenate(parts)


def log(file: str, q: np.ndarray, damping: float = 9.0, seed: int = 0) -> str:
    """Write what the robot logs in a motion as CSV; `damping`, N m s/rad, is the turntable's. Return the file."""
    noise = np.random.default_rng(seed).normal(size=(3, len(q)))
    dq = np.gradient(q, 1 / RATE, axis=0)
    ddq = np.gradient(dq, 1 / RATE, axis=0)
    turn = 4 * ddq[:, 0] + 6 * np.tanh(dq[:, 0] / 1e-3) + damping * dq[:, 0]
    lift = 12 * (ddq[:, 1] + 9.81) + 20 * np.tanh(dq[:, 1] / 1e-3) + 80 * dq[:, 1]
    power = 90 + turn * dq[:, 0] + lift * dq[:, 1]
    columns = [np.arange(len(q)) / RATE, *q.T, turn + 0.1 * noise[0], lift + 0.5 * noise[1], power + noise[2]]
    table = pa.table(columns, names=["time", "q_turn", "q_lift", "tau_turn", "tau_lift", "power"])
    Path(file).parent.mkdir(parents=True, exist_ok=True)
    pyarrow.csv.write_csv(table, file)
    return file


def data_set(folder: str, simulator_damping: float | None = None) -> str:
    """Write two exciting runs and one of work as a data set, with a simulator's runs where its damping is given."""
    motions = {f"exciting_{number}": exciting(number) for number in (1, 2)} | {"work": work()}
    lines = ["[robot]", 'name = "Crane"', 'urdf = "robot.urdf"', 'power_at = "mains"', "simulated = true"]
    for seed, (name, q) in enumerate(motions.items()):
        log(f"{folder}/runs/{name}.csv", q, seed=seed)
        lines += ["[[run]]", f'file = "runs/{name}.csv"']
        if simulator_damping is not None:
            log(f"{folder}/runs/simulated_{name}.csv", q, simulator_damping, seed + 10)
            lines += ["[[run]]", f'file = "runs/simulated_{name}.csv"', 'role = "simulated"']
    lines += ["[twin]", f"effects = {EFFECTS}"]
    Path(folder, "robot.urdf").write_text(URDF)
    Path(folder, "dataset.toml").write_text("\n".join(lines) + "\n")
    return folder

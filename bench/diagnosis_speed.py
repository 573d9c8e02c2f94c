"""How long `irtwin diagnose` takes, and how much memory: `python diagnosis_speed.py [CASE...] [--profile]`.

A case is RUNSxSAMPLES, at 100 samples a second; without one, 12x2000, 12x83000 and 1x1000000. The logs are those of a
KUKA KR6 R700 that has friction, losses and noise as below, and in observed runs a hose that pulls at joint 3, which the
twin lacks. RUNSxSAMPLESxJOINTS is the same of a chain of so many joints. `--profile` adds where the time goes.
"""

from __future__ import annotations

import argparse
import cProfile
import os
import pstats
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet

from irtwin.effects.catalogue import BASELINE
from irtwin.effects.stack import Stack
from irtwin.resources import folder
from irtwin.robot.urdf import read_urdf
from irtwin.signals.motion import Motion

CASES = ("12x2000", "12x83000", "1x1000000")
RATE = 100.0  # Hz
PIECE = 8192  # samples that are made at once
AXES = ("0 0 1", "0 1 0", "0 1 0", "1 0 0", "0 1 0", "1 0 0")  # of a chain, again and again
EFFECTS = (*BASELINE, "copper_loss", "cable_drag")
COEFFICIENTS = {"Ia": 0.5, "Fc": 6.0, "Fv": 9.0, "k": 0.0, "c": 0.3, "R": 0.02, "": 1.0, "P0": 150.0}
PULL = 8.0  # N m/rad, at joint 3 of observed runs
TORQUE_NOISE, POWER_NOISE, POSITION_NOISE = 0.2, 2.0, 1e-6  # N m, W, rad


@dataclass(frozen=True)
class Run:
    """`programme` is the seed of the motion: two runs of one are repeats."""

    name: str
    role: str
    programme: int
    seed: int


def runs(count: int) -> list[Run]:
    """A third of the runs is of reference; of either role the second repeats the first. One run alone is observed."""
    reference = count // 3
    roles = ["reference"] * reference + ["observed"] * (count - reference)
    programmes = [k - 1 if count > 1 and k in (1, reference + 1) else k for k in range(count)]
    return [Run(f"run_{k}", roles[k], programmes[k], k) for k in range(count)]


def chain(joints: int) -> str:
    """Return the URDF of a chain of links, each lighter than the one before."""
    links, last = ['<link name="base"/>'], "base"
    for k in range(joints):
        mass = 20 / (k + 2)
        moments = " ".join(f'i{axis}{axis}="{0.02 * mass:.5f}"' for axis in "xyz") + ' ixy="0" ixz="0" iyz="0"'
        links.append(
            f'<link name="link_{k + 1}"><inertial><origin xyz="0.02 0.01 0.05"/><mass value="{mass:.4f}"/>'
            f'<inertia {moments}/></inertial></link><joint name="joint_{k + 1}" type="revolute"><parent link="{last}"/>'
            f'<child link="link_{k + 1}"/><origin xyz="{0.02 * (k % 3)} 0.01 0.12"/><axis xyz="{AXES[k % len(AXES)]}"/>'
            '<limit lower="-2.5" upper="2.5" velocity="3" effort="500"/></joint>'
        )
        last = f"link_{k + 1}"
    return f'<robot name="chain_{joints}">{"".join(links)}</robot>'


def write(place: Path, count: int, samples: int, joints: int | None = None) -> None:
    """Write a data set, of the KR6 or of a chain of joints."""
    kr6 = folder("ontology") / "robots" / "kuka_kr6_r700.urdf"
    (place / "runs").mkdir(parents=True)
    urdf = place / "robot.urdf"
    urdf.write_text(kr6.read_text(encoding="utf-8") if joints is None else chain(joints), encoding="utf-8")
    stack = Stack(read_urdf(urdf), EFFECTS)
    lines = [
        '[robot]\nname = "robot"\nurdf = "robot.urdf"\n\n[twin]\neffects = [',
        f"{str([*BASELINE, 'copper_loss'])[1:-1]}]",
    ]
    first: dict[int, str] = {}
    for run in runs(count):
        file = f"runs/{run.name}.parquet"
        lines.append(f'\n[[run]]\nfile = "{file}"\nrole = "{run.role}"')
        if run.programme in first:
            lines.append(f'repeat_of = "{first[run.programme]}"')
        first.setdefault(run.programme, file)
        with pyarrow.parquet.ParquetWriter(place / file, _schema(stack)) as out:
            for piece in _motion(stack, run, samples).pieces(PIECE):
                out.write_table(pa.table(_log(stack, run, piece), schema=_schema(stack)))
    (place / "dataset.toml").write_text("\n".join(lines) + "\n")


def _schema(stack: Stack) -> pa.Schema:
    joints = stack.robot.joint_names
    names = ["time", *(f"{kind}_{joint}" for kind in ("q", "tau", "temp") for joint in joints), "power"]
    return pa.schema([(name, pa.float64()) for name in names])


def _motion(stack: Stack, run: Run, samples: int) -> Motion:
    """Sums of sines in every joint, within its limits; joints that warm."""
    rng = np.random.default_rng(run.programme)
    limits = stack.robot.joints
    n = len(limits)
    time = np.arange(samples) / RATE
    speeds, phases = 2 * np.pi * rng.uniform(0.05, 0.5, (4, n)), rng.uniform(0, 2 * np.pi, (4, n))
    middle = np.array([(joint.lower + joint.upper) / 2 for joint in limits])
    sizes = np.array([(joint.upper - joint.lower) / 2 for joint in limits]) * rng.uniform(0.05, 0.2, (4, n))
    q, dq, ddq = np.tile(middle, (samples, 1)), np.zeros((samples, n)), np.zeros((samples, n))
    for size, speed, phase in zip(sizes, speeds, phases, strict=True):
        angle = time[:, None] * speed + phase
        q += size * np.sin(angle)
        dq += size * speed * np.cos(angle)
        ddq -= size * speed**2 * np.sin(angle)
    warm = 25 + 20 * (1 - np.exp(-time / 600))[:, None] * rng.uniform(0.5, 1, n)
    return Motion(time, q, dq, ddq, run=run.name, temperature=warm)


def _log(stack: Stack, run: Run, motion: Motion) -> dict[str, np.ndarray]:
    """Columns of the log for a piece of a run."""
    rng = np.random.default_rng([run.seed, motion.start])
    torque_values = _values(stack, "torque")
    if run.role == "observed":
        places = [(effect.id, term.joint) for effect, term in stack.torque_terms]
        torque_values[places.index(("cable_drag", stack.robot.joint_names[2]))] = PULL
    torque = stack.torque_columns(motion) @ torque_values
    power = stack.predicted_power_columns(motion, torque_values) @ _values(stack, "power")
    columns = {"time": motion.time, "power": power + POWER_NOISE * rng.standard_normal(len(power))}
    for kind, values, noise in (
        ("q", motion.q, POSITION_NOISE),
        ("tau", torque, TORQUE_NOISE),
        ("temp", motion.temperature, 0.0),
    ):
        assert values is not None
        noisy = values + noise * rng.standard_normal(values.shape)
        columns |= {f"{kind}_{joint}": noisy[:, j] for j, joint in enumerate(stack.robot.joint_names)}
    return {name: columns[name] for name in _schema(stack).names}


def _values(stack: Stack, signal: str) -> np.ndarray:
    terms = stack.torque_terms if signal == "torque" else stack.power_terms
    return np.array([COEFFICIENTS.get(term.name, term.expected) for _, term in terms])


@dataclass(frozen=True)
class Cost:
    """What a diagnosis took: wall clock and processor of all its processes, s; most memory of one of them, MB."""

    seconds: float
    processor: float
    memory: float


def measure(place: Path) -> Cost:
    """Diagnose a data set in a process of its own."""
    command = [str(Path(sys.executable).with_name("irtwin")), "diagnose", str(place), "--json", str(place / "out.json")]
    began = time.perf_counter()
    process = subprocess.Popen(command)
    _, status, usage = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode:
        raise SystemExit(f"{' '.join(command)} ended with {process.returncode}")
    return Cost(time.perf_counter() - began, usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1024)


def profile(place: Path) -> None:
    """Print the functions that take the most time."""
    from irtwin.gap.diagnosis import diagnose
    from irtwin.signals.log import read_data_set

    with cProfile.Profile() as watched:
        diagnose(read_data_set(place))
    pstats.Stats(watched).sort_stats("tottime").print_stats(25)


def main(cases: list[str], profiled: bool) -> None:
    print("| runs x samples | seconds | processor seconds | most memory, MB |\n| --- | --- | --- | --- |")
    for case in cases:
        numbers = [int(number) for number in case.split("x")]
        with tempfile.TemporaryDirectory() as scratch:
            place = Path(scratch, case)
            write(place, *numbers)
            cost = measure(place)
            print(f"| {case} | {cost.seconds:.1f} | {cost.processor:.1f} | {cost.memory:.0f} |", flush=True)
            if profiled:
                profile(place)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("cases", nargs="*", default=CASES, metavar="CASE")
    parser.add_argument("--profile", action="store_true")
    arguments = parser.parse_args()
    main(arguments.cases, arguments.profile)

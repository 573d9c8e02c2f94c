"""Design the exciting motions that the plant's campaign runs, by `irtwin robot excite`'s search, one a seed.

The search knows the floor but not the robot's own body: `--within` gives narrower limits (deg) that keep the arm off
it. plant/README.md gives the command.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import replace
from math import radians
from pathlib import Path

import numpy as np

from irtwin.identification.excitation import Excitation, excite
from irtwin.robot.description import Robot
from irtwin.robot.urdf import read_urdf


def within(robot: Robot, limits: Sequence[str]) -> Robot:
    """Return the robot with narrower position limits, given as "joint:lower:upper" in deg."""
    joints = {joint.name: joint for joint in robot.joints}
    for limit in limits:
        name, lower, upper = limit.split(":")
        joints[name] = replace(joints[name], lower=radians(float(lower)), upper=radians(float(upper)))
    return replace(robot, joints=tuple(joints.values()))


def as_toml(motion: Excitation, seed: int) -> str:
    """Return the Fourier coefficients of a motion (rad) as the plant reads them."""
    series = motion.series
    lines = [
        f"# irtwin robot excite, seed {seed}: condition number {motion.condition_number:.1f}",
        f"period = {series.period}  # s",
        f"centre = {_row(series.centre)}  # rad, one a joint",
        *_matrix("sine", series.sine),
        *_matrix("cosine", series.cosine),
    ]
    return "\n".join(lines) + "\n"


def _matrix(name: str, rows: np.ndarray) -> list[str]:
    return [f"{name} = [  # rad, one row a harmonic", *(f"    {_row(row)}," for row in rows), "]"]


def _row(values: np.ndarray) -> str:
    return "[" + ", ".join(f"{value:.9f}" for value in values) + "]"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("urdf", type=Path)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--seconds", type=float, required=True)
    parser.add_argument("--seeds", type=int, nargs="+", required=True)
    parser.add_argument("--within", nargs="+", default=[], metavar="JOINT:LOWER:UPPER")
    arguments = parser.parse_args()
    robot = within(read_urdf(arguments.urdf), arguments.within)
    for number, seed in enumerate(arguments.seeds, start=1):
        motion = excite(robot, arguments.seconds, seed=seed)
        print(f"exciting_{number}: seed {seed}, condition number {motion.condition_number:.1f}", flush=True)
        (arguments.folder / f"exciting_{number}.toml").write_text(as_toml(motion, seed), encoding="utf-8")


if __name__ == "__main__":
    main()

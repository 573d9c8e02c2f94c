"""Ours beside figaroh on measured robots: `python bench/beside_figaroh.py PYTHON DATASET...` prints a table.

PYTHON is that of an environment of its own with `pip install figaroh` in it. The first two thirds of each run are
fitted, the last third judges. figaroh has the signals filtered as ours are, bodies, rotors, dry and viscous friction
and offsets, its base parameters by QR, and weighted least squares. Printed is the RMS of what each leaves of each
joint's torque, N m, and the processor time of the fit, from signals to numbers. A number in place of a DATASET is that
of samples of a long log (`identify_speed.py`), of which the first half is fitted.
"""

from __future__ import annotations

import os
import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from identify_speed import log
from irtwin.robot.description import Robot
from irtwin.robot.urdf import read_urdf
from irtwin.signals.conditioning import choose_cutoff, condition, condition_for_fit
from irtwin.signals.filter import kernel, low_pass
from irtwin.signals.log import read_data_set
from irtwin.signals.motion import Motion
from irtwin.twin.identify import identify
from plant.drawings import URDFS
from spoilt_stretches import cut

THEIRS = """
import sys, time
import numpy as np
from figaroh.tools.load_robot import load_robot
from figaroh.tools.qrdecomposition import QRDecomposer
from figaroh.tools.regressor import RegressorBuilder, RegressorConfig, get_index_eliminate

folder = sys.argv[1]
robot = load_robot(f"{folder}/robot.urdf", package_dirs=[folder], loader="figaroh", load_by_urdf=True)
fitted, judging = (np.load(f"{folder}/{name}.npz") for name in ("fitted", "judging"))
builder = RegressorBuilder(robot, RegressorConfig(has_friction=True, has_actuator_inertia=True, has_joint_offset=True))
begin = time.process_time()
settings = {"act_idxv": list(range(robot.model.nv))}
W = builder.build_basic_regressor(fitted["q"], fitted["dq"], fitted["ddq"], settings)
names = {str(k): 0.0 for k in range(W.shape[1])}
left_out, kept = get_index_eliminate(W, names, 1e-3)
tau, W = fitted["torque"].T.ravel(), np.delete(W, left_out, 1)
decomposer = QRDecomposer()
W_base, _, _, phi, _ = decomposer.double_decomposition(tau, W, kept, {name: 0.0 for name in kept})
joints = fitted["torque"].shape[1]
left = (tau - W_base @ phi).reshape(joints, -1)
weight = np.repeat(1 / left.std(axis=1), left.shape[1])
phi = np.linalg.lstsq(W_base * weight[:, None], tau * weight)[0]
seconds = time.process_time() - begin
W = np.delete(builder.build_basic_regressor(judging["q"], judging["dq"], judging["ddq"], settings), left_out, 1)
np.save(f"{folder}/told.npy", (W[:, list(decomposer.get_base_indices())] @ phi).reshape(joints, -1).T)
print("FOUND", seconds)
"""


def of_data_set(folder: Path, python: str) -> list[str]:
    """Return the rows of one data set: ours and theirs."""
    data_set = read_data_set(folder)
    robot, cutoff = data_set.robot, choose_cutoff(data_set.runs)
    ends = [2 * len(run.signals.time) // 3 for run in data_set.runs]
    first = [cut(run, slice(end)) for run, end in zip(data_set.runs, ends, strict=True)]
    judging = [
        condition(cut(run, slice(end, None)), robot, cutoff) for run, end in zip(data_set.runs, ends, strict=True)
    ]
    fitted = [condition_for_fit(run, robot, cutoff) for run in first]
    return _rows(robot, fitted, [condition(run, robot, cutoff) for run in first], judging, python)


def of_long_log(samples: int, python: str) -> list[str]:
    """Return the rows of a long log of a KR6."""
    robot = read_urdf(URDFS / "kuka_kr6_r700.urdf")
    motion = log(robot, samples)
    fitted = [replace(motion.part(0, samples // 2), power=None, whole=None)]
    return _rows(robot, fitted, fitted, [motion.part(samples // 2, samples)], python)


def _rows(robot: Robot, fitted: list[Motion], filtered: list[Motion], judging: list[Motion], python: str) -> list[str]:
    """Return our row and theirs; theirs takes states in the measurement's band, `filtered`."""
    begin = sum(os.times()[:4])
    twin = identify(robot, fitted)
    seconds = sum(os.times()[:4]) - begin
    told, their_seconds = figaroh_torque(robot.urdf, filtered, judging, python)
    return [
        f"| {robot.name} | irtwin | {_left(judging, [twin.torque(motion) for motion in judging])} | {seconds:.1f} |",
        f"| | figaroh | {_left(judging, told)} | {their_seconds:.1f} |",
    ]


def figaroh_torque(
    urdf: str, fitted: list[Motion], judging: list[Motion], python: str
) -> tuple[list[np.ndarray], float]:
    """Return what figaroh tells of the torque of each motion that judges, and the seconds of its fit."""
    with TemporaryDirectory() as name:
        folder = Path(name)
        shapes = r"<(visual|collision)\b.*?</\1>"  # their meshes are not there
        (folder / "robot.urdf").write_text(re.sub(shapes, "", urdf, flags=re.DOTALL), encoding="utf-8")
        for file, motions in (("fitted", fitted), ("judging", judging)):
            keys = ("q", "dq", "ddq", "torque")
            signals = {key: np.concatenate([getattr(motion, key) for motion in motions]) for key in keys}
            np.savez(folder / f"{file}.npz", **signals)
        said = subprocess.run([python, "-c", THEIRS, name], capture_output=True, text=True, check=False)
        found = [line.split()[1] for line in said.stdout.splitlines() if line.startswith("FOUND")]
        if not found:
            raise RuntimeError(said.stderr[-2000:])
        ends = np.cumsum([len(motion.time) for motion in judging])[:-1]
        return np.split(np.load(folder / "told.npy"), ends), float(found[0])


def _left(motions: list[Motion], told: list[np.ndarray]) -> str:
    """Return the RMS that is left of each joint, in the band of the measurement and away from the ends of runs."""
    squares, count = 0.0, 0
    for motion, torque in zip(motions, told, strict=True):
        assert motion.torque is not None and motion.cutoff is not None
        half = len(kernel(motion.rate, motion.cutoff)) // 2
        left = (motion.torque - low_pass(torque, motion.rate, motion.cutoff))[half:-half]
        squares, count = squares + (left**2).sum(axis=0), count + len(left)
    return ", ".join(f"{value:.3g}" for value in np.sqrt(squares / count))


if __name__ == "__main__":
    print("| | | torque left of the last third, N m RMS | s |")
    print("| --- | --- | --- | --- |")
    for argument in sys.argv[2:]:
        made = (
            of_long_log(int(argument), sys.argv[1]) if argument.isdigit() else of_data_set(Path(argument), sys.argv[1])
        )
        print("\n".join(made), flush=True)

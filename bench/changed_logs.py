"""A change put into the torque of measured robots: `python bench/changed_logs.py DATASET...`.

What such a robot does that no catalogue names is in all its runs; beside it one thing changes. Runs without reference
runs are cut: their first halves are the reference, their last halves observed. Into the torque of observed runs one
effect is put, at one joint or of the whole arm, as large as `SIZE` times what a twin leaves at the joint where it is
largest. Motions stay as they were logged. Physics here is Pinocchio's on the URDF, with speeds by a polynomial over
`SMOOTHED` of the log. Printed is of each: whether the first change that is told is the one put in, and at its joint.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pinocchio as pin
import scipy

from findings import half
from irtwin.document.document import Document
from irtwin.effects.catalogue import BASELINE
from irtwin.gap.diagnosis import diagnose
from irtwin.signals.conditioning import choose_cutoff, condition
from irtwin.signals.log import DataSet, Run, read_data_set
from irtwin.twin.identify import identify

SIZE, SMOOTHED, SEED = 3.0, 0.12, 700  # -, s, -
GRAVITY = np.array([0.0, 0.0, -9.81])

State = tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]  # positions, speeds, accelerations, torque, (N, n)


def bodies(model: pin.Model, state: State) -> np.ndarray:
    """Return (N, n) the torque of a model's bodies."""
    data = model.createData()
    return np.array([pin.rnea(model, data, *row).copy() for row in zip(*state[:3], strict=True)])


def carried(model: pin.Model, state: State) -> np.ndarray:
    """Return (N, n) the torque of 1 kg, 8 cm beyond the last joint and 3 cm beside it."""
    loaded = model.copy()
    for link in range(len(loaded.inertias)):
        loaded.inertias[link] = pin.Inertia.Zero()
    loaded.inertias[model.njoints - 1] = pin.Inertia(1.0, np.array([0.03, 0.0, 0.08]), np.eye(3) * 2e-3)
    return bodies(loaded, state)


def tilted(model: pin.Model, state: State) -> np.ndarray:
    """Return (N, n) what a base that leans by 1 rad of small angles adds."""
    leaning = model.copy()
    leaning.gravity.linear = GRAVITY + 1e-3 * np.cross([0.8, 0.6, 0.0], GRAVITY)
    return np.asarray((bodies(leaning, state) - bodies(model, state)) / 1e-3)


Law = Callable[[State], np.ndarray]
OF_JOINT: dict[str, Law] = {
    "coulomb_friction": lambda s: np.tanh(s[1] / 0.02),
    "viscous_friction": lambda s: s[1],
    "cable_drag": lambda s: (s[0] - 0.3) + 0.1 * (s[0] - 0.3) ** 3,
    "torque_constant_error": lambda s: s[3],
}
OF_ARM = {"payload": carried, "base_tilt": tilted}
KINDS = (None, *OF_JOINT, *OF_ARM)


def state_of(run: Run) -> State:
    """Return what a run did, without the noise of its positions."""
    signals = run.signals
    assert signals.torque is not None
    step = float(np.median(np.diff(signals.time)))
    window = max(2 * int(SMOOTHED / step / 2) + 1, 5)
    q, dq, ddq = (
        scipy.signal.savgol_filter(signals.q, window, 3, deriv=order, delta=step, axis=0) for order in range(3)
    )
    return q, dq, ddq, signals.torque


def in_two(data_set: DataSet) -> DataSet:
    """Return a data set whose runs are in part of reference."""
    if any(run.role == "reference" for run in data_set.runs):
        return data_set
    first, last = (half(data_set, last=each).runs for each in (False, True))
    before = [replace(run, name=f"{run.name}_before", role="reference") for run in first]
    return replace(data_set, runs=(*before, *last))


def left(data_set: DataSet) -> np.ndarray:
    """Return (n,) what a twin leaves of the observed runs' torques, N m RMS."""
    runs = [run for run in data_set.runs if run.role == "observed"]
    cutoff = choose_cutoff(runs)
    motions = [condition(run, data_set.robot, cutoff) for run in runs]
    twin = identify(data_set.robot, motions, BASELINE)
    errors = [np.square(motion.torque - twin.torque(motion)) for motion in motions if motion.torque is not None]
    return np.asarray(np.sqrt(np.nanmean(np.concatenate(errors), axis=0)))


def changed(data_set: DataSet, kind: str, rng: np.random.Generator) -> tuple[DataSet, str | None, float]:
    """Return a data set in whose observed runs something changed, the joint where, and by how much."""
    robot, noise = data_set.robot, left(data_set)
    joint = int(rng.integers(len(robot.joints)))
    observed = [run for run in data_set.runs if run.role == "observed"]
    added = {}
    for run in observed:
        state = state_of(run)
        whole = OF_ARM[kind](robot.model, state) if kind in OF_ARM else OF_JOINT[kind](state)
        added[run.name] = whole if kind in OF_ARM else whole * (np.arange(len(robot.joints)) == joint)
    seen = np.concatenate([each - each.mean(axis=0) for each in added.values()])  # a constant is a run's offset
    strength = SIZE / float(np.max(np.sqrt(np.mean(np.square(seen), axis=0)) / noise))

    def spoilt(run: Run) -> Run:
        if run.name not in added:
            return run
        return replace(run, signals=replace(run.signals, torque=run.signals.torque + strength * added[run.name]))

    runs = tuple(spoilt(run) for run in data_set.runs)
    return replace(data_set, runs=runs), None if kind in OF_ARM else robot.joint_names[joint], strength


def row(name: str, kind: str | None, where: str | None, strength: float, said: Document) -> str:
    """Return what is said of one, as a row: the first cause that changed, and all that are named."""
    changes = [cause for cause in said.causes if cause.scope == "changed"]
    joints = {joint for cause in changes if cause.effect == kind for joint in cause.joints}
    first = "nothing" if not changes else "right" if changes[0].effect == kind else changes[0].effect
    at_joint = "-" if where is None or first != "right" else "right" if joints == {where} else "other"
    told = [f"{one.effect} {one.scope} {', '.join(one.joints)} {one.confidence:.2f}" for one in said.causes]
    put = "nothing" if kind is None else f"{kind} {where or ''} {strength:.3g}"
    return f"| {name} | {put} | {said.verdict} | {first} | {at_joint} | {'; '.join(told)} |"


def main(folders: list[str]) -> None:
    """Print a row for each robot and kind."""
    for number, folder in enumerate(map(Path, folders)):
        whole = in_two(read_data_set(folder))
        for k, kind in enumerate(KINDS):
            rng = np.random.default_rng([SEED, number, k])
            data_set, where, strength = (whole, None, 0.0) if kind is None else changed(whole, kind, rng)
            print(row(folder.name, kind, where, strength, diagnose(data_set).document), flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])

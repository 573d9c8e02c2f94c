"""A desktop arm's simulator held against its logs of commands and positions.

    python bench/so101.py FOLDER MODEL.xml

FOLDER: a data set of commands and positions without torque (`docs/LOG_FORMAT.md`); MODEL.xml: its model in MuJoCo.
Three splits are measured. "within": the eight motions whose commands go farthest are fitted, so that the others lie
within what was seen. "first": the first eight are. Each is fitted, written into the model's file, read back and played
on the motions that are left, and on these until the gripper first lies on the table. "halves": what is named on each
half of the motions. Then the model is changed by numbers that are known, played, and diagnosed, and so is the model
itself.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import mujoco
import numpy as np

from irtwin.signals.log import DataSet, Run, read_data_set
from irtwin.simulator.model import Model, read_model
from irtwin.simulator.play import play, whole
from irtwin.simulator.playing import Playing, diagnose
from irtwin.simulator.servos import NAMES, Servos, servos

FITTED = 8
_SITE, _TABLE = "gripperframe", -0.038  # m, below which the gripper is when it cannot go on down
_NOISE = 1e-3  # rad, of positions that are made
_CHANGES = (  # number, joint, what it is times the model's, or more than it
    (),
    (
        ("armature", 0, 2.0, 0.0),
        ("stiffness", 1, 1.5, 0.0),
        ("damping", 2, 0.6, 0.0),
        ("friction", 3, 3.0, 0.0),
        ("offset", 4, 1.0, 0.02),
        ("delay", 5, 1.0, 0.03),
    ),
)


def farthest(runs: Sequence[Run]) -> list[str]:
    """Return the names of runs by how far their commands go, over all joints, the farthest first."""
    return [run.name for run in sorted(runs, key=lambda run: -np.ptp(run.signals.command, axis=0).sum())]


def split(data_set: DataSet, model: Model, names: Sequence[str]) -> None:
    """Fit some runs; print what the written model leaves of the others, mrad, and the time."""
    begin = time.perf_counter()
    found = diagnose(runs_of(data_set, names), model)
    took = time.perf_counter() - begin
    with TemporaryDirectory() as folder:
        file = Path(folder) / "robot.xml"
        file.write_bytes(found.written())
        own = servos(read_model(file, data_set.robot))
        others = [run for run in data_set.runs if run.name not in names]
        left, clear = ({run.name: tracking_error(own, run, until) for run in others} for until in (False, True))
    print(f"  {took:.0f} s; fitted {', '.join(names)}")
    for said, found_left in (("whole", left), ("until the table", clear)):
        print(f"  {said}: " + ", ".join(f"{name} {rms:.1f}" for name, rms in found_left.items()))
        print(f"  median {np.median(list(found_left.values())):.1f}, worst {max(found_left.values()):.1f} mrad")


def halves(data_set: DataSet, model: Model) -> None:
    """Print what is named on every second run, and on the others, and on both."""
    names = [run.name for run in data_set.runs]
    told = [_named(diagnose(runs_of(data_set, names[half::2]), model)) for half in (0, 1)]
    both = told[0] & told[1]
    print(f"  {len(told[0])} and {len(told[1])} numbers, {len(both)} in both; effects in both: ", end="")
    print(", ".join(sorted({name for _, name in both})))


def known(data_set: DataSet, model: Model) -> None:
    """Change the model by numbers that are known, play it, and print whether these are found, and what else is."""
    own = servos(model)
    start = own.numbers.copy()
    start[0], start[1] = 20.0, 1.2  # as stiff as such a robot is
    own = replace(own, numbers=start)
    with TemporaryDirectory() as folder:
        file = Path(folder) / "base.xml"
        file.write_bytes(own.written(start, start != servos(model).numbers))
        base = read_model(file, data_set.robot)
        for changes in _CHANGES:
            true = start.copy()
            for name, joint, times, more in changes:
                true[NAMES.index(name), joint] = true[NAMES.index(name), joint] * times + more
            rng, runs = np.random.default_rng(1), []
            for run in data_set.runs[:6]:
                q = play(own, [true], [whole(run)])[0][0][:, 0]
                runs.append(replace(run, signals=replace(run.signals, q=q + _NOISE * rng.standard_normal(q.shape))))
            found = diagnose(replace(data_set, runs=tuple(runs)), base)
            print(f"  {_judged(found, data_set, changes, true)}", flush=True)


def _judged(
    found: Playing, data_set: DataSet, changes: Sequence[tuple[str, int, float, float]], true: np.ndarray
) -> str:
    wanted = {(data_set.robot.joint_names[joint], name) for name, joint, *_ in changes}
    first = found.document.causes[0].parameters[0].name if found.document.causes else "none"
    within = 0
    numbers = [one for cause in found.document.causes for one in cause.parameters]
    for one in numbers:
        change = true[NAMES.index(one.name), data_set.robot.joint_names.index(one.joint)] - (one.simulator or 0.0)
        within += one.interval95 is not None and one.interval95[0] <= change <= one.interval95[1]
    says = ", ".join(f"{name} of {joint}" for joint, name in sorted(wanted)) or "no difference"
    extra = _named(found) - wanted
    return (
        f"{says}: {found.document.verdict}, first {first}, {len(_named(found) & wanted)} of {len(wanted)} found, "
        f"{within} of {len(numbers)} within their intervals, {len(extra)} not there {sorted(extra) or ''}"
    )


def _named(found: Playing) -> set[tuple[str, str]]:
    return {(one.joint, one.name) for cause in found.document.causes for one in cause.parameters}


def runs_of(data_set: DataSet, names: Sequence[str]) -> DataSet:
    return replace(data_set, runs=tuple(run for run in data_set.runs if run.name in names))


def tracking_error(own: Servos, run: Run, until_table: bool = False) -> float:
    left = run.signals.q - play(own, [own.numbers], [whole(run)])[0][0][:, 0]
    return 1e3 * float(np.sqrt((left[: _touches(own.model, run) if until_table else None] ** 2).mean()))


def _touches(model: Model, run: Run) -> int | None:
    """Return the first row at which the gripper lies on the table, if any does."""
    data = mujoco.MjData(model.compiled)
    for row, q in enumerate(run.signals.q):
        data.qpos[model.positions] = q
        mujoco.mj_kinematics(model.compiled, data)
        if data.site(_SITE).xpos[2] < _TABLE:
            return row
    return None


def main() -> None:
    """Measure, and print."""
    data_set = read_data_set(sys.argv[1], commanded=True)
    model = read_model(Path(sys.argv[2]), data_set.robot)
    print("simulator as published, mrad")
    print("  " + ", ".join(f"{run.name} {tracking_error(servos(model), run):.1f}" for run in data_set.runs))
    print("within: fitted to those that go farthest", flush=True)
    split(data_set, model, farthest(data_set.runs)[:FITTED])
    print("first: fitted to the first eight", flush=True)
    split(data_set, model, [run.name for run in data_set.runs[:FITTED]])
    print("halves", flush=True)
    halves(data_set, model)
    print("known changes", flush=True)
    known(data_set, model)


if __name__ == "__main__":
    main()

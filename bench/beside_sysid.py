"""Ours beside MuJoCo's own system identification, on the same motions of a desktop arm.

    pip install "mujoco[sysid]"
    python bench/beside_sysid.py FOLDER MODEL.xml

FOLDER, MODEL.xml and the two splits are those of `so101.py`. Each is fitted thrice: by the diagnosis; by the script
that it hands over, which frees what was found to differ and begins there; and by the same script with the numbers that
one frees who has no diagnosis (both gains of a servo, damping, dry friction and armature of every joint), from the
model's own. Each model that is written is played on the motions that are left.
"""

from __future__ import annotations

import resource
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from irtwin.signals.log import DataSet, read_data_set
from irtwin.simulator.model import Model, read_model
from irtwin.simulator.playing import diagnose
from irtwin.simulator.servos import servos
from irtwin.simulator.sysid import Free, script, written
from so101 import FITTED, farthest, runs_of, tracking_error

_FACTOR = 300.0  # either way, within which a number is looked for that nobody has an idea of


def split(data_set: DataSet, model: Model, names: list[str]) -> None:
    """Fit some runs; print what each of the three leaves of the others, mrad, and the processor's time that it took."""
    some = runs_of(data_set, names)
    with TemporaryDirectory() as folder:
        logs = _logs(some, Path(folder) / "logs")
        begin = _processor()
        found = diagnose(some, model)
        took = _processor() - begin
        (Path(folder) / "ours.xml").write_bytes(found.written())
        print(f"  {sum(found.chosen.differs.sum(axis=0))} of {found.chosen.differs.size} numbers named", flush=True)
        _tell("diagnosis", Path(folder) / "ours.xml", took, data_set, names)
        for told, fit in (("handed over", "handed.py"), ("sysid alone", "alone.py")):
            file = Path(folder) / fit
            text = (
                script(found.chosen, found.document, logs, file)
                if fit == "handed.py"
                else written(everything(model), (), model.file.path, logs, file)
            )
            file.write_bytes(text)
            begin = _processor()
            with file.with_suffix(".log").open("w") as log:
                subprocess.run([sys.executable, str(file)], check=True, stdout=log)
            took = _processor() - begin
            said = file.with_suffix(".log").read_text().splitlines()
            print(f"  {told}: {next(line for line in said if line.startswith('Tracking'))}")
            _tell(told, file.with_name(f"{file.stem}-fitted.xml"), took, data_set, names)


def everything(model: Model) -> Iterator[Free]:
    """Yield what one frees who does not know what differs: five numbers of each joint, from the model's."""
    own = servos(model)
    joint, servo = own.dampings(own.numbers[1])
    compiled, dof = model.compiled, model.speeds
    for place, name in enumerate(model.joints):
        told = {
            "kp": own.numbers[0, place],
            "kv": servo[place],
            "damping": joint[place],
            "frictionloss": compiled.dof_frictionloss[dof[place]],
            "armature": compiled.dof_armature[dof[place]],
        }
        for number, value in told.items():
            if value > 0:
                yield name, number, [value], [value], [value / _FACTOR], [value * _FACTOR]


def _processor() -> float:
    """Return the time of the processor so far, s, with that of programs that ended."""
    used = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(one.ru_utime + one.ru_stime for one in used)


def _logs(data_set: DataSet, folder: Path) -> Path:
    folder.mkdir()
    shutil.copy(data_set.folder / "robot.urdf", folder)
    lines = ["[robot]", f'name = "{data_set.robot.name}"', 'urdf = "robot.urdf"']
    for run in data_set.runs:
        shutil.copy(run.file, folder)
        lines.append(f'[[run]]\nfile = "{run.file.name}"')
    (folder / "dataset.toml").write_text("\n".join(lines) + "\n", encoding="utf-8")
    return folder


def _tell(told: str, file: Path, took: float, data_set: DataSet, names: list[str]) -> None:
    own = servos(read_model(file, data_set.robot))
    left = {run.name: tracking_error(own, run) for run in data_set.runs if run.name not in names}
    said = ", ".join(f"{name} {rms:.1f}" for name, rms in left.items())
    median, worst = np.median(list(left.values())), max(left.values())
    print(f"  {told}: {said}; median {median:.1f}, worst {worst:.1f} mrad, {took:.0f} s", flush=True)


def main() -> None:
    """Measure, and print."""
    data_set = read_data_set(sys.argv[1], commanded=True)
    model = read_model(Path(sys.argv[2]), data_set.robot)
    for told, names in (("within", farthest(data_set.runs)), ("first", [run.name for run in data_set.runs])):
        print(f"{told}: fitted to {', '.join(names[:FITTED])}", flush=True)
        split(data_set, model, names[:FITTED])


if __name__ == "__main__":
    main()

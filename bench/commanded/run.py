"""`python -m commanded.run MODELS FOLDER [--count 24] [--torque] [--split 1]`: make sealed cases, then judge them.

With `--kinds elasticity,offset` they are development cases that differ in these; with `--feedforward` their controllers
add the torque of the robot as drawn.

MODELS is where `pip download --no-deps robosuite gymnasium-robotics -d MODELS` put its wheels. The first call makes the
cases, writes `labels.json` in FOLDER_labels and prints its SHA-256: commit that. The second diagnoses those that are
not yet diagnosed, one after another, and writes `page.md` beside the labels. What was found stands in
`RESULTS_COMMANDED.md`, and where torque was logged, too, in `RESULTS_COMMANDED_TORQUE.md`.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import time
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

from closed_loop.models import read_model as read_arm
from commanded.cases import NOISE, Case, labels, make, of_kinds, plans
from irtwin.diagnosing import diagnose
from irtwin.errors import InputError
from irtwin.signals.log import read_data_set
from irtwin.simulator.callback import apply
from irtwin.simulator.model import read_model
from irtwin.simulator.play import PlayedStretch, play, whole
from irtwin.simulator.servos import Servos, servos

EFFECTS = {  # what each kind is called by a diagnosis
    "armature": "rotor_inertia", "damping": "viscous_friction", "friction": "coulomb_friction",
    "stiffness": "servo_stiffness", "payload": "payload", "delay": "command_delay", "backlash": "servo_dead_band",
    "torque_limit": "servo_torque_limit", "offset": "command_offset", "tilt": "base_tilt",
    "spring": "cable_drag", "elasticity": "joint_elasticity", "contact": "external_contact",
}  # fmt: skip
APART = ("c_", "angle_y", "f_", "start", "stop")  # labels have a mass, a tilt's first angle and the size of a force
Label = Mapping[str, Any]


def seal(models: Path, folder: Path, cases: Iterable[Case]) -> None:
    """Make the cases and apart their labels; print the checksum of these."""
    made, joints = {}, {}
    for case in cases:
        made[case.name] = case, make(case, models, folder)
        joints[case.name] = read_arm(models, case.arm).joints
        print(f"made {case.name}", flush=True)
    apart = Path(f"{folder}_labels")
    apart.mkdir()
    (apart / "labels.json").write_text(labels(made, joints), encoding="utf-8")
    print(f"sha256 of the labels: {_sum(apart / 'labels.json')}; commit it, then call this again")


def judge(folder: Path) -> dict[str, Any]:
    """Diagnose a case; return its document, and what its written model leaves of the runs that were held out, rad.

    "with_callback": what it leaves while it is told what its file cannot hold.
    """
    begin = time.process_time()
    new = folder / "written.xml"
    new.unlink(missing_ok=True)
    found = diagnose(folder / "data", simulator=folder / "model.xml", simulator_file=new)
    robot = read_data_set(folder / "data", commanded=True).robot
    left = {}
    for name, file in (("before", folder / "model.xml"), ("after", new)):
        own = servos(read_model(file, robot))
        runs = read_data_set(folder / "held_out", commanded=True).runs
        squares = [((run.signals.q - play(own, [own.numbers], [whole(run)])[0][0][:, 0]) ** 2).mean() for run in runs]
        left[name] = float(np.sqrt(np.mean(squares)))
    said = folder / "document.json"
    said.write_text(json.dumps(found.document.to_json()), encoding="utf-8")
    squares = [((run.signals.q - called_back(own, said, whole(run))) ** 2).mean() for run in runs]
    left["with_callback"] = float(np.sqrt(np.mean(squares)))
    return {"document": found.document.to_json(), "left": left, "seconds": time.process_time() - begin}


def called_back(own: Servos, said: Path, stretch: PlayedStretch) -> np.ndarray:
    """Return the positions (N, n) of a written model that MuJoCo moves with what a diagnosis says that it lacks."""
    compiled = mujoco.MjModel.from_xml_path(str(own.model.file.path))
    apply(compiled, said)
    try:
        data, step = mujoco.MjData(compiled), compiled.opt.timestep
        data.qpos[own.model.positions], data.qvel[own.model.speeds] = stretch.state()
        steps = round(stretch.time[-1] / step)
        told = stretch.commands(np.arange(steps) * step, step, np.zeros_like(own.numbers))
        if own.feedforward:  # as a servo's own, so that its limit holds for both
            told += stretch.fed(own.feedforward, np.arange(steps) * step, np.zeros_like(own.numbers)) / own.numbers[0]
        for drive, first in zip(own.actuators, told[0], strict=True):
            if samples := int(compiled.actuator_history[drive, 0]):
                mujoco.mj_initCtrlHistory(compiled, data, int(drive), None, np.full((samples, 1), first))
        moved = np.empty((steps + 1, len(told[0])))
        for row, each in enumerate(told):
            moved[row], data.ctrl[own.actuators] = data.qpos[own.model.positions], each
            mujoco.mj_step(compiled, data)
        moved[-1] = data.qpos[own.model.positions]
        return np.column_stack([np.interp(stretch.time, np.arange(steps + 1) * step, one) for one in moved.T])
    finally:
        mujoco.set_mjcb_passive(None)


def score(label: Label, found: Mapping[str, Any]) -> dict[str, Any]:
    """Return what of a case is right: first cause, its joint, numbers within their intervals, all that differs."""
    causes = [one for one in found["document"]["causes"] if not one.get("folded_away")]
    wanted = {EFFECTS[one["kind"]]: _as_told(one) for one in label["differences"]}
    first = causes[0] if causes else None
    right = (first["effect"] in wanted) if first and wanted else not first and not wanted
    joint = bool(first and right and first["joints"] == [one for one in [wanted[first["effect"]]["joint"]] if one])
    within = [
        number["interval95"][0]
        <= wanted[cause["effect"]]["robot"] - wanted[cause["effect"]]["simulator"]
        <= number["interval95"][1]
        for cause in causes
        for number in cause["parameters"]
        if cause["effect"] in wanted and number["joint"] == wanted[cause["effect"]]["joint"] and number["interval95"]
        if not number["name"].startswith(APART)
    ]
    return {
        "first": right,
        "joint": joint or (right and not wanted),
        "within": within,
        "all": set(wanted) <= {one["effect"] for one in causes},
        "else": sorted({one["effect"] for one in causes} - set(wanted)),
    }


def _as_told(difference: Mapping[str, Any]) -> Mapping[str, Any]:
    """Return a difference as it is told: elasticity as the stiffness of a joint."""
    is_elastic = difference["kind"] == "elasticity"
    return {**difference, "robot": 1 / difference["robot"]} if is_elastic else difference


def page(told: Mapping[str, Label], found: Mapping[str, Mapping[str, Any]], checksum: str) -> str:
    """Return the results as Markdown."""
    judged = {name: score(told[name], one) for name, one in found.items()}
    single = [name for name in judged if len(told[name]["differences"]) == 1]
    pairs = [name for name in judged if len(told[name]["differences"]) == 2]
    nulls = [name for name in judged if not told[name]["differences"]]
    within = [one for judgement in judged.values() for one in judgement["within"]]
    near = {way: sum(found[name]["left"][way] <= 1.2 * NOISE for name in judged) for way in ("after", "with_callback")}
    lines = [
        "# What a model that is told commands has wrong",
        "",
        f"`python -m commanded.run MODELS FOLDER`; sha256 of the labels {checksum}. {len(judged)} of {len(told)} cases",
        "were diagnosed. Left: RMS on held-out motions by the model as given, and with the numbers found; the true arm",
        f"leaves its noise, {1e3 * NOISE:g} mrad.",
        "",
        f"- one difference: first cause right {_of(single, judged, 'first')}, its joint {_of(single, judged, 'joint')}",
        f"- two: both named {_of(pairs, judged, 'all')}; none: nothing named {_of(nulls, judged, 'first')}",
        f"- numbers within their interval: {sum(within)} of {len(within)}",
        f"- held-out motions within 1.2 of what the true arm leaves: {near['after']} of {len(judged)} by the file, "
        f"{near['with_callback']} with `irtwin.simulator.callback` beside it",
        "",
        "| case | arm | differs | verdict | first | right | joint | else | left, mrad | then | with callback | s |",
        "| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |",
    ]
    for name, one in judged.items():
        differs = ", ".join(f"{each['kind']} {each['joint'] or ''}".strip() for each in told[name]["differences"])
        causes, left = found[name]["document"]["causes"], found[name]["left"]
        first = f"{causes[0]['effect']} {', '.join(causes[0]['joints'])}" if causes else "-"
        lines.append(
            f"| {name} | {told[name]['arm']} | {differs or 'nothing'} | {found[name]['document']['verdict']} | {first} "
            f"| {_yes(one['first'])} | {_yes(one['joint'])} | {', '.join(one['else']) or '-'} "
            f"| {1e3 * left['before']:.2f} | {1e3 * left['after']:.2f} | {1e3 * left['with_callback']:.2f} "
            f"| {found[name]['seconds']:.0f} |"
        )
    return "\n".join([*lines, ""])


def _of(names: list[str], judged: Mapping[str, Mapping[str, Any]], what: str) -> str:
    return f"{sum(judged[name][what] for name in names)} of {len(names)}"


def _yes(right: bool) -> str:
    return "yes" if right else "no"


def _sum(file: Path) -> str:
    return hashlib.sha256(file.read_bytes()).hexdigest()


def main() -> None:
    """Make the cases, or diagnose and score them."""
    parser = argparse.ArgumentParser(prog="python -m commanded.run", description=__doc__)
    parser.add_argument("models", type=Path)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--count", type=int, default=24)
    parser.add_argument("--torque", action="store_true", help="log the servos' torque, too")
    parser.add_argument("--split", type=int, default=0, help="which cases: others by each number")
    parser.add_argument("--feedforward", action="store_true", help="controllers add the torque of their own model")
    parser.add_argument("--kinds", default="", help="development cases of these kinds, as elasticity,offset")
    arguments = parser.parse_args()
    file = Path(f"{arguments.folder}_labels") / "labels.json"
    if not file.exists():
        count, torque, fed = arguments.count, arguments.torque, arguments.feedforward
        kinds = tuple(filter(None, arguments.kinds.split(",")))
        cases = of_kinds(kinds, count, torque, fed=fed) if kinds else plans(count, torque, arguments.split, fed=fed)
        seal(arguments.models, arguments.folder, cases)
        return
    told, found = json.loads(file.read_text(encoding="utf-8")), {}
    for name in told:
        out = arguments.folder / name / "found.json"
        if not out.exists():
            try:
                out.write_text(json.dumps(judge(arguments.folder / name)), encoding="utf-8")
            except InputError as error:
                print(f"{name}: {error}", flush=True)
                continue
        found[name] = json.loads(out.read_text(encoding="utf-8"))
        print(name, score(told[name], found[name]), found[name]["left"], flush=True)
        file.with_name("page.md").write_text(page(told, found, _sum(file)), encoding="utf-8")


if __name__ == "__main__":
    main()

"""Two sides that are equal: `python equal_sides.py FOLDER MODELS [DATASET...] [--pairs 40]`: is any difference named?

Pairs of a simulator and a robot, one kind after another: the same bytes on both sides; the same physics with other
noise; with other motions besides; DATASETs, measured ones, copied to both sides; and, told commands, the model of an
arm beside logs of an arm that is that very model. MODELS is as `commanded.run` has it. Each is to be `no_gap`.
"""

from __future__ import annotations

import argparse
import json
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from blind.motions import exciting
from commanded import cases as commanded
from irtwin.document.document import Document
from irtwin.errors import InputError
from irtwin.gap.diagnosis import diagnose
from irtwin.report.gap.verdict import agrees
from irtwin.signals.log import read_data_set
from irtwin.simulator import playing
from irtwin.simulator.model import read_model
from own_simulator import SECONDS, simulate
from plant.drawings import read_drawings

ROBOTS = ("elbow6", "pall4", "slim7")
RUNS = 4
NOISE = 3e-3  # of a joint's largest torque
OUT = Path(__file__).parent / "RESULTS_EQUAL.md"


def beside_logs(folder: Path, number: int, kind: str) -> Document:
    """Diagnose MuJoCo's logs of a robot beside such logs of the same robot."""
    drawings, rng = read_drawings(ROBOTS[number % len(ROBOTS)]), np.random.default_rng([number, 3])
    (folder / "runs").mkdir(parents=True)
    (folder / "robot.urdf").write_text(drawings.urdf, encoding="utf-8")
    lines = ["[robot]", f'name = "{folder.name}"', 'urdf = "robot.urdf"']
    for run in range(RUNS):
        motion = exciting(drawings, SECONDS, 0.9, 0.7, rng)
        for role in ("simulated", "observed"):
            if kind == "motions" and role == "observed":
                motion = exciting(drawings, SECONDS, 0.9, 0.7, rng)
            q, tau = simulate(drawings, motion, True)
            if kind != "bytes":
                tau = tau + NOISE * np.abs(tau).max(axis=0) * rng.standard_normal(tau.shape)
            columns = {"time": drawings.log_interval * np.arange(len(q))}
            for k, name in enumerate(drawings.joints):
                columns |= {f"q_{name}": q[:, k], f"tau_{name}": tau[:, k]}
            pq.write_table(pa.table(columns), folder / "runs" / f"{role}_{run}.parquet")
            lines.append(f'\n[[run]]\nfile = "runs/{role}_{run}.parquet"\nrole = "{role}"')
    (folder / "dataset.toml").write_text("\n".join(lines) + "\n", encoding="utf-8")
    return diagnose(read_data_set(folder)).document


def measured(data_set: Path) -> Document:
    """Diagnose measured runs beside copies of themselves as a simulator's."""
    found = read_data_set(data_set)
    observed = [replace(run, role="observed") for run in found.runs]
    copies = [replace(run, role="simulated", name=f"{run.name} copied", repeat_of=None) for run in observed]
    return diagnose(replace(found, runs=(*observed, *copies))).document


def beside_model(folder: Path, number: int, models: Path) -> Document:
    """Diagnose logs of an arm that was told commands beside the model that it is."""
    arm, has_torque = commanded.ARMS[number % len(commanded.ARMS)], bool(number % 2)
    case = commanded.Case(folder.name, arm, 51_000_000 + number, 0, has_torque)
    commanded.make(case, models, folder.parent)
    data_set = read_data_set(folder / "data", commanded=True)
    return playing.diagnose(data_set, read_model(folder / "model.xml", data_set.robot)).document


def pair(kind: str, number: int, folder: Path, models: Path, data_sets: list[Path]) -> Document:
    """Make a pair and diagnose it."""
    place = folder / f"{kind}_{number:02d}"
    shutil.rmtree(place, ignore_errors=True)
    if kind == "measured":
        return measured(data_sets[number % len(data_sets)])
    return beside_model(place, number, models) if kind == "commands" else beside_logs(place, number, kind)


def told(document: Document) -> str:
    """Say the largest difference, that which no verdict counts too, and how far the simulator agrees with the robot."""
    first = max(document.findings, key=lambda one: one.share, default=None)
    shrink = document.shrink
    tracking, torque = (None if one is None else one.before for one in (shrink.position_rmse, shrink.torque_rmse))
    left = agrees("simulated", tracking, torque) or "-"
    if first is None:
        return f"nothing | {left}"
    return f"{first.family} {', '.join(first.joints)}: {100 * first.share:.2g} % of {first.share_of} | {left}"


def main() -> None:
    """Diagnose the pairs, and write what was said of each."""
    parser = argparse.ArgumentParser(prog="python equal_sides.py", description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("models", type=Path)
    parser.add_argument("data_sets", type=Path, nargs="*")
    parser.add_argument("--pairs", type=int, default=40)
    arguments = parser.parse_args()
    kinds = ["bytes", "noise", "motions", "commands", *(["measured"] if arguments.data_sets else [])]
    rows: list[tuple[str, str, str]] = []
    for number in range(arguments.pairs):
        kind = kinds[number % len(kinds)]
        try:
            found = pair(kind, number // len(kinds), arguments.folder, arguments.models, arguments.data_sets)
            rows.append((f"{kind} {number // len(kinds)}", found.verdict, told(found)))
        except InputError as error:
            rows.append((f"{kind} {number // len(kinds)}", "refused", f"{error} | -"))
        print(json.dumps(rows[-1]), flush=True)
        right = sum(verdict == "no_gap" for _, verdict, _ in rows)
        lines = ["# Two sides that are equal", "", f"`no_gap` in {right} of {len(rows)}: `python equal_sides.py`.", ""]
        lines += [
            "| pair | verdict | largest difference | the simulator agrees with the robot |",
            "| --- | --- | --- | --- |",
        ]
        lines += [f"| {' | '.join(row)} |" for row in rows]
        OUT.write_text("\n".join([*lines, ""]), encoding="utf-8")


if __name__ == "__main__":
    main()

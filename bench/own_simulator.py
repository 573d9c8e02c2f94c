"""`python own_simulator.py FOLDER`: what does a user's own simulator lack? MuJoCo's logs against the plant's.

Each case is a data set whose `simulated` runs are MuJoCo's logs of the URDF, with MuJoCo's own damping, frictionloss
and armature or without, of the same motions or of others, without noise; its `observed` runs are the plant's, a robot
built ten percent off the URDF, with an effect that the simulator does not have. The diagnosis has to name it.
"""

from __future__ import annotations

import argparse
import json
import shutil
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from blind.cases import Case, Plan, write_runs
from blind.catalogue import Draw, draw
from blind.motions import exciting
from irtwin.demo.plant.arm import PlantPayload
from irtwin.demo.plant.machine import Drawings
from irtwin.demo.plant.motion import PlantMotion
from irtwin.gap.diagnosis import diagnose
from irtwin.signals.log import read_data_set

SECONDS = 8.0
RUNS = 5  # of the simulator
CONTROL = 0.001  # s, of the simulator's controller
STIFFNESS, DAMPING = 400.0, 40.0  # rad/s^2 per rad and per rad/s, of its computed torque
# what the user's simulator and robot differ in anyway: masses, rotors and friction were built to tolerances
TOLERATED = {"rigid_body", "rotor_inertia", "coulomb_friction", "viscous_friction", "torque_offset"}
OUT = Path(__file__).parent / "RESULTS_SIMULATOR.md"


@dataclass(frozen=True)
class Comparison:
    """A robot with an effect (None: as drawn, to tolerances) beside a simulator with friction or without."""

    robot: str
    effect: str | None
    joints: tuple[int, ...] = ()
    friction: bool = True  # of the simulator
    same: bool = False  # motions
    level: float = 3.0  # gap in noise floors

    @property
    def name(self) -> str:
        place = "".join(str(joint + 1) for joint in self.joints)
        parts = [self.robot, self.effect or "nothing", place, "" if self.friction else "frictionless"]
        return "-".join(filter(None, [*parts, "same" if self.same else "other"]))


COMPARISONS = (
    Comparison("elbow6", "stribeck_friction", (2,)),
    Comparison("elbow6", "stribeck_friction", (2,), same=True),
    Comparison("elbow6", "stribeck_friction", (2,), friction=False),
    Comparison("elbow6", None, friction=False),
    Comparison("elbow6", None),
    Comparison("elbow6", "payload"),
    Comparison("elbow6", "time_delay", (1,)),
    Comparison("elbow6", "cable_drag", (4,)),
    Comparison("pall4", "stribeck_friction", (2,)),
    Comparison("pall4", None, friction=False),
    Comparison("pall4", "torque_ripple", (0,), same=True),
    Comparison("pall4", None),
    Comparison("slim7", "stribeck_friction", (2,)),
    Comparison("slim7", "load_dependent_friction", (1,)),
    Comparison("slim7", "payload", friction=False),
    Comparison("slim7", None, same=True),
)


def simulate(drawings: Drawings, motion: PlantMotion, friction: bool) -> tuple[np.ndarray, np.ndarray]:
    """Log positions and joint torque, (N, n), of MuJoCo's forward dynamics under computed torque, as drawn."""
    spec = mujoco.MjSpec.from_string(drawings.urdf)
    spec.compiler.fusestatic = False
    model = spec.compile()
    model.opt.timestep = CONTROL
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT | mujoco.mjtDisableBit.mjDSBL_LIMIT
    model.dof_armature[:] = drawings.drive.joint_inertia
    if friction:
        model.dof_damping[:] = drawings.friction.viscous
        model.dof_frictionloss[:] = drawings.friction.coulomb
    data, plan = mujoco.MjData(model), mujoco.MjData(model)
    count = round(drawings.step / CONTROL)
    stride = round(drawings.log_interval / CONTROL)
    fine = np.arange(len(motion.q) * count) / count
    at = np.arange(len(motion.q))
    wanted = [
        np.stack([np.interp(fine, at, signal[:, joint]) for joint in range(model.nv)], axis=1)
        for signal in (motion.q, motion.dq, motion.ddq)
    ]
    data.qpos[:] = wanted[0][0]
    positions, torques = np.empty_like(wanted[0]), np.empty_like(wanted[0])
    for row, (q, dq, ddq) in enumerate(zip(*wanted, strict=True)):
        plan.qpos[:], plan.qvel[:] = data.qpos, data.qvel
        plan.qacc[:] = ddq + STIFFNESS * (q - data.qpos) + DAMPING * (dq - data.qvel)
        mujoco.mj_inverse(model, plan)
        positions[row], torques[row] = data.qpos, plan.qfrc_inverse
        data.qfrc_applied[:] = plan.qfrc_inverse
        mujoco.mj_step(model, data)
    return positions[::stride], torques[::stride]


def make(comparison: Comparison, folder: Path) -> Path:
    """Write the comparison's data set; return its folder."""
    number = COMPARISONS.index(comparison)
    effects = (comparison.effect,) if comparison.effect else ()
    kind = "single" if effects else "clean_null"
    plan = Plan(comparison.name, 40_000_000 + number, comparison.robot, kind, effects, comparison.level, "missing")
    case = Case(plan)
    case.prepare()
    placed = []
    for name in effects:
        drawn = draw(name, case.machine, case.observed, True, case.rng)
        joints = comparison.joints or drawn.effect.joints
        placed.append(case.calibrate(Draw(replace(drawn.effect, joints=joints), drawn.most), comparison.level)[0])
    traces, seen, power = case.simulate(tuple(placed))
    data = folder / comparison.name
    shutil.rmtree(data, ignore_errors=True)
    (data / "runs").mkdir(parents=True)
    write_runs(case, data, traces, *case.noisy(seen, power))
    rng = np.random.default_rng(plan.seed)
    drawings = case.machine.drawings
    with (data / "dataset.toml").open("a", encoding="utf-8") as description:
        for run in range(RUNS):
            bare = [m for m, payload in zip(case.motions, case.payloads, strict=True) if payload == PlantPayload()]
            motion = bare[2 * run % len(bare)] if comparison.same else exciting(drawings, SECONDS, 0.9, 0.7, rng)
            q, tau = simulate(drawings, motion, comparison.friction)
            columns = {"time": drawings.log_interval * np.arange(len(q))}
            columns |= {f"q_{name}": q[:, k] for k, name in enumerate(drawings.joints)}
            columns |= {f"tau_{name}": tau[:, k] for k, name in enumerate(drawings.joints)}
            pq.write_table(pa.table(columns), data / "runs" / f"mujoco_{run}.parquet")
            description.write(f'\n[[run]]\nfile = "runs/mujoco_{run}.parquet"\nrole = "simulated"\n')
    return data


def judge(comparison: Comparison, data: Path) -> dict[str, Any]:
    """Diagnose a data set, and say whether what was named is what the simulator lacks."""
    data_set = read_data_set(data)
    found = diagnose(data_set).to_json()
    names = data_set.robot.joint_names
    lacked = [cause for cause in found["causes"] if cause["scope"] == "changed"]
    wanted: dict[str, set[str]] = {}
    if comparison.effect:
        wanted[comparison.effect] = {names[joint] for joint in comparison.joints}
    if not comparison.friction:
        wanted |= {name: set(names) for name in ("coulomb_friction", "viscous_friction")}
    named = {cause["effect"]: set(cause["joints"]) for cause in lacked}
    classes = {name: cause for cause in lacked for name in (cause["effect"], *cause["indistinguishable_from"])}
    return {
        "verdict": found["verdict"],
        "named": all(name in named and wanted[name] <= named[name] for name in wanted),
        "in class": all(name in classes and wanted[name] <= set(classes[name]["joints"]) for name in wanted),
        "else": [
            f"{cause['effect']} ({cause['scope']}) {', '.join(cause['joints'])}"
            for cause in found["causes"]
            if cause["effect"] not in wanted and (cause["effect"] not in TOLERATED or cause["scope"] != "changed")
        ],
        "causes": [
            (cause["effect"], cause["scope"], cause["joints"], round(cause["confidence"], 2))
            for cause in found["causes"]
        ],
        "closed": found["shrink"]["closed_fraction"],
    }


def work(task: tuple[Comparison, Path]) -> tuple[Comparison, dict[str, Any]]:
    """Make a comparison's data set unless it is there, and judge its diagnosis."""
    comparison, folder = task
    data = folder / comparison.name
    return comparison, judge(comparison, data if data.is_dir() else make(comparison, folder))


def page(results: list[tuple[Comparison, dict[str, Any]]]) -> str:
    """Return the results as Markdown."""
    lines = [
        "# What a user's own simulator lacks",
        "",
        "`python own_simulator.py FOLDER`: noiseless MuJoCo logs of the URDF beside the plant, 10 % off in mass.",
        "Named: every effect that the simulator lacks, on every one of its joints. Else: what was named besides,",
        "other than bodies, rotors, friction levels and offsets, which differ anyway.",
        "",
        "| robot, effect, joint, simulator's motions | verdict | named | in class | else |",
        "| --- | --- | --- | --- | --- |",
    ]
    for comparison, found in results:
        said = ["yes" if found[key] else "no" for key in ("named", "in class")]
        lines.append(
            f"| {comparison.name} | {found['verdict']} | {' | '.join(said)} | {'; '.join(found['else']) or '-'} |"
        )
    return "\n".join([*lines, ""])


def main() -> None:
    parser = argparse.ArgumentParser(prog="python own_simulator.py", description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--out", type=Path, default=OUT)
    arguments = parser.parse_args()
    arguments.folder.mkdir(parents=True, exist_ok=True)
    tasks = [(comparison, arguments.folder) for comparison in COMPARISONS]
    results = []
    with ProcessPoolExecutor(arguments.workers) as pool:
        for comparison, found in pool.map(work, tasks):
            print(comparison.name, json.dumps(found), flush=True)
            results.append((comparison, found))
    arguments.out.write_text(page(results), encoding="utf-8")


if __name__ == "__main__":
    main()

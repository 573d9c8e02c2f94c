"""The seed paper's case study, end to end: a motion is planned, priced, kept, mapped, read back, measured and shown."""

from __future__ import annotations

import shutil
import tomllib
from collections.abc import Callable
from functools import partial
from importlib.util import find_spec
from pathlib import Path

import numpy as np

from irtwin import plans, resources, rewriting, workflow
from irtwin.announce import Announce
from irtwin.errors import InputError
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.location import Location
from irtwin.planning.plan import Plan, Task
from irtwin.planning.poses import read_target
from irtwin.providers.mesh_files import meshes_of_graph
from irtwin.providers.names import identifier, robot_iri
from irtwin.providers.robot_of_graph import robot_of_graph
from irtwin.report.case_study.page import render
from irtwin.report.energy.scene import draw_scene
from irtwin.signals.log import read_data_set
from irtwin.storage.database import Workspace

ROBOT = "KUKA_KR6_R700"
PLANNED, MEASURED, VALIDATION = "process", "process_measured", "validation"
_START = np.radians([0.0, -90.0, 90.0, 0.0, 0.0, 0.0])
_GOAL = np.radians([75.0, -45.0, 60.0, 40.0, 50.0, 90.0])
_SECONDS = 1.2
_RUNS = ("exciting_1", "exciting_2", "point_to_point", "waiting", "exciting_3", "exciting_4")  # of the demo
_NEEDED = {"ompl": "plan", "toppra": "plan", "mujoco": "mujoco"}  # modules and the extras that bring them
_EVERY = 0.3  # s of a run between two lines


def case_study(
    location: Location,
    *,
    task: Task | None = None,
    base: str | None = None,
    announce: Announce = lambda line: None,
) -> Path:
    """Carry the case study out in a new workspace; return the page's path. `announce` is told each step.

    `task`: what the process is, the usual one if None; `base`: as of `workflow.run`. Raises InputError where the folder
    is not empty, an extra is not installed, or the robot cannot do the task;
    then nothing is left.
    """
    folder = location.folder
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise InputError(f"{folder}: is not empty; remove it, or name a new folder by --workspace")
    if any(find_spec(module) is None for module in _NEEDED):
        extras = ",".join(dict.fromkeys(_NEEDED.values()))
        raise InputError(f'the case study plans and simulates; install what that takes: pip install "irtwin[{extras}]"')
    try:
        return _carried_out(location, task or task_of(), base, announce)
    except InputError:
        shutil.rmtree(folder)
        raise


def _carried_out(location: Location, task: Task, base: str | None, announce: Announce) -> Path:
    announce(f"1. The twin: identified from {len(_RUNS)} runs, two of them held out")
    data_set = unpack(location.folder)
    identify(data_set, location, base)
    announce("2. The process: planned from the initial to the final configuration, priced and kept")
    plan, kept = plans.plan(ROBOT, task, location, name=PLANNED)
    announce(f"   {plan.seconds:.2f} s; {kept.price}")
    announce("3. The measurement: a simulated robot carries the plan out, and a random motion of joints 2 to 4")
    measure(data_set, plan, announce)
    workflow.run(data_set, location)
    announce("4. The page: read back from the graph")
    with Workspace.existing(location) as place, KnowledgeGraph.of_workspace(place) as graph:
        robot = graph.iri(robot_iri(identifier(ROBOT)))
        described, meshes = robot_of_graph(graph, robot), meshes_of_graph(graph, robot, place.folder)
        out = place.file("reports/case_study.html")
        render(graph, robot, place.read_file, out, partial(draw_scene, described, meshes))
    return out


def task_of(start: str | None = None, goal: str | None = None, seconds: float | None = None) -> Task:
    """Return a task by poses as of `irtwin plan`; what is None is as usual. Raises InputError on what is no pose."""
    return Task(
        start=_START if start is None else read_target(start, len(_START), "--from"),
        goal=_GOAL if goal is None else read_target(goal, len(_GOAL), "--to"),
        seconds=seconds or _SECONDS,
    )


def unpack(workspace: Path) -> Path:
    """Write the data set that the twin is identified from, without the measurement; return its folder."""
    data_set = workflow.unpack_demo(workspace)
    head, *entries = (data_set / "dataset.toml").read_text(encoding="utf-8").split("[[run]]\n")
    kept = [entry for entry in entries if Path(tomllib.loads(entry)["file"]).stem in _RUNS]
    (data_set / "dataset.toml").write_text("[[run]]\n".join([head, *kept]), encoding="utf-8")
    for run in (data_set / "runs").iterdir():
        if run.stem not in _RUNS:
            run.unlink()
    return data_set


def identify(data_set: Path, location: Location, base: str | None = None) -> None:
    """Take a data set in, with the twin that is identified from it; nothing is concluded before the plan is there."""
    with Workspace.at(location, base) as place, rewriting.rewriting(place) as graph:
        workflow.take_in(place, read_data_set(data_set))
        graph.load_ontology()


def measure(data_set: Path, plan: Plan, announce: Announce) -> None:
    """Let the plant carry the plan and a random motion out, and add their logs to the data set.

    `announce` is told power and energy as they come. Raises InputError where the plant cannot follow.
    """
    from irtwin.demo.plant.cell import Cell  # takes MuJoCo, an extra

    cell = Cell(resources.folder("demo") / "plant" / "kuka_kr6_r700.toml", data_set / "robot.urdf")
    motion = plan.motion
    programmed = {
        MEASURED: cell.through(motion.time, motion.q, motion.dq, motion.ddq),
        VALIDATION: cell.random(range(1, 4)),
    }
    with (data_set / "dataset.toml").open("a", encoding="utf-8") as toml:
        for name, performs in ((MEASURED, f'performs = "{PLANNED}"\n'), (VALIDATION, "")):
            announce(f"   {name}")
            try:
                cell.carry_out(programmed[name], data_set / "runs" / f"{name}.parquet", _shown(announce))
            except (ValueError, RuntimeError) as error:
                raise InputError(
                    f"the simulated robot cannot carry {name} out: {error}; give other poses, or more time"
                ) from error
            toml.write(f'\n[[run]]\nfile = "runs/{name}.parquet"\nrole = "observed"\n{performs}')


def _shown(announce: Announce) -> Callable[[float, float, float], None]:
    """Return what tells power and energy of a run, some times a second."""
    told = [0.0]

    def watch(time: float, power: float, energy: float) -> None:
        if time >= told[0]:
            announce(f"     {time:4.1f} s  {power:5.0f} W  {energy:6.0f} J")
            told[0] += _EVERY

    return watch

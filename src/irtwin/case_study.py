"""The seed paper's case study, end to end: a motion is planned, priced, kept, mapped, read back, measured and shown."""

from __future__ import annotations

import shutil
import tomllib
from functools import partial
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq

from irtwin import plans, resources, workflow
from irtwin.errors import InputError
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.location import Location
from irtwin.modelling import Announce
from irtwin.planning.plan import Plan, Task
from irtwin.providers.mesh_files import meshes_of_graph
from irtwin.providers.records import identifier, robot_iri
from irtwin.providers.robot_of_graph import robot_of_graph
from irtwin.report.case_study.page import render
from irtwin.report.energy.scene import draw_scene
from irtwin.signals.channels import CHANNELS
from irtwin.signals.log import read_data_set
from irtwin.storage.database import Workspace

ROBOT = "KUKA_KR6_R700"
PLANNED, MEASURED = "process", "process_measured"
TASK = Task(
    start=np.radians([0.0, -90.0, 90.0, 0.0, 0.0, 0.0]),
    goal=np.radians([75.0, -45.0, 60.0, 40.0, 50.0, 90.0]),
    seconds=1.2,
)
_RUNS = ("exciting_1", "exciting_2", "point_to_point", "waiting", "exciting_3", "exciting_4")  # of the demo
_ENTRY = """[[run]]
file = "runs/{name}.parquet"
role = "observed"
performs = "{plan}"
started = 2026-05-13T07:30:00Z
"""
_OFF = 0.02  # rad: how far the measured motion may be from the planned one


def case_study(
    location: Location,
    *,
    base: str | None = None,
    announce: Announce = lambda line: None,
) -> Path:
    """Carry the case study out in a new workspace; return the page's path. `announce` is told each step.

    `base`: as of `workflow.run`. Raises InputError where the folder is not empty, or the extra `plan` is not installed.
    """
    folder = location.folder
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise InputError(f"{folder}: is not empty; remove it, or name a new folder by --workspace")
    if find_spec("ompl") is None or find_spec("toppra") is None:
        raise InputError('the case study plans a motion; install what that takes with pip install "irtwin[plan]"')
    announce(f"1. The twin: identified from {len(_RUNS)} runs, two of them held out")
    data_set = unpack(folder)
    identify(data_set, location, base)
    announce("2. The process: planned from the initial to the final configuration, priced and kept")
    plan, kept = plan_process(location)
    announce(f"   {plan.seconds:.2f} s; {kept.price}")
    off = add_measurement(data_set, plan)
    announce(f"3. The measurement: the simulated robot carried the plan out, {1000 * off:.1f} mrad off at most")
    workflow.run(data_set, location)
    announce("4. The page: read back from the graph")
    with Workspace.existing(location) as place, KnowledgeGraph.of_workspace(place) as graph:
        robot = graph.iri(robot_iri(identifier(ROBOT)))
        described, meshes = robot_of_graph(graph, robot), meshes_of_graph(graph, robot, place.read_document)
        out = place.file("reports/case_study.html")
        render(graph, robot, place.read_file, out, partial(draw_scene, described, meshes))
    return out


def unpack(workspace: Path) -> Path:
    """Write the data set that the twin is identified from, without the measurement; return its folder."""
    demo, data_set = resources.folder("demo") / "kuka_kr6_r700", workspace / "kuka_kr6_r700"
    (data_set / "runs").mkdir(parents=True)
    shutil.copyfile(resources.folder("ontology") / "robots" / "kuka_kr6_r700.urdf", data_set / "robot.urdf")
    head, *entries = (demo / "dataset.toml").read_text(encoding="utf-8").split("[[run]]\n")
    kept = [entry for entry in entries if Path(tomllib.loads(entry)["file"]).stem in _RUNS]
    for name in _RUNS:
        shutil.copyfile(demo / "runs" / f"{name}.parquet", data_set / "runs" / f"{name}.parquet")
    (data_set / "dataset.toml").write_text("[[run]]\n".join([head, *kept]), encoding="utf-8")
    return data_set


def identify(data_set: Path, location: Location, base: str | None = None) -> None:
    """Take a data set in, with the twin that is identified from it; nothing is concluded before the plan is there."""
    with Workspace.at(location, base) as place, workflow.rewriting(place) as graph:
        workflow.take_in(place, read_data_set(data_set))
        graph.load_ontology()


def plan_process(location: Location) -> tuple[Plan, plans.Kept]:
    """Plan the process by the twin in the workspace, and keep it there."""
    return plans.plan(ROBOT, TASK, location, name=PLANNED)


def add_measurement(data_set: Path, plan: Plan) -> float:
    """Add the log of the plan, carried out by the simulated robot, to the data set; return how far they differ, rad.

    Raises InputError where the log that ships is of another motion.
    """
    log = resources.folder("demo") / "kuka_kr6_r700_case_study" / f"{MEASURED}.parquet"
    table, motion = pq.read_table(log), plan.motion
    time = table["time"].to_numpy()
    planned = np.column_stack([np.interp(time, motion.time, column) for column in motion.q.T])
    measured = np.column_stack([table[name].to_numpy() for name in CHANNELS["q"].columns(plan.robot.joint_names)])
    off = float(np.abs(measured - planned).max())
    if off > _OFF:
        raise InputError(f"{log}: is the log of another motion, {off:.3f} rad off; make it by bench/case_study_log.py")
    shutil.copyfile(log, data_set / "runs" / log.name)
    with (data_set / "dataset.toml").open("a", encoding="utf-8") as toml:
        toml.write("\n" + _ENTRY.format(name=MEASURED, plan=PLANNED))
    return off

"""The main job, end to end: a data set in; a twin, a graph and a report out."""

from __future__ import annotations

import shutil
from functools import partial
from pathlib import Path

from irtwin import resources
from irtwin.announce import Announce
from irtwin.asking import open_graph, reading
from irtwin.errors import InputError
from irtwin.gap.diagnosis import Diagnosis
from irtwin.identification.progress import telling
from irtwin.knowledge.engines import NATIVE
from irtwin.knowledge.explain.explain import Explainer
from irtwin.knowledge.store.backup import backup as keep
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.location import WORKSPACE, Location
from irtwin.modelling import clocked, read_sound
from irtwin.next_experiment import next_experiment
from irtwin.proposed_motion import motion_text
from irtwin.providers.effects_of_ontology import check_effects
from irtwin.providers.gap import adopt as adopt_twin
from irtwin.providers.gap import record
from irtwin.providers.mesh_files import meshes_of_graph
from irtwin.providers.names import check_name, find_robot, identifier, robot_iri
from irtwin.providers.planner import populate
from irtwin.providers.records import check_plans, followed, ingest, is_described, known_twin
from irtwin.providers.robot_of_graph import robot_of_graph
from irtwin.report.energy.page import render
from irtwin.report.energy.scene import draw_scene
from irtwin.report.gap.page import render_gap
from irtwin.rewriting import check_before, conclude, fill, map_rows, populate_others, renew, rewriting
from irtwin.signals.log import DataSet
from irtwin.simulator.playing import Playing
from irtwin.storage.database import Workspace
from irtwin.storage.files import check_place
from irtwin.storage.staging import staged
from irtwin.twin.doubts import doubts
from irtwin.twin.files import to_json


def run(
    dataset: Path | str,
    workspace: Location | Path | str = WORKSPACE,
    *,
    repair: bool = False,
    base: str | None = None,
    announce: Announce = lambda line: None,
) -> Path:
    """Take a data set to a twin, a knowledge graph and a report; return the report's path.

    `base` is what the IRIs of individuals begin with, in a workspace without robots; `announce` is told each step as it
    ends.
    Raises InputError on bad input, before anything is written.
    """
    announce = clocked(announce)
    announce("Reading the data set")
    data_set = read_sound(Path(dataset), repair, announce)
    with Workspace.at(Location.of(workspace), base) as place:
        with rewriting(place, announce) as graph:
            robot_id = take_in(place, data_set, announce)
            renew(place, graph, announce)
            following = next_experiment(place, graph, robot_id) if data_set.robot.joints else None
            if populate_others(place, graph, announce):
                conclude(graph, announce)
        announce("Writing the report")
        report = write_report(place, robot_id)
    for line in following.words if following else ():
        announce(f"  {line}")
    return report


def as_asserted(location: Location, data_set: DataSet) -> DataSet:
    """Return a data set as users of a workspace, if it is there, asserted that it is.

    Raises InputError for what hinders keeping its diagnosis there: it is said before minutes of work.
    """
    if not Workspace.is_there(location):
        return data_set
    with Workspace.at(location) as place:
        check_before(place)
        check_name(place, data_set.robot.name)
        return followed(data_set, place.facts_about(identifier(data_set.robot.name)))


def keep_diagnosis(location: Location, data_set: DataSet, diagnosis: Diagnosis | Playing, announce: Announce) -> None:
    """Keep a diagnosis with its data set in a workspace, in the graph too, and write its report there."""
    announce("Storing the diagnosis")
    robot_id = identifier(data_set.robot.name)
    closed = None if diagnosis.twin is None else to_json(diagnosis.twin)
    motion = motion_text(diagnosis) if isinstance(diagnosis, Diagnosis) else None
    with Workspace.at(location) as place:
        with rewriting(place, announce) as graph:
            check_name(place, data_set.robot.name)
            with staged(place, robot_id) as apart:
                ingest(apart, data_set, facts=place.facts_about(robot_id))
                record(apart, robot_id, diagnosis.document, diagnosis.curves, closed, motion)
            renew(place, graph, announce)
        with open_graph(place.location) as graph:
            robot, out = graph.iri(robot_iri(robot_id)), place.gap_report_path(robot_id)
            render_gap(
                graph,
                robot,
                place.read_document,
                out,
                place.resources,
                lambda: (data_set.robot, meshes_of_graph(graph, robot, place.folder)),
            )


def adopt(robot: str, workspace: Location | Path | str = WORKSPACE, *, announce: Announce = lambda line: None) -> Path:
    """Make the twin of a robot's diagnosis the robot's own, populate anew; return the path of the energy report."""
    with Workspace.existing(Location.of(workspace)) as place:
        with rewriting(place, announce) as graph:
            robot_id = find_robot(place, robot)
            with staged(place, robot_id) as apart:
                adopt_twin(apart, robot_id)
                populate_apart(apart, announce)
            fill(place, graph, announce)  # live runs by the new twin
            next_experiment(place, graph, robot_id)
        return write_report(place, robot_id)


def reason_again(location: Location, engine: str = NATIVE, announce: Announce = lambda line: None) -> None:
    """Draw the conclusions in a workspace's graph by an engine, in place of those that are there.

    Ontology and mappings are read again first, as those of the workspace may have changed.
    They stay until the graph changes, or the native engine is asked again. Raises InputError where the engine cannot
    run, Contradiction where the graph contradicts itself.
    """
    announce = clocked(announce)
    with Workspace.existing(location) as place, rewriting(place, announce) as graph:
        graph.load_ontology()
        check_effects(graph)
        map_rows(place, graph)
        conclude(graph, announce, engine)


def catch_up(location: Location, announce: Announce = lambda line: None) -> None:
    """Bring a graph up to date that a command which was broken off left behind the database; no other is changed."""
    with Workspace.existing(location) as place, rewriting(place, announce):
        pass


def backup(archive: Path, location: Location) -> None:
    """Write a workspace into one archive: graph, database, series, twins, diagnoses and reports; others may write."""
    check_place(archive)
    with Workspace.existing(location) as place:
        if location.graph_url is None:
            place.check_graph()
        with reading(location) as current:  # takes no lock
            keep(place, current(False), archive)


def unpack_demo(workspace: Path) -> Path:
    """Put the KUKA KR6 R700 data set that ships with the package into a workspace; return the data set's folder."""
    data_set = workspace / "kuka_kr6_r700"
    shutil.copytree(resources.folder("demo") / "kuka_kr6_r700", data_set, dirs_exist_ok=True)
    shutil.copyfile(resources.folder("ontology") / "robots" / "kuka_kr6_r700.urdf", data_set / "robot.urdf")
    return data_set


def take_in(place: Workspace, data_set: DataSet, announce: Announce = lambda line: None) -> str:
    """Ingest a data set and populate what follows from it, all or nothing; return the robot_id."""
    robot_id = identifier(data_set.robot.name)
    check_name(place, data_set.robot.name)
    count = len(data_set.runs) + len(data_set.plans)
    announce(f"Ingesting {data_set.robot.name}, {count} runs")
    with staged(place, robot_id) as apart:
        facts = place.facts_about(robot_id)
        announce(f"  {ingest(apart, data_set, lambda line: announce(f'  {line}'), facts)}")
        announce("Running the data providers")
        try:
            populate_apart(apart, announce)
            if not data_set.robot.joints:
                announce(
                    "  no twin, for a meter alone was logged: which joint, effect or motion takes it stays unknown"
                )
            known = known_twin(apart, robot_id)
            for doubt in doubts(known[1]) if known else ():
                announce(f"  {doubt}")
            check_plans(apart, robot_id, data_set.plans)
        except InputError as error:
            error.args = (f"{data_set.folder}: {error}; nothing of this data set was stored",)
            raise
    return robot_id


def populate_apart(apart: Workspace, announce: Announce) -> None:
    """Populate what the robot of a staged workspace lacks, by a graph of that robot alone."""
    with KnowledgeGraph(workspace=apart.folder, resources=apart.resources, base=apart.base) as graph:
        graph.load_ontology()
        check_effects(graph)
        map_rows(apart, graph)
        with telling(announce):
            populate(apart, graph, lambda: map_rows(apart, graph), announce)


def write_report(place: Workspace, robot_id: str) -> Path:
    """Write a robot's energy report from the graph as it stands; return its path.

    Whoever rewrites the graph is done with that before: others need not wait for a page.
    """
    out = place.report_path(robot_id)
    with open_graph(place.location) as graph:
        robot = graph.iri(robot_iri(robot_id))
        scene = None
        if is_described(place, robot_id):
            meshes = meshes_of_graph(graph, robot, place.folder)
            scene = partial(draw_scene, robot_of_graph(graph, robot), meshes)
        render(graph, robot, place.read_file, out, scene, Explainer(graph).of_iris, place.resources)
    return out

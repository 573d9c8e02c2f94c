"""The main job, end to end: a data set in; a twin, a graph and a report out."""

from __future__ import annotations

import json
import math
import shutil
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from functools import partial
from pathlib import Path

from irtwin import resources
from irtwin.asking import WORKSPACE, open_graph
from irtwin.check.check import checked
from irtwin.effects.stack import Stack
from irtwin.errors import InputError
from irtwin.gap import diagnosis as gap
from irtwin.gap.diagnosis import Diagnosis
from irtwin.identification.progress import telling
from irtwin.knowledge.asserted.statements import map_facts
from irtwin.knowledge.engines import NATIVE
from irtwin.knowledge.explain.explain import explain_one
from irtwin.knowledge.extensions import check_mappings
from irtwin.knowledge.mapping import refresh
from irtwin.knowledge.reasoning import reason
from irtwin.knowledge.shacl.validation import validate
from irtwin.knowledge.store.backup import backup as keep
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.knowledge.store.snapshot import Snapshot, kept
from irtwin.knowledge.vocabulary import shorten
from irtwin.next_experiment import motion_text, next_experiment, save_motion
from irtwin.providers.effects_of_ontology import check_effects
from irtwin.providers.gap import adopt as adopt_twin
from irtwin.providers.gap import record
from irtwin.providers.mesh_files import meshes_of_graph
from irtwin.providers.planner import populate
from irtwin.providers.records import (
    check_name,
    check_plans,
    find_robot,
    followed,
    identifier,
    ingest,
    is_described,
    known_twin,
    robot_iri,
)
from irtwin.providers.robot_of_graph import robot_of_graph
from irtwin.report.energy.page import render
from irtwin.report.energy.scene import draw_scene
from irtwin.report.extensions import check as check_extensions
from irtwin.report.gap.page import render_alone, render_gap
from irtwin.signals.log import DataSet, read_data_set
from irtwin.signals.sampling import checked_cutoff
from irtwin.simulator.differences import written
from irtwin.simulator.model import Model, read_model, with_simulated_runs
from irtwin.simulator.playing import Playing
from irtwin.simulator.playing import diagnose as diagnose_by_playing
from irtwin.storage import series_place
from irtwin.storage.database import Workspace
from irtwin.storage.engine import before_writing
from irtwin.storage.files import check_place, write
from irtwin.storage.staging import staged
from irtwin.storage.turns import rewriting_alone
from irtwin.twin.files import load, to_json
from irtwin.twin.twin import Twin

Announce = Callable[[str], None]
LONGEST_SQL = 600.0  # s for the SQL of a mapping, where some do not ship


def run(
    dataset: Path | str,
    workspace: Path | str = WORKSPACE,
    *,
    database: str | None = None,
    graph_url: str | None = None,
    repair: bool = False,
    base: str | None = None,
    series_url: str | None = None,
    announce: Announce = lambda line: None,
) -> Path:
    """Take a data set to a twin, a knowledge graph and a report; return the report's path.

    `database` is an SQLAlchemy URL, SQLite in the workspace if None; `graph_url` a SPARQL server's, the workspace's own
    graph if None; `base` is what the IRIs of individuals begin with, in a workspace without robots; `series_url` is
    object storage (`s3://bucket/prefix`) that is to hold the series, in a workspace without any: it is remembered;
    `announce` is told each step as it ends.
    Raises InputError on bad input, before anything is written.
    """
    announce = _clocked(announce)
    announce("Reading the data set")
    data_set = _read(Path(dataset), repair, announce)
    with Workspace(Path(workspace), database, base=base, series_url=series_url) as place:
        with rewriting(place, graph_url, announce) as graph:
            robot_id = take_in(place, data_set, announce)
            graph.load_ontology()
            map_rows(place, graph)
            conclude(graph, announce)
            following = next_experiment(place, graph, robot_id) if data_set.robot.joints else None
            if populate_others(place, graph, announce):
                conclude(graph, announce)
        announce("Writing the report")
        report = write_report(place, graph_url, robot_id)
    for line in following.words if following else ():
        announce(f"  {line}")
    return report


def diagnose(
    dataset: Path | str,
    *,
    twin: Twin | Path | str | None = None,
    simulator: Path | str | None = None,
    withhold: Sequence[str] = (),
    cutoff: float | None = None,
    seed: int = 0,
    repair: bool = False,
    workspace: Path | str | None = None,
    database: str | None = None,
    graph_url: str | None = None,
    json_file: Path | str | None = None,
    report: Path | str | None = None,
    twin_file: Path | str | None = None,
    motion_file: Path | str | None = None,
    simulator_file: Path | str | None = None,
    announce: Announce = lambda line: None,
) -> Diagnosis | Playing:
    """Diagnose the gap between a robot's twin, or its simulator, and its runs.

    `twin`, or the file of one, is what the gap is held against, in place of what the data set says of it: its effects
    in their shapes, and its numbers as the prior. `simulator` is the file of a model of MuJoCo: what it says of the
    observed motions is held against the robot, as runs of a simulator are; of runs with commands and no torque, these
    are played through it (channel "position"). `withhold` takes effects out of the twin and leaves them in the
    catalogue. `cutoff`, Hz, is the filter's, in place of what the data set says. With a `workspace` the diagnosis is
    kept there, in the graph too, so that `adopt` can make its twin the robot's. Files to write, each whole or not at
    all: `json_file` the diagnosis, `report` an HTML page, `twin_file` the twin with the causes added, `motion_file` the
    motion of the next experiment, where one is designed, `simulator_file` the simulator's model with the numbers that
    the robot has.
    The `document` of what is returned says the same, typed. Raises InputError on bad input, before anything is written.
    """
    announce = _clocked(announce)
    kept_in = None if workspace is None else Path(workspace)
    check_extensions(resources.resources_of(kept_in))
    files = (json_file, report, twin_file, motion_file, simulator_file)
    places = [None if file is None else Path(file) for file in files]
    for file in filter(None, places):
        check_place(file)
    json_file, report, twin_file, motion_file, simulator_file = places
    given = load(Path(twin)) if isinstance(twin, Path | str) else twin
    announce("Reading the data set")
    data_set = _read(Path(dataset), repair, announce, commanded=simulator is not None)
    model = None if simulator is None else read_model(Path(simulator), data_set.robot)
    lacking = {"a twin": twin, "a twin's file": twin_file, "a motion": motion_file, "a cutoff": cutoff}
    _check_asked(data_set, lacking | {"an effect to withhold": withhold or None})
    data_set = _with_cutoff(data_set, cutoff)
    if kept_in is not None and Workspace.is_there(kept_in, database):
        with Workspace(kept_in, database) as place:  # what hinders it is said before minutes of work
            check_before(place)
            check_name(place, data_set.robot.name)
            data_set = followed(data_set, place.facts_about(identifier(data_set.robot.name)))
    with telling(announce):
        data_set, found = _found(data_set, model, given, withhold, seed)
    if kept_in is not None:  # first, as a damaged workspace is to leave no file beside its error
        announce("Storing the diagnosis")
        with Workspace(kept_in, database) as place:
            with rewriting(place, graph_url, announce) as graph:
                _store(place, graph, data_set, found, announce)
            _write_gap_report(place, graph_url, identifier(data_set.robot.name))
    if model and simulator_file:
        write(simulator_file, found.written() if isinstance(found, Playing) else written(model, found.document))
    if json_file is not None:
        write(json_file, (json.dumps(found.document.to_json(), indent=1, allow_nan=False) + "\n").encode())
    if twin_file is not None and found.twin is not None:
        _say_doubt(found.twin, announce)
        write(twin_file, to_json(found.twin).encode())
    if motion_file is not None and isinstance(found, Diagnosis):
        announce(f"  {save_motion(found, motion_file)}")
    if report is not None:
        announce("Writing the report")
        render_alone(data_set, found.document, found.curves, report, resources.resources_of(kept_in))
    return found


def _say_doubt(twin: Twin | None, announce: Announce) -> None:
    if twin is not None and twin.doubt_of_bodies:
        announce(f"  {twin.doubt_of_bodies}")


def _with_cutoff(data_set: DataSet, cutoff: float | None) -> DataSet:
    """Return the data set with a cutoff, Hz, in place of its own, if one is given. Raises InputError by `cutoff`."""
    if cutoff is None:
        return data_set
    signals = [run.signals for run in data_set.runs]
    return replace(data_set, cutoff=checked_cutoff(cutoff, signals, "cutoff"))


def _check_asked(data_set: DataSet, lacking: Mapping[str, object]) -> None:
    """Raise InputError where something is given or asked for that a diagnosis by playing lacks."""
    for name, value in lacking.items():
        if data_set.is_commanded and value is not None:
            raise InputError(
                f"{data_set.folder}: has commands and no torque: {name} is of no use for it; leave that out"
            )


def _found(
    data_set: DataSet, model: Model | None, twin: Twin | None, withhold: Sequence[str], seed: int
) -> tuple[DataSet, Diagnosis | Playing]:
    """Return the diagnosis, and the data set with the runs of a simulator, if any were made."""
    if model is not None and data_set.is_commanded:
        return data_set, diagnose_by_playing(data_set, model)
    if model is not None:
        data_set = with_simulated_runs(data_set, model)
    found = gap.diagnose(data_set, twin=twin, simulator=model, withhold=withhold, seed=seed)
    return data_set, found


def _store(
    place: Workspace, graph: KnowledgeGraph, data_set: DataSet, found: Diagnosis | Playing, announce: Announce
) -> None:
    check_name(place, data_set.robot.name)
    robot_id = identifier(data_set.robot.name)
    closed = None if found.twin is None else to_json(found.twin)
    motion = motion_text(found) if isinstance(found, Diagnosis) else None
    with staged(place, robot_id) as apart:
        ingest(apart, data_set, facts=place.facts_about(robot_id))
        record(apart, robot_id, found.document, found.curves, closed, motion)
    graph.load_ontology()
    map_rows(place, graph)
    conclude(graph, announce)


def adopt(
    robot: str,
    workspace: Path | str = WORKSPACE,
    *,
    database: str | None = None,
    graph_url: str | None = None,
    announce: Announce = lambda line: None,
) -> Path:
    """Make the twin of a robot's diagnosis the robot's own, populate anew; return the path of the energy report."""
    with Workspace.existing(Path(workspace), database) as place:
        with rewriting(place, graph_url, announce) as graph:
            robot_id = find_robot(place, robot)
            with staged(place, robot_id) as apart:
                adopt_twin(apart, robot_id)
                populate_apart(apart, announce)
            graph.load_ontology()
            map_rows(place, graph)
            populate_others(place, graph, announce)  # live runs by the new twin
            conclude(graph, announce)
            next_experiment(place, graph, robot_id)
        return write_report(place, graph_url, robot_id)


def reason_again(
    workspace: Path | str = WORKSPACE,
    *,
    engine: str = NATIVE,
    database: str | None = None,
    graph_url: str | None = None,
    announce: Announce = lambda line: None,
) -> None:
    """Draw the conclusions in a workspace's graph by an engine, in place of those that are there.

    Ontology and mappings are read again first, as those of the workspace may have changed.
    They stay until the graph changes, or the native engine is asked again. Raises InputError where the engine cannot
    run, Contradiction where the graph contradicts itself.
    """
    announce = _clocked(announce)
    with Workspace.existing(Path(workspace), database) as place, rewriting(place, graph_url, announce) as graph:
        graph.load_ontology()
        check_effects(graph)
        map_rows(place, graph)
        conclude(graph, announce, engine)


def catch_up(
    workspace: Path | str = WORKSPACE,
    *,
    database: str | None = None,
    graph_url: str | None = None,
    announce: Announce = lambda line: None,
) -> None:
    """Bring a graph up to date that a command which was broken off left behind the database; no other is changed."""
    with Workspace.existing(Path(workspace), database) as place, rewriting(place, graph_url, announce):
        pass


def backup(
    archive: Path, workspace: Path | str = WORKSPACE, *, database: str | None = None, graph_url: str | None = None
) -> None:
    """Write a workspace into one archive: graph, database, series, twins, diagnoses and reports; others may write."""
    check_place(archive)
    with Workspace.existing(Path(workspace), database) as place, ExitStack() as held:
        if graph_url:
            graph = KnowledgeGraph(graph_url)
        else:
            place.check_graph()
            graph = held.enter_context(Snapshot(place.graph_folder)).current()  # takes no lock
        keep(place, graph, archive)


def unpack_demo(workspace: Path) -> Path:
    """Put the KUKA KR6 R700 data set that ships with the package into a workspace; return the data set's folder."""
    data_set = workspace / "kuka_kr6_r700"
    shutil.copytree(resources.folder("demo") / "kuka_kr6_r700", data_set, dirs_exist_ok=True)
    shutil.copyfile(resources.folder("ontology") / "robots" / "kuka_kr6_r700.urdf", data_set / "robot.urdf")
    return data_set


def _read(folder: Path, repair: bool, announce: Announce, commanded: bool = False) -> DataSet:
    """Read a data set and check it; say what was dropped, found and mended. Raises InputError on what must be cured."""
    data_set = read_data_set(folder, repair=repair, commanded=commanded)
    _check_effects(data_set)
    return sound(data_set, announce)


def sound(data_set: DataSet, announce: Announce) -> DataSet:
    """Return a data set, mended where that leaves no doubt; say what was. Raises InputError on what must be cured."""
    for line in data_set.repairs:
        announce(f"  {line}")
    found = checked(data_set)
    for line in dict.fromkeys(finding.say for finding in found.findings):
        announce(f"  {line}")
    return found.data_set


def _check_effects(data_set: DataSet) -> None:
    try:
        Stack(data_set.robot, data_set.effects or ())
    except InputError as error:
        raise InputError(f"{data_set.folder / 'dataset.toml'}: [twin] effects: {error}") from error


@contextmanager
def rewriting(place: Workspace, url: str | None, announce: Announce = lambda line: None) -> Iterator[KnowledgeGraph]:
    """Open the workspace's graph to rewrite it: in its folder, or on a SPARQL server; bring up to date one left behind.

    Who reads the folder meanwhile sees what was there before, if anything was; who wants to rewrite it too waits.
    Where the block fails after a change, the graph says that it is behind.
    Raises InputError for a fault in what extends the workspace, before anything is written, or after too long a wait.
    """
    check_before(place)
    with ExitStack() as held:
        held.enter_context(rewriting_alone(place.engine, place.folder))
        graph = held.enter_context(KnowledgeGraph.of_workspace(place, url))
        if graph.is_behind:
            _catch_up(place, graph, announce)
        if url is None and graph.graphs():
            held.enter_context(kept(place.graph_folder))
        held.enter_context(_told(place, graph))
        yield graph


@contextmanager
def _told(place: Workspace, graph: KnowledgeGraph) -> Iterator[None]:
    """Have the graph say that it is behind from the first change of it, or of rows, until the block ends well."""
    with graph.rewritten(), before_writing(place.engine, graph.rows_change):
        yield


def _catch_up(place: Workspace, graph: KnowledgeGraph, announce: Announce) -> None:
    """Do what the command that left the graph behind had not done, from the rows that it left."""
    announce("Catching up: the graph is behind the database, as a command was broken off or failed")
    with _told(place, graph):
        graph.load_ontology()
        check_effects(graph)
        map_rows(place, graph)
        populate_others(place, graph, announce)
        conclude(graph, announce)


def check_before(place: Workspace) -> None:
    """Raise InputError for a fault in what extends a workspace, or where its series cannot be kept."""
    check_extensions(place.resources)
    check_mappings(place.resources, place.engine)
    series_place.check(place.folder)


def map_rows(place: Workspace, graph: KnowledgeGraph) -> None:
    """Bring the individuals up to date with the database."""
    files = graph.resources.of("mappings")
    seconds = LONGEST_SQL if any(file.is_extension for file in files) else math.inf
    refresh(graph, place.engine, [file.path for file in files], place.mapped_rows, seconds)
    with place.reading() as session:
        map_facts(graph, session)


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
            _say_doubt(known and known[1], announce)
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
        populate(apart, graph, lambda: map_rows(apart, graph), announce)


def populate_others(place: Workspace, graph: KnowledgeGraph, announce: Announce) -> bool:
    """Populate what robots of earlier data sets lack; one that cannot be is said, and hinders no other."""

    def set_aside(robot_id: str, reason: InputError) -> None:
        announce(f"  {robot_id} is set aside: {reason}; remove it with `irtwin drop {robot_id}`")

    return populate(place, graph, lambda: map_rows(place, graph), announce, set_aside)


def conclude(graph: KnowledgeGraph, announce: Announce, engine: str = NATIVE) -> None:
    """Reason over the graph and check its constraints; say what is done and what was found."""
    announce("Reasoning")
    inferred = reason(graph, engine)
    by = "OWL 2 RL" if engine == NATIVE else f"OWL by {engine}"
    announce(f"  {inferred.owl_rl} triples from {by}, {inferred.by_rules} from rules")
    if inferred.joined_by:
        announce(f"  reasoned over all robots together, for this concerns all of them: {inferred.joined_by}")
    for contradiction, about in inferred.contradictions.items():
        announce(f"  about {', '.join(shorten(node, graph.base) for node in about)}: {contradiction}")
    announce("Checking the constraints")
    for violation in validate(graph):
        announce(f"  {violation}")


def write_report(place: Workspace, graph_url: str | None, robot_id: str) -> Path:
    """Write a robot's energy report from the graph as it stands; return its path.

    Whoever rewrites the graph is done with that before: others need not wait for a page.
    """
    out = place.report_path(robot_id)
    with open_graph(place.folder, graph_url) as graph:
        robot = graph.iri(robot_iri(robot_id))
        scene = None
        if is_described(place, robot_id):
            meshes = meshes_of_graph(graph, robot, place.read_document)
            scene = partial(draw_scene, robot_of_graph(graph, robot), meshes)
        render(graph, robot, place.read_file, out, scene, partial(explain_one, graph), place.resources)
    return out


def _write_gap_report(place: Workspace, graph_url: str | None, robot_id: str) -> None:
    """Write the report of a robot's last diagnosis from the graph as it stands."""
    out = place.gap_report_path(robot_id)
    with open_graph(place.folder, graph_url) as graph:
        render_gap(graph, graph.iri(robot_iri(robot_id)), place.read_document, out, place.resources)


def _clocked(announce: Announce) -> Announce:
    """Put the seconds since now before each line."""
    began = time.monotonic()
    return lambda line: announce(f"{time.monotonic() - began:5.1f} s  {line}")

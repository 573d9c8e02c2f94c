"""A workspace kept in order: a robot or a run taken out, a damaged graph made anew."""

from __future__ import annotations

import fcntl
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from sqlalchemy import select

from irtwin.alarms.settings import NAME
from irtwin.alarms.settings import asks as alarm_asks
from irtwin.announce import Announce
from irtwin.errors import InputError
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.knowledge.vocabulary import GRAPH_ONTOLOGY
from irtwin.location import Location
from irtwin.next_experiment import proposal_files
from irtwin.providers.names import find_robot, find_run, run_iri
from irtwin.resources import resources_of
from irtwin.rewriting import check_before, fill, renew, rewriting
from irtwin.storage import files
from irtwin.storage.database import Workspace
from irtwin.storage.journal import left_behind, of_robot
from irtwin.storage.rows import named_files
from irtwin.storage.schema import LIVE, MEASURED_RUN, WATCHED_RUNS, RunRow
from irtwin.storage.series import is_whole
from irtwin.workflow import write_report

_DAMAGED = "graph.damaged"


def asked(workspace: Path) -> list[str]:
    """Return what the files of a workspace ask for, by name: to hold, or to be told of alarms.

    Raises InputError where one of them cannot be read.
    """
    resources = resources_of(workspace)
    own = [file.asked for file in (*resources.files, *resources.left_aside) if file.is_of_workspace]
    settings = files.inside(workspace, NAME)
    return [*sorted(own), *(alarm_asks(settings) if settings.exists() else [])]


def drop(robot: str, location: Location, announce: Announce = lambda line: None) -> None:
    """Forget a robot, by its name: rows, files, report, journals, and all that the graph says of it.

    Raises InputError, with the nearest name, where there is no such robot, or one that is watched just now.
    """
    with Workspace.existing(location) as place, rewriting(place, announce) as graph:
        robot_id = find_robot(place, robot)
        journals = of_robot(place.folder / LIVE, robot_id)
        if set(journals) - set(left_behind(place.folder / LIVE)):
            raise InputError(f'{place.folder}: "{robot}" is being watched; stop `irtwin live` first')
        reports = place.report_path(robot_id), place.gap_report_path(robot_id)
        made = [*journals, *proposal_files(place, robot_id), *reports]
        place.drop_robot(robot_id)
        for file in made:
            files.remove(file)
        if journals:  # the graph may show what no row ever said
            place.mapped_rows.unlink(missing_ok=True)
        renew(place, graph, announce)  # what was wrong with it goes too


def drop_run(robot: str, run: str, location: Location, announce: Announce = lambda line: None) -> None:
    """Forget a plan that was kept, or a live run, of a robot: rows, series, and all that the graph says of it.

    The robot's report is written anew. Raises InputError where there is no such run or it is watched just now, where it
    stands in a data set or the twin was judged by it, or another run carried it out.
    """
    with Workspace.existing(location) as place:
        with rewriting(place, announce) as graph:
            robot_id = find_robot(place, robot)
            _drop_run(place, robot_id, run)
            renew(place, graph, announce)
        if place.report_path(robot_id).exists():
            write_report(place, robot_id)


def _drop_run(place: Workspace, robot_id: str, name: str) -> None:
    journals = {journal.stem: journal for journal in of_robot(place.folder / LIVE, robot_id)}
    journal = journals.get(name) or journals.get(f"{robot_id}.{name}")
    if journal is not None:
        if journal not in left_behind(place.folder / LIVE):
            raise InputError(f'{place.folder}: "{name}" is being watched; stop `irtwin live` first')
        place.mapped_rows.unlink(missing_ok=True)  # the graph may show what no row ever said
        run_id = journal.stem
    else:
        run = find_run(place, robot_id, name)
        _check_that_it_may_go(place, run)
        run_id = run.run_id
    place.drop_run(run_id, run_iri(run_id))
    if journal is not None:
        files.remove(journal)


def _check_that_it_may_go(place: Workspace, run: RunRow) -> None:
    if run.role is not None:
        raise InputError(
            f'{place.folder}: "{run.name}" stands in the robot\'s data set; take it out there and run that again'
        )
    if run.kind == MEASURED_RUN:
        raise InputError(f'{place.folder}: the twin was bettered or judged by "{run.name}"; it goes with its robot')
    done = place.first(select(RunRow).where(RunRow.performs == run.run_id))
    if done is not None:
        of_data_set = "take its `performs` out of the data set first"
        first = "remove that one first" if done.kind in WATCHED_RUNS else of_data_set if done.role else "both stay"
        raise InputError(f'{place.folder}: the run "{done.name}" carried out "{run.name}"; {first}')


def repair(location: Location, announce: Announce = lambda line: None) -> None:
    """Make the graph of a workspace anew from its database, and look through its files.

    The graph that was there is replaced once the new one is whole. On a server each named graph is replaced in a
    transaction of its own. Raises InputError where the database is damaged, or at the end where files
    are lost that only a data set or a backup can give back.
    """
    with Workspace.existing(location) as place:
        if location.graph_url is None:
            _rebuild(place, announce)
        else:
            with rewriting(place) as graph:
                _fill(place, graph, announce)
        lost = lost_files(place)
    for line in lost:
        announce(f"  {line}")
    if lost:
        raise InputError(
            f"{place.folder}: the graph is rebuilt, but files are missing or altered ({len(lost)}); "
            "run the data sets of these robots again, restore a backup, or remove them with `irtwin workspace drop`"
        )


def _rebuild(place: Workspace, announce: Announce) -> None:
    """Make the graph in a folder anew, and put it in place of the old one."""
    check_before(place)  # as `rewriting` does
    with _nobody_else(place.graph_folder), files.working_folder(place.folder, ".repair-") as folder:
        with KnowledgeGraph(folder / "graph", place.folder, place.resources, place.base) as graph:
            _fill(place, graph, announce)
        _swap(place, folder / "graph")


def _fill(place: Workspace, graph: KnowledgeGraph, announce: Announce) -> None:
    announce("Rebuilding the graph from the database")
    place.mapped_rows.unlink(missing_ok=True)
    graph.replace([], GRAPH_ONTOLOGY)  # what it says of itself is not believed
    fill(place, graph, announce)


@contextmanager
def _nobody_else(folder: Path) -> Iterator[None]:
    """Hold the store's own lock, where there is one. InputError where another process does."""
    if not (folder / "LOCK").exists():
        yield
        return
    with (folder / "LOCK").open("r+b") as lock:
        try:
            fcntl.lockf(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            raise InputError(f"{folder}: another process has the graph open; stop it first") from None
        yield


def _swap(place: Workspace, new: Path) -> None:
    """Put the new graph in place. A kill in between leaves none, which the next opening tells."""
    aside = place.folder / _DAMAGED
    if place.graph_folder.exists():
        shutil.rmtree(aside, ignore_errors=True)
        place.graph_folder.rename(aside)
    new.rename(place.graph_folder)
    shutil.rmtree(aside, ignore_errors=True)


def lost_files(place: Workspace) -> list[str]:
    """Return, in words, which files that the database names are missing or altered."""
    with place.reading() as session:
        named = named_files(session.connection())
    lost = []
    for file in named:
        try:
            if is_whole(place.folder, file.path, file.sha256):
                continue
        except InputError:  # a path that leads outside
            pass
        lost.append(f"{file.path} of {file.robot_id} is missing or altered")
    return list(dict.fromkeys(lost))  # two runs of one content are one file

"""What processes do that write to a workspace or a graph until they are killed, in a module that they import once."""

from __future__ import annotations

import itertools
import os
import signal
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

from pyoxigraph import Literal, NamedNode, Quad
from sqlalchemy import Engine, event

from irtwin.knowledge.mapping.remembered import RememberedRows
from irtwin.knowledge.store import union_store as store
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.rewriting import conclude, map_rows, rewriting
from irtwin.storage import files, staging
from irtwin.storage import rows as robot_rows
from irtwin.storage.database import Workspace
from tests import rows
from tests.turn_takers import data_set


def take_in(folder: Path, name: str, database: str | None = None, graph_url: str | None = None) -> None:
    """Take in a robot as `irtwin run` does, without its twin."""
    with Workspace(folder, database, graph_url=graph_url) as place, rewriting(place) as graph:
        place.ingest(*data_set(name, 2))
        graph.load_ontology()
        map_rows(place, graph)
        conclude(graph, lambda line: None)


def broken_off(folder: Path, name: str, database: str | None = None, graph_url: str | None = None) -> None:
    """Take in a robot, and fail once its rows are there."""
    with (
        suppress(KeyboardInterrupt),
        Workspace(folder, database, graph_url=graph_url) as place,
        rewriting(place),
    ):
        place.ingest(*data_set(name, 2))
        raise KeyboardInterrupt


def killed(moment: int, *taken_in: Any) -> None:
    """Take in a robot, and be killed before or after one write of rows, of the graph or of remembered rows."""
    steps = itertools.count()

    def step(*_: object) -> None:
        if next(steps) == moment:
            os.kill(os.getpid(), signal.SIGKILL)

    event.listen(Engine, "commit", step)
    of_graph, of_remembered = KnowledgeGraph._writing, RememberedRows.__exit__

    @contextmanager
    def writing(graph: KnowledgeGraph) -> Iterator[Any]:
        with of_graph(graph) as store:
            step()
            yield store
        step()

    def remember(self: RememberedRows, *exception: Any) -> None:
        step()
        of_remembered(self, *exception)
        step()

    KnowledgeGraph._writing = writing  # type: ignore[method-assign,assignment]
    RememberedRows.__exit__ = remember  # type: ignore[method-assign,assignment]
    take_in(*taken_in)


def killed_while_ingesting(point: str, folder: Path, url: str | None) -> None:
    """Take in a changed data set, and be killed at a step of it."""

    def kill(*_: object) -> None:
        os.kill(os.getpid(), signal.SIGKILL)

    put, calls = files.put_in_place, itertools.count(1)
    workspace = Workspace(folder, url)
    if point == "first file":
        files.put_in_place = kill
    elif point == "second file":
        files.put_in_place = lambda *arguments: kill() if next(calls) == 2 else put(*arguments)
    elif point == "rows dropped":
        robot_rows.insert_rows = kill
    elif point == "rows written":
        event.listen(workspace.engine, "commit", kill)
    elif point == "committed":
        Workspace.remove_orphans = kill  # type: ignore[method-assign]
    robot, joints, runs, series = rows.data_set()
    for number, run in enumerate(runs):
        run.sha256 = "4" * 64
        series[run.run_id] = rows.samples(20 + number)
    workspace.ingest(robot, joints, runs, series)


def killed_apart(folder: Path, point: str) -> None:
    """Work on a robot apart, and be killed there, or at a step of `staging` that puts it in its place."""
    from tests.storage.test_database import populate

    with Workspace(folder) as place, staging.staged(place, rows.ROBOT) as apart:
        populate(apart)
        if point == "apart":
            os.kill(os.getpid(), signal.SIGKILL)
        module = staging if hasattr(staging, point) else robot_rows
        setattr(module, point, lambda *_: os.kill(os.getpid(), signal.SIGKILL))


def ingest_five_times(digit: int, folder: Path, url: str | None) -> None:
    """Take in five data sets of a robot, one after the other."""
    for number in range(5):
        robot, joints, runs, series = rows.data_set()
        runs[0].sha256 = f"{digit}" * 64
        series[runs[0].run_id] = rows.samples(number + digit)
        Workspace(folder, url).ingest(robot, joints, runs, series)


def write_without_end(folder: Path, way: str, telling: Connection) -> None:
    """Write a graph step by step, and tell which is done.

    Each step makes a new graph of 50 facts, or lets one of three graphs count on. The way "many": 50 facts are so many
    that they go into files of their own.
    """
    if way == "many":
        store._MANY = 50
    graph, counted = KnowledgeGraph(folder), dict[str, set[Quad]]()
    for number in itertools.count():
        name = f"new{number}" if way in ("first", "many") else f"count{number % 3}"
        facts = _facts(name, number)
        if way in ("replace", "first"):
            graph.replace(facts, f"https://example.org/g/{name}")
        else:
            graph.change(counted.get(name, ()) if way == "change" else (), facts)
        counted[name] = facts
        telling.send(number)


def _facts(name: str, number: int) -> set[Quad]:
    graph, value = NamedNode(f"https://example.org/g/{name}"), NamedNode("https://example.org/value")
    return {Quad(NamedNode(f"https://example.org/{name}/{fact}"), value, Literal(number), graph) for fact in range(50)}

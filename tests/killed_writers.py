"""A process that rewrites a workspace and is killed at one of its writes, in a module that it imports once."""

from __future__ import annotations

import itertools
import os
import signal
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from sqlalchemy import Engine, event

from irtwin.knowledge.mapping.remembered import RememberedRows
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.storage.database import Workspace
from irtwin.workflow import conclude, map_rows, rewriting
from tests.turn_takers import data_set


def take_in(folder: Path, name: str, database: str | None = None, graph_url: str | None = None) -> None:
    """Take in a robot as `irtwin run` does, without its twin."""
    with Workspace(folder, database) as place, rewriting(place, graph_url) as graph:
        place.ingest(*data_set(name, 2))
        graph.load_ontology()
        map_rows(place, graph)
        conclude(graph, lambda line: None)


def broken_off(folder: Path, name: str, database: str | None = None, graph_url: str | None = None) -> None:
    """Take in a robot, and fail once its rows are there."""
    with (
        suppress(KeyboardInterrupt),
        Workspace(folder, database) as place,
        rewriting(place, graph_url),
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

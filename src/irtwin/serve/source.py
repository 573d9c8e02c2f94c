"""The graph that is served: a workspace's, in its folder or on a SPARQL server that keeps it."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.knowledge.store.snapshot import Snapshot
from irtwin.location import Location

Current = Callable[[bool], KnowledgeGraph]  # the graph as it is now; True: not even half a second old


@contextmanager
def reading(location: Location) -> Iterator[Current]:
    """Give what gives the graph as it is. Raises InputError where there is none."""
    if location.graph_url is None:
        with Snapshot(location.graph_folder) as snapshot:
            yield snapshot.current
    else:
        with KnowledgeGraph(location.graph_url, location.folder) as graph:
            yield lambda at_once: graph

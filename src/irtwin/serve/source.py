"""The graph that is served: a workspace's, in its folder or on a SPARQL server that keeps it."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.knowledge.store.snapshot import Snapshot
from irtwin.location import Location
from irtwin.storage.series_place import are_elsewhere, elsewhere

Current = Callable[[bool], KnowledgeGraph]  # the graph as it is now; True: not even half a second old


def needs_network(location: Location) -> bool:
    """Whether the graph, or the samples that queries ask for, are elsewhere."""
    return location.graph_url is not None or are_elsewhere(location.folder)


@contextmanager
def reading(location: Location) -> Iterator[Current]:
    """Give what gives the graph as it is. Raises InputError where there is none, or its series cannot be read."""
    elsewhere(location.folder)  # what it imports, too: workers limit their memory afterwards
    if location.graph_url is None:
        with Snapshot(location.graph_folder) as snapshot:
            yield snapshot.current
    else:
        with KnowledgeGraph(location.graph_url, location.folder) as graph:
            yield lambda at_once: graph

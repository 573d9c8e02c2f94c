"""What was read of a graph since it was last written to: columns of its properties, and answers to queries.

A store in memory, and one that is open to write, changes by its graph alone, which then begins a new `Reading`; a view
of a folder never changes. So what is kept here is true for as long as it is there.
"""

from __future__ import annotations

from functools import cached_property

from pyoxigraph import Store

from irtwin.knowledge.store.columns import Columns
from irtwin.knowledge.store.sparql_server import SparqlServer


class Reading:
    """What was read of a store that nobody wrote to since."""

    def __init__(self, store: Store | SparqlServer) -> None:
        self._store = store

    @cached_property
    def columns(self) -> Columns:
        """Columns of its properties; not of a server's graph, which others may write to."""
        assert isinstance(self._store, Store)
        return Columns(self._store)

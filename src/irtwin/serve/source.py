"""Where the graph that is served comes from: a workspace's folder, or a SPARQL server that keeps it."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Self

from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.knowledge.store.snapshot import Snapshot
from irtwin.storage.series_place import are_elsewhere, elsewhere

Current = Callable[[bool], KnowledgeGraph]  # the graph as it is now; True: not even half a second old


@dataclass(frozen=True)
class Source:
    """A workspace, whose reports and meshes are served too, and the URL of the server that keeps its graph, if any.

    The URL may hold a password: it is shown nowhere, and goes to other processes by their standard input.
    """

    workspace: Path
    url: str | None = field(default=None, repr=False)

    @classmethod
    def told(cls, document: dict[str, Any]) -> Self:
        """Return the source that `telling` told of."""
        return cls(Path(document["workspace"]), document["url"])

    def telling(self) -> dict[str, Any]:
        """Return it as a JSON object, for another process."""
        return {"workspace": str(self.workspace), "url": self.url}

    @property
    def folder(self) -> Path:
        """Where the graph lies if no server keeps it."""
        return self.workspace / "graph"

    @property
    def needs_network(self) -> bool:
        """Whether the graph, or the samples that queries ask for, are elsewhere."""
        return self.url is not None or are_elsewhere(self.workspace)

    @contextmanager
    def reading(self) -> Iterator[Current]:
        """Give what gives the graph as it is. Raises InputError where there is none, or its series cannot be read."""
        elsewhere(self.workspace)  # what it imports, too: workers limit their memory afterwards
        if self.url is None:
            with Snapshot(self.folder) as snapshot:
                yield snapshot.current
        else:
            with KnowledgeGraph(self.url, self.workspace) as graph:
                yield lambda at_once: graph

"""What the ontology's graph says: the modules that hold for a workspace, its tariff, and a name of their content."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Iterator
from functools import lru_cache
from itertools import chain
from pathlib import Path

from pyoxigraph import Literal, NamedNode, Quad, Triple

from irtwin.knowledge.store.named_graphs import in_graph
from irtwin.knowledge.store.rdf_input import read_turtle
from irtwin.knowledge.tariff import tariff_of
from irtwin.knowledge.vocabulary import GRAPH_ONTOLOGY, ONTOLOGY, OWL
from irtwin.resources import Resources


def quads(resources: Resources, workspace: Path | None) -> Iterator[Quad]:
    """Yield what the ontology's graph says."""
    more = chain(_tariff(workspace), [version(resources, workspace)])
    return chain(_read_modules(*_modules(resources)), in_graph(more, GRAPH_ONTOLOGY))


def version(resources: Resources, workspace: Path | None) -> Triple:
    """Return what a graph of these modules and this tariff says of itself."""
    digest = hashlib.sha256(_modules(resources)[1])
    digest.update("".join(map(str, _tariff(workspace))).encode())
    return Triple(NamedNode(ONTOLOGY), NamedNode(f"{OWL}versionInfo"), Literal(f"sha-256:{digest.hexdigest()}"))


def _modules(resources: Resources) -> tuple[tuple[Path, ...], bytes]:
    """Return the files of the ontology, and their content."""
    paths = tuple(resources.paths("ontology"))
    return paths, b"".join(path.read_bytes() for path in paths)


def _tariff(workspace: Path | None) -> Iterable[Triple]:
    return () if workspace is None else tariff_of(workspace)


@lru_cache(maxsize=1)  # a run puts them into two graphs
def _read_modules(paths: tuple[Path, ...], content: bytes) -> tuple[Quad, ...]:
    """Return what modules of the ontology say, which are read anew where their content is another."""
    return tuple(in_graph(chain.from_iterable(map(read_turtle, paths)), GRAPH_ONTOLOGY))

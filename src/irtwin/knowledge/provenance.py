"""From a number back to what it was made of: individual, activity, provider, and so on down to files."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from datetime import datetime
from typing import Any

from irtwin.errors import InputError
from irtwin.knowledge.graph import KnowledgeGraph

_MAKERS = """
SELECT ?activity ?provider ?software ?finished
WHERE {
  ?thing prov:wasGeneratedBy ?activity .
  ?activity prov:wasAssociatedWith ?provider .
  OPTIONAL { ?activity irt:Software ?software }
  OPTIONAL { ?activity prov:endedAtTime ?finished }
}
ORDER BY ?finished ?activity"""

_INPUTS = "SELECT ?entity WHERE { ?activity prov:used ?entity } ORDER BY ?entity"

_FILES = (
    "SELECT ?file ?checksum WHERE { ?thing irt:File ?file OPTIONAL { ?thing irt:Checksum ?checksum } } ORDER BY ?file"
)

_MENTIONED = "ASK { { ?thing ?p ?o } UNION { ?s ?p ?thing } }"


@dataclass(frozen=True)
class Step:
    """One link of the chain: a thing, its file if it has one, and the activity that made it if one did.

    `depth` counts the activities between this thing and the one that was asked about.
    """

    depth: int
    thing: str
    file: str | None
    checksum: str | None
    activity: str | None
    provider: str | None
    software: str | None
    finished: datetime | None


def trace(graph: KnowledgeGraph, thing: str) -> tuple[Step, ...]:
    """Follow an individual's IRI back through the activities that made it and all that these used.

    A thing made by several activities has a step for each; one that none made ends the chain. InputError where
    the graph does not know the IRI.
    """
    if not graph.query(_MENTIONED, {"thing": thing})[0]["answer"]:
        raise InputError(
            f"{thing}: the graph does not know it; ask for IRIs with: irtwin query 'SELECT ?s {{ ?s ?p ?o }}'"
        )
    return tuple(_back(graph, thing, 0, set()))


def _back(graph: KnowledgeGraph, thing: str, depth: int, seen: set[str]) -> Iterator[Step]:
    if thing in seen:
        return
    seen.add(thing)
    file: dict[str, Any] = next(iter(graph.query(_FILES, {"thing": thing})), {})
    makers = [row for row in graph.query(_MAKERS, {"thing": thing})] or [{}]
    for maker in makers:
        yield Step(
            depth=depth,
            thing=thing,
            file=file.get("file"),
            checksum=file.get("checksum"),
            activity=maker.get("activity"),
            provider=maker.get("provider"),
            software=maker.get("software"),
            finished=maker.get("finished"),
        )
    for maker in makers:
        if maker:
            for row in graph.query(_INPUTS, {"activity": maker["activity"]}):
                yield from _back(graph, row["entity"], depth + 1, seen)

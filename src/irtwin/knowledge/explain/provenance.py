"""From a number back to what it was made of: individual, activity, provider, and so on down to files."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from datetime import datetime

from irtwin.errors import InputError
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.knowledge.store.table import Row

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

_RUN = "SELECT ?run WHERE { ?thing irt:series_of ?run FILTER NOT EXISTS { ?thing prov:wasGeneratedBy ?activity } }"

_MENTIONED = "ASK { { ?thing ?p ?o } UNION { ?s ?p ?thing } }"


_ACTIVITY = """
SELECT ?activity ?provider ?software ?finished
WHERE {
  OPTIONAL { ?activity prov:wasAssociatedWith ?provider }
  OPTIONAL { ?activity irt:Software ?software }
  OPTIONAL { ?activity prov:endedAtTime ?finished }
}"""


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
        raise InputError(f"{thing}: not in the graph; list IRIs with: irtwin query 'SELECT ?s {{ ?s ?p ?o }}'")
    return tuple(_back(graph, thing, 0, set()))


def makers(graph: KnowledgeGraph, thing: str) -> list[Row]:
    """Return the activities that made a thing, each with its provider, software and when it finished."""
    return list(graph.query(_MAKERS, {"thing": thing}))


def activity(graph: KnowledgeGraph, iri: str) -> Row:
    """Return what is known of an activity, like `makers`."""
    return {**next(iter(graph.query(_ACTIVITY, {"activity": iri})), {}), "activity": iri}


def used_by(graph: KnowledgeGraph, activity: str) -> list[str]:
    """Return the IRIs of what an activity used."""
    return [row["entity"] for row in graph.query(_INPUTS, {"activity": activity})]


def recorded_of(graph: KnowledgeGraph, series: str) -> list[str]:
    """Return the IRI of the run that samples are of, where no activity made them."""
    return [row["run"] for row in graph.query(_RUN, {"thing": series})]


def file_of(graph: KnowledgeGraph, thing: str) -> tuple[str | None, str | None]:
    """Return the path and the checksum of the file that a thing is kept in, as far as they are known."""
    found = next(iter(graph.query(_FILES, {"thing": thing})), {})
    return (found.get("file"), found.get("checksum"))


def _back(graph: KnowledgeGraph, thing: str, depth: int, seen: set[str]) -> Iterator[Step]:
    if thing in seen:
        return
    seen.add(thing)
    file, checksum = file_of(graph, thing)
    made_by = makers(graph, thing)
    for maker in made_by or [{}]:
        yield Step(
            depth=depth,
            thing=thing,
            file=file,
            checksum=checksum,
            activity=maker.get("activity"),
            provider=maker.get("provider"),
            software=maker.get("software"),
            finished=maker.get("finished"),
        )
    for maker in made_by:
        for entity in used_by(graph, maker["activity"]):
            yield from _back(graph, entity, depth + 1, seen)

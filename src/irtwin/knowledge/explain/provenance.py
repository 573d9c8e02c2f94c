"""From an individual to what it was made of: its activities, their providers, what they used, and its file."""

from __future__ import annotations

from dataclasses import dataclass

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

_INPUTS = "SELECT ?entity WHERE { ?activity prov:used|prov:wasInformedBy ?entity } ORDER BY ?entity"

_FILES = """
SELECT ?file ?checksum (COALESCE(?own, ?shared) AS ?folder)
WHERE {
  ?thing irt:File ?file
  OPTIONAL { ?thing irt:Checksum ?checksum }
  OPTIONAL { ?thing irt:Data_Folder ?own }
  OPTIONAL {
    ?thing irt:Run_Role ?role ; irt:run_of / ^irt:source_of ?source .
    ?source irt:Source_Kind "data set" ; irt:Data_Folder ?shared
  }
}
ORDER BY ?file"""

_TOLD_IN = """
SELECT ?file ?checksum ?folder
WHERE {
  ?property irt:told_in ?kind .
  ?thing (irt:run_of | ^irt:has_Joint | ^irt:has_Information | irt:note_of) ?robot .
  ?source irt:source_of ?robot ; irt:Source_Kind ?one ; irt:File ?file ; irt:Checksum ?checksum ;
    irt:Data_Folder ?folder .
  FILTER(?one = ?kind || (?kind = "URDF" && NOT EXISTS { ?other irt:source_of ?robot ; irt:Source_Kind ?kind }))
  FILTER NOT EXISTS { ?thing irt:run_of ?robot FILTER NOT EXISTS { ?thing irt:Run_Role ?role } }
}
ORDER BY ?file"""

_RUN = """
SELECT ?run
WHERE {
  ?thing irt:series_of ?run
  FILTER NOT EXISTS { ?thing prov:wasGeneratedBy / prov:wasAssociatedWith ?provider }
}"""

_ACTIVITY = """
SELECT ?activity ?provider ?software ?finished
WHERE {
  OPTIONAL { ?activity prov:wasAssociatedWith ?provider }
  OPTIONAL { ?activity irt:Software ?software }
  OPTIONAL { ?activity prov:endedAtTime ?finished }
}"""


@dataclass(frozen=True)
class File:
    """A file and its SHA-256; its path begins in the workspace, or in the `folder` of a data set."""

    file: str | None = None
    checksum: str | None = None
    folder: str | None = None


def makers(graph: KnowledgeGraph, thing: str) -> list[Row]:
    """Return the activities that made a thing, each with its provider, software and when it finished."""
    return list(graph.query(_MAKERS, {"thing": thing}))


_PLAN = "SELECT ?kind { ?thing a ?kind FILTER(?kind IN (irt:Planned_Run, irt:Planned_Series)) }"


def activity(graph: KnowledgeGraph, iri: str) -> Row:
    """Return what is known of an activity, like `makers`."""
    return {**next(iter(graph.query(_ACTIVITY, {"activity": iri})), {}), "activity": iri}


def used_by(graph: KnowledgeGraph, activity: str) -> list[str]:
    """Return the IRIs of what an activity used."""
    return [row["entity"] for row in graph.query(_INPUTS, {"activity": activity})]


def recorded_of(graph: KnowledgeGraph, series: str) -> list[str]:
    """Return the IRI of the run that samples are of, where no activity made them."""
    return [row["run"] for row in graph.query(_RUN, {"thing": series})]


def is_planned(graph: KnowledgeGraph, thing: str) -> bool:
    """Whether a run, or the samples of one, did not take place."""
    return bool(list(graph.query(_PLAN, {"thing": thing})))


def file_of(graph: KnowledgeGraph, thing: str) -> File:
    """Return the file that a thing is kept in, as far as it is known."""
    return File(**next(iter(graph.query(_FILES, {"thing": thing})), {}))


def told_in(graph: KnowledgeGraph, thing: str, property: str) -> File:
    """Return the file of a data set that says a property of a thing, where one does."""
    return File(**next(iter(graph.query(_TOLD_IN, {"thing": thing, "property": property})), {}))

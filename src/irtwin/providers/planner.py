"""The planner: from what the graph lacks and what providers say of themselves, to what is run and in which order."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from graphlib import CycleError, TopologicalSorter

from irtwin.errors import InputError
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.providers.provider import activity, load_provider, software_of
from irtwin.storage.database import Workspace
from irtwin.storage.schema import METER

_DECLARATIONS = """
PREFIX irt: <https://w3id.org/irtwin#>
SELECT ?provider ?class
       (GROUP_CONCAT(DISTINCT STR(?required); separator=" ") AS ?requires)
       (GROUP_CONCAT(DISTINCT STR(?populated); separator=" ") AS ?populates)
WHERE {
  ?provider a irt:Data_Provider ; irt:applies_to ?class ; irt:populates ?populated .
  OPTIONAL { ?provider irt:requires ?required }
}
GROUP BY ?provider ?class
ORDER BY ?provider
"""

# Providers work before reasoning: what a property says may stand in the graph by its inverse.
_INVERSES = """
PREFIX owl: <http://www.w3.org/2002/07/owl#>
SELECT ?one ?other WHERE { ?one owl:inverseOf|^owl:inverseOf ?other FILTER(isIRI(?one) && isIRI(?other)) }
"""


@dataclass(frozen=True)
class Declaration:
    """What the ontology says of a provider, in IRIs; `name` is the end of its own."""

    name: str
    applies_to: str
    requires: frozenset[str]
    populates: frozenset[str]


SetAside = Callable[[str, InputError], None]


def populate(
    workspace: Workspace,
    graph: KnowledgeGraph,
    refresh: Callable[[], None],
    announce: Callable[[str], None],
    set_aside: SetAside | None = None,
) -> bool:
    """Run every provider on every individual that lacks what it populates and has what it requires.

    Providers run in dependency order, each once; `refresh` brings the graph up to date with the database
    after each that made something. Returns whether any did.

    A robot whose data a provider refuses is left as it is from there on, and `set_aside` is told its robot_id and why;
    without `set_aside` the InputError is raised.
    """
    refused: set[str] = set()
    made_something = False
    for declaration in in_order(declarations(graph)):
        subjects = [subject for subject in lacking(graph, declaration) if _robot_id(subject) not in refused]
        if not subjects:
            continue
        announce(f"  {declaration.name}: {len(subjects)} individual{'s' if len(subjects) > 1 else ''}")
        provide = load_provider(declaration.name)
        count = 0
        for subject in subjects:
            if _robot_id(subject) in refused:
                continue
            started = datetime.now(UTC)
            try:
                made = provide(workspace, subject.rpartition("/")[2])
            except InputError as error:
                if set_aside is None:
                    raise
                refused.add(_robot_id(subject))
                set_aside(_robot_id(subject), error)
                continue
            below = subject.removeprefix(graph.base)
            package = software_of(declaration.name)
            worked = activity(declaration.name, made.robot_id, below, started, package)
            meter = activity(METER, made.robot_id, below, started, package)
            metered = (meter, made.metered) if made.metered else None
            workspace.replace_activity(worked, made.used, made.rows, made.series, made.documents, metered=metered)
            count += 1
        if count:
            made_something = True
            refresh()
    return made_something


def _robot_id(subject: str) -> str:
    """Return the robot that a robot's or a run's IRI is about."""
    return subject.rpartition("/")[2].partition(".")[0]


def declarations(graph: KnowledgeGraph) -> list[Declaration]:
    """Read what the ontology declares of providers."""
    return [
        Declaration(
            name=row["provider"].rpartition("/")[2],
            applies_to=row["class"],
            requires=frozenset((row["requires"] or "").split()),
            populates=frozenset(row["populates"].split()),
        )
        for row in graph.query(_DECLARATIONS)
    ]


def in_order(declared: Sequence[Declaration]) -> list[Declaration]:
    """Order providers so that each comes after those that populate what it requires; InputError on a circle."""
    by_name = {declaration.name: declaration for declaration in declared}
    needs = {
        one.name: {other.name for other in declared if other is not one and one.requires & other.populates}
        for one in declared
    }
    try:
        return [by_name[name] for name in TopologicalSorter(needs).static_order()]
    except CycleError as error:
        circle = " -> ".join(error.args[1])
        raise InputError(f"ontology/providers.ttl: providers require each other in a circle: {circle}") from error


def lacking(graph: KnowledgeGraph, declaration: Declaration) -> list[str]:
    """Return the IRIs of individuals that have what the provider requires and nothing of what it populates.

    A requirement may be met by the individual itself, by its robot, or by a run of it.
    """
    inverses = {row["one"]: row["other"] for row in graph.query(_INVERSES)}

    def said(iri: str) -> str:
        return f"<{iri}>|^<{inverses[iri]}>" if iri in inverses else f"<{iri}>"

    required = "".join(
        f"FILTER EXISTS {{ ?subject (irt:run_of|^irt:run_of)? / ({said(iri)}) ?value{place} }}\n"
        for place, iri in enumerate(sorted(declaration.requires))
    )
    rows = graph.query(
        f"""PREFIX irt: <https://w3id.org/irtwin#>
        PREFIX rdfs: <http://www.w3.org/2000/01/rdf-schema#>
        SELECT DISTINCT ?subject WHERE {{
          ?class rdfs:subClassOf* <{declaration.applies_to}> . ?subject a ?class .
          {required}
          FILTER NOT EXISTS {{ ?subject ({"|".join(map(said, sorted(declaration.populates)))}) ?there }}
        }} ORDER BY ?subject"""
    )
    return [row["subject"] for row in rows]

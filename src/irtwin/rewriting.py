"""A workspace's graph rewritten: opened by one at a time, brought up to date with rows and ontology, and concluded."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager

from irtwin.announce import Announce
from irtwin.errors import InputError
from irtwin.identification.progress import telling
from irtwin.knowledge.asserted.statements import map_facts
from irtwin.knowledge.engines import NATIVE
from irtwin.knowledge.extensions import check_mappings
from irtwin.knowledge.mapping import refresh
from irtwin.knowledge.reasoning import reason
from irtwin.knowledge.shacl.validation import validate
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.knowledge.store.snapshot import kept
from irtwin.knowledge.vocabulary import shorten
from irtwin.providers.planner import in_a_circle, populate
from irtwin.report.extensions import check as check_extensions
from irtwin.storage.database import Workspace
from irtwin.storage.engine import before_writing
from irtwin.storage.tariff import read_tariff
from irtwin.storage.turns import rewriting_alone

LONGEST_SQL = 600.0  # s for the SQL of a mapping, where some do not ship


@contextmanager
def rewriting(place: Workspace, announce: Announce = lambda line: None) -> Iterator[KnowledgeGraph]:
    """Open the workspace's graph to rewrite it: in its folder, or on a SPARQL server; bring up to date one left behind.

    One of another ontology, as an older irtwin makes it, is brought up to date too: rules conclude from both. Who reads
    the folder meanwhile sees what was there before, if anything was; who wants to rewrite it too waits.
    Where the block fails after a change, the graph says that it is behind.
    Raises InputError for a fault in what extends the workspace, before anything is written, or after too long a wait.
    """
    check_before(place)
    with ExitStack() as held:
        held.enter_context(rewriting_alone(place.engine, place.folder))
        graph = held.enter_context(KnowledgeGraph.of_workspace(place))
        if graph.is_behind:
            _catch_up(place, graph, announce, "is behind the database, as a command was broken off or failed")
        was_there = bool(graph.graphs())
        if was_there and place.location.graph_url is None:
            held.enter_context(kept(place.graph_folder))
        if was_there and not graph.has_ontology:
            _catch_up(place, graph, announce, "is of another ontology or tariff than hold now")
        held.enter_context(_told(place, graph))
        yield graph


@contextmanager
def _told(place: Workspace, graph: KnowledgeGraph) -> Iterator[None]:
    """Have the graph say that it is behind from the first change of it, or of rows, until the block ends well."""
    with graph.rewritten(), before_writing(place.engine, graph.rows_change):
        yield


def _catch_up(place: Workspace, graph: KnowledgeGraph, announce: Announce, why: str) -> None:
    """Do what the command that left the graph behind had not done, from the rows that it left."""
    announce(f"Catching up: the graph {why}")
    with _told(place, graph):
        fill(place, graph, announce)


def fill(place: Workspace, graph: KnowledgeGraph, announce: Announce) -> None:
    """Put all that the database knows into a graph, and what follows from it."""
    from irtwin.providers.effects_of_ontology import check_effects  # takes SciPy, which an update can spare

    graph.load_ontology()
    check_effects(graph)
    map_rows(place, graph)
    populate_others(place, graph, announce)
    conclude(graph, announce)


def renew(place: Workspace, graph: KnowledgeGraph, announce: Announce) -> None:
    """Bring the graph up to date with rows that changed, and conclude."""
    graph.load_ontology()
    map_rows(place, graph)
    conclude(graph, announce)


def check_before(place: Workspace) -> None:
    """Raise InputError for a fault in what extends a workspace, or in its tariff."""
    read_tariff(place.folder)
    check_extensions(place.resources)
    check_mappings(place.resources, place.engine)


def map_rows(place: Workspace, graph: KnowledgeGraph) -> None:
    """Bring the individuals up to date with the database."""
    files = graph.resources.of("mappings")
    seconds = LONGEST_SQL if any(file.is_extension for file in files) else math.inf
    refresh(graph, place.engine, [file.path for file in files], place.mapped_rows, seconds)
    with place.reading() as session:
        map_facts(graph, session)


def populate_others(place: Workspace, graph: KnowledgeGraph, announce: Announce) -> bool:
    """Populate what robots of earlier data sets lack; one that cannot be is said, and hinders no other.

    So are providers that wait for each other.
    """

    def set_aside(robot_id: str, reason: InputError) -> None:
        announce(f"  {robot_id} is set aside: {reason}; remove it with `irtwin workspace drop {robot_id}`")

    with telling(announce):
        did = populate(place, graph, lambda: map_rows(place, graph), announce, set_aside)
    if circle := in_a_circle(graph):
        announce(f"  {circle}")
    return did


def conclude(graph: KnowledgeGraph, announce: Announce, engine: str = NATIVE) -> None:
    """Reason over the graph and check its constraints; say what is done and what was found."""
    announce("Reasoning")
    inferred = reason(graph, engine)
    by = "OWL 2 RL" if engine == NATIVE else f"OWL by {engine}"
    announce(f"  {inferred.owl_rl} new triples from {by}, {inferred.by_rules} from rules")
    if inferred.joined_by:
        announce(f"  reasoned over all robots together, for this concerns all of them: {inferred.joined_by}")
    for contradiction, about in inferred.contradictions.items():
        announce(f"  about {', '.join(shorten(node, graph.base) for node in about)}: {contradiction}")
    announce("Checking the constraints")
    for violation in validate(graph):
        announce(f"  {violation}")

"""The planner: providers are run on what the graph says to be ready for them, until nothing more is."""

from __future__ import annotations

from collections.abc import Callable
from datetime import UTC, datetime

from irtwin.announce import Announce
from irtwin.errors import InputError
from irtwin.identification.progress import track
from irtwin.knowledge.rules.files import all_rules
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.knowledge.vocabulary import shorten
from irtwin.providers.provider import keep, load_provider, software_of
from irtwin.storage.database import Workspace

_READY_FOR = "https://w3id.org/irtwin/rules/ready_for"

_READY_AGAIN = "https://w3id.org/irtwin/rules/ready_again"
_RENEWED = "SELECT DISTINCT ?name { ?provider irt:renewed_by ?property ; irt:Entry_Point ?name }"
# Who waits for what another would populate, which waits in turn for the first, or for who waits so.
_IN_A_CIRCLE = """
SELECT DISTINCT ?one ?needed ?other {
    ?one irt:applies_to ?class ; irt:requires ?needed .
    ?other irt:populates ?needed ; (irt:requires/^irt:populates)* ?one .
    ?kind rdfs:subClassOf* ?class . ?waiting a ?kind .
    FILTER NOT EXISTS { ?one irt:populates ?made . ?waiting ?made ?there }
    FILTER NOT EXISTS { ?waiting (irt:run_of|^irt:run_of)? ?holder . ?holder ?needed ?value }
    FILTER NOT EXISTS {
        ?free irt:populates ?needed FILTER NOT EXISTS { ?free (irt:requires/^irt:populates)* ?one }
    }
} ORDER BY ?one ?needed ?other"""

SetAside = Callable[[str, InputError], None]


def populate(
    workspace: Workspace,
    graph: KnowledgeGraph,
    refresh: Callable[[], None],
    announce: Announce,
    set_aside: SetAside | None = None,
) -> bool:
    """Run every provider on every individual that is ready for it, and on those that get so by that, once on each.

    Those that read all runs of a robot come last: what others make is there then.

    `refresh` brings the graph up to date with the database after providers made something. Returns whether any did.

    A robot whose data a provider refuses is left as it is from there on, and `set_aside` is told its robot_id and why;
    without `set_aside` the InputError is raised.
    """
    renewed = _renewed(graph)
    refused: set[str] = set()
    done: set[tuple[str, str]] = set()
    while todo := {
        name: left
        for name, subjects in ready(graph).items()
        if (left := [due for due in subjects if (name, due) not in done and _robot_id(graph, due) not in refused])
    }:
        before = len(done)
        for name, subjects in ({of: todo[of] for of in todo if of not in renewed} or todo).items():
            announce(f"  {name}: {len(subjects)} individual{'s' if len(subjects) > 1 else ''}")
            for subject in track(subjects, name):
                robot_id = _robot_id(graph, subject)
                if robot_id in refused:
                    continue
                try:
                    _provide(workspace, graph, name, subject)
                except InputError as error:
                    if set_aside is None:
                        raise
                    refused.add(robot_id)
                    set_aside(robot_id, error)
                    continue
                done.add((name, subject))
        if len(done) > before:
            refresh()
    return bool(done)


def renew(workspace: Workspace, graph: KnowledgeGraph, refresh: Callable[[], None]) -> None:
    """Run the providers that read all runs of a robot where one of these is new, or what a user asserts."""
    renewed = _renewed(graph)
    todo = {name: subjects for name, subjects in ready(graph).items() if name in renewed}
    for name, subjects in todo.items():
        for subject in subjects:
            _provide(workspace, graph, name, subject)
    if todo:
        refresh()


def ready(graph: KnowledgeGraph) -> dict[str, list[str]]:
    """Return the IRIs of the individuals that are ready for each provider, by its name."""
    rules = [rule for rule in all_rules(graph.resources) if rule.name in (_READY_FOR, _READY_AGAIN)]
    ready_by_provider: dict[str, list[str]] = {}
    for triple in sorted(set().union(*(graph.construct(rule.construct) for rule in rules)), key=str):
        ready_by_provider.setdefault(triple.object.value.rpartition("/")[2], []).append(triple.subject.value)  # type: ignore[union-attr]
    return dict(sorted(ready_by_provider.items()))


def _renewed(graph: KnowledgeGraph) -> set[str]:
    """Return the names of the providers that read all runs of a robot."""
    return {str(row["name"]) for row in graph.query(_RENEWED)}


def in_a_circle(graph: KnowledgeGraph) -> str | None:
    """Return, in one line, which providers wait for each other, so that none of them is ever run; None if none does."""
    asked = ([shorten(str(iri)).rpartition(":")[2] for iri in row.values()] for row in graph.query(_IN_A_CIRCLE))
    waits = [f"{waiting} requires {needed}, which {awaited} populates" for waiting, needed, awaited in asked]
    if not waits:
        return None
    return (
        f"providers in a circle are not run: {'; '.join(waits)}; have one of them require less, or a data set or "
        "another provider say what it requires"
    )


def _provide(workspace: Workspace, graph: KnowledgeGraph, name: str, subject: str) -> None:
    """Run a provider on one individual, and keep what it made."""
    provide, package = load_provider(name), software_of(name)
    started = datetime.now(UTC)
    below = subject.removeprefix(graph.base)
    kind, _, key = below.partition("/")
    made = provide(workspace, key if kind in ("robot", "run") else below)
    keep(workspace, name, made, started, below, package)


def _robot_id(graph: KnowledgeGraph, subject: str) -> str:
    """Return the robot that an individual's IRI is about: robot/ID, run/ID.NAME, saving_action/ID/REMEDY."""
    kind, _, key = subject.removeprefix(graph.base).partition("/")
    return (key or kind).partition("/")[0].partition(".")[0]

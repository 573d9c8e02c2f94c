"""What users assert by SPARQL Update or an edited OWL file: tried, kept in the database, and followed.

Run as a module it does updates for `irtwin serve`, each in a fork that can be ended. JSON on a line of standard input
says which. An answer of one line says what is wrong with it, and an empty line that the fork has ended. Nothing
is kept before the answer; the graph follows after it.
"""

from __future__ import annotations

import json
import multiprocessing
import sys
from collections.abc import Callable, Iterable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pyoxigraph import Quad

from irtwin.announce import Announce
from irtwin.errors import InputError
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.knowledge.store.no_network import leave_network
from irtwin.knowledge.store.sparql_server import ServerFault
from irtwin.limits import limit_memory
from irtwin.location import Location
from irtwin.serve.protocol import SERVER_FAILS
from irtwin.storage.database import Workspace

if TYPE_CHECKING:  # they take seconds to import, which an update of a graph without a database can spare
    from irtwin.knowledge.asserted.edited import Edit
    from irtwin.knowledge.asserted.statements import Assertion

_BUSY = "another process is writing the graph: try again later"


def take_edited(
    owl: Path,
    location: Location,
    *,
    author: str,
    agrees: Callable[[Edit], bool],
    announce: Announce = lambda line: None,
) -> Assertion | None:
    """Take in what was changed in an OWL file since `irtwin export` wrote it; None where nothing was, or not agreed.

    `agrees` is shown the difference before anything is written. Raises InputError where a change is nobody's to make,
    or would contradict.
    """
    from irtwin.knowledge.asserted.edited import edit_of
    from irtwin.rewriting import rewriting

    with Workspace.existing(location) as place, rewriting(place, announce) as graph:
        edit = edit_of(graph, owl)
        if not agrees(edit):
            return None
        assertion = keep(place, graph, edit.removed, edit.added, author)
        follow(place, graph, assertion, announce)
        return assertion


def keep(
    place: Workspace, graph: KnowledgeGraph, removed: Iterable[Quad], added: Iterable[Quad], author: str
) -> Assertion:
    """Keep what a change of the graph asserts, if it holds with all else. Raises InputError where it does not."""
    from irtwin.knowledge.asserted.statements import individuals, read
    from irtwin.knowledge.asserted.trial import check

    with place.reading() as session:
        assertion = read(graph, session, removed, added, author)
        session.expunge_all()
    check(graph, assertion.removed, assertion.added | individuals(graph, place.engine, assertion.facts))
    place.keep_facts(assertion.facts, assertion.withdrawn)
    return assertion


def follow(
    place: Workspace, graph: KnowledgeGraph, assertion: Assertion, announce: Announce = lambda line: None
) -> None:
    """Bring the graph up to date with what is kept now."""
    from irtwin.providers.planner import renew
    from irtwin.rewriting import conclude, map_rows

    if assertion.facts or assertion.withdrawn:
        map_rows(place, graph)
        renew(place, graph, lambda: map_rows(place, graph))
        graph.change(assertion.removed, ())  # of a user's own graph that nothing is left of
        conclude(graph, announce)


def main(memory: int) -> None:
    """Do the updates on standard input, each in a fork, which finds imported what it takes."""
    forks = multiprocessing.get_context("fork")
    for line in sys.stdin.buffer:
        request = json.loads(line)
        if Workspace.is_there(Location.told(request["location"])):
            from irtwin.knowledge.asserted import trial  # noqa: F401
            from irtwin.providers import planner  # noqa: F401
        fork = forks.Process(target=_do, args=(request, memory))
        fork.start()
        fork.join()
        print(flush=True)


def _do(request: dict[str, Any], memory: int) -> None:
    """Do an update; write what is wrong with it, as JSON."""
    location = Location.told(request["location"])
    if location.graph_url is None:
        leave_network()
    with ExitStack() as held:
        try:
            place, graph = held.enter_context(_opened(location))
        except ServerFault as error:
            return _answer(_of_server(error))
        except InputError:
            return _answer({"status": 503, "message": _BUSY, "headers": {"Retry-After": "5"}})
        limit_memory(memory)
        dataset = request["text"], request["default_graphs"], request["named_graphs"], request["base"]
        try:
            if place is None:
                graph.update(*dataset)
                return _answer({})
            assertion = keep(place, graph, *graph.difference(*dataset), request["author"])
        except ServerFault as error:
            return _answer(_of_server(error))
        except InputError as error:
            return _answer({"status": 400, "message": str(error), "headers": {}})
        except MemoryError:  # no answer: who asked takes it for this, or for a process that was killed by it
            return
        _answer({})
        follow(place, graph, assertion)


@contextmanager
def _opened(location: Location) -> Iterator[tuple[Workspace | None, KnowledgeGraph]]:
    """Open the graph to write, with its workspace; of a graph that has no database it is all that is kept."""
    if Workspace.is_there(location):
        from irtwin.rewriting import rewriting

        with Workspace.existing(location) as place, rewriting(place) as graph:
            yield place, graph
    else:
        with KnowledgeGraph(location.graph_url or location.graph_folder, location.folder) as graph:
            yield None, graph


def _of_server(error: ServerFault) -> dict[str, object]:
    print(f"irtwin: {error}", file=sys.stderr)
    return {"status": 502, "message": SERVER_FAILS, "headers": {}}


def _answer(answer: dict[str, object]) -> None:
    print(json.dumps(answer), flush=True)


if __name__ == "__main__":
    main(int(sys.argv[1]))

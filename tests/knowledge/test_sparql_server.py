"""The graph on a SPARQL server: the `oxigraph` of PyPI answers as the embedded store does."""

from __future__ import annotations

import base64
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from http.server import BaseHTTPRequestHandler, HTTPServer

import pytest
from pyoxigraph import Quad, Store
from tests.knowledge.test_graph import A, B, quad, total
from tests.sparql_servers import oxigraph

from irtwin.errors import InputError
from irtwin.knowledge.questions.queries import ask, named_questions
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.knowledge.store.sparql_server import TOKEN, SparqlServer
from irtwin.knowledge.vocabulary import GRAPH_ACTIVITY, GRAPH_ONTOLOGY, GRAPH_SOURCE


@pytest.fixture(scope="module")
def server_url() -> Iterator[str]:
    with oxigraph() as server:
        yield server.url


@pytest.fixture
def served(server_url: str, two_robots: list[Quad]) -> KnowledgeGraph:
    graph = KnowledgeGraph(server_url)
    graph.store._store.update("DROP ALL")
    graph.load_ontology()
    graph.replace(two_robots, GRAPH_SOURCE, GRAPH_ACTIVITY)
    return graph


def test_every_question_has_the_answer_of_the_embedded_store(served: KnowledgeGraph, graph: KnowledgeGraph) -> None:
    assert served.graphs() == graph.graphs()
    for name in named_questions():
        assert ask(served, name) == ask(graph, name), name


@pytest.mark.slow
def test_what_is_there_already_is_left_alone(served: KnowledgeGraph, two_robots: list[Quad]) -> None:
    """The server calls blank nodes as it likes: the ontology is the same all the same."""
    served.store._store.update(f"INSERT DATA {{ GRAPH <{A}> {{ <https://example.org/x> a <https://example.org/X> }} }}")
    assert served.replace(two_robots, GRAPH_SOURCE, GRAPH_ACTIVITY) == []
    ontology = served.triples(GRAPH_ONTOLOGY)
    served.load_ontology()
    assert served.triples(GRAPH_ONTOLOGY) == ontology


def test_union_is_kept(served: KnowledgeGraph) -> None:
    served.replace([], GRAPH_SOURCE, GRAPH_ACTIVITY)
    served.replace([quad("x", 2.0, A), quad("x", 2.0, B), quad("y", 3.0, B)], A, B)
    assert total(served) == 5.0
    served.change([quad("x", 2.0, B), quad("y", 3.0, B)], [quad("y", 4.0, B)])
    assert total(served) == 6.0
    served.replace([], A, B)
    assert total(served) == 0


def test_construct_ask_bindings_and_faults(served: KnowledgeGraph) -> None:
    assert len(served.construct("CONSTRUCT { ?s irt:Run_Name ?n } WHERE { ?s irt:Run_Name ?n }")) == 5
    assert served.query("ASK { ?s a irt:Industrial_Robot }").rows == ({"answer": True},)
    robot = "https://w3id.org/irtwin/id/robot/Arm_A"
    assert len(served.query("SELECT ?run { ?run irt:run_of ?robot }", {"robot": robot})) == 3
    with pytest.raises(InputError, match="not a SPARQL query"):
        served.query("SELECT * { ?s ?p }")
    with pytest.raises(InputError, match="not allowed"):
        served.query("SELECT * { SERVICE <http://example.org/> { ?s ?p ?o } }")


@pytest.mark.parametrize(
    ("query", "update"),
    [
        ("http://h:7878/query", "http://h:7878/update"),
        ("http://h:3030/ds/query", "http://h:3030/ds/update"),
        ("http://h:7200/repositories/r", "http://h:7200/repositories/r/statements"),
        ("http://h:8000/sparql", "http://h:8000/sparql"),
    ],
)
def test_address_of_updates(query: str, update: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(SparqlServer, "query", lambda *_: Store().query("ASK {}"))
    assert SparqlServer(query).update_url == update


@pytest.mark.parametrize(
    ("url", "message"),
    [
        ("ftp://example.org/", "begins with http"),
        ("file:///etc/passwd", "begins with http"),
        ("http://", "names a host"),
        ("http://h:port/", "cannot be read"),
        ("http://user:secret@127.0.0.1:1/query", r"http://127\.0\.0\.1:1/query: no SPARQL server answers"),
        ("http://127.0.0.1:1/query?key=secret", r"http://127\.0\.0\.1:1/query: no SPARQL server answers"),
    ],
)
def test_what_is_no_server(url: str, message: str) -> None:
    with pytest.raises(InputError, match=message) as caught:
        KnowledgeGraph(url)
    assert "secret" not in str(caught.value)


@contextmanager
def answering(respond: Callable[[BaseHTTPRequestHandler, str], None]) -> Iterator[str]:
    """A server of ours; yields its URL without the scheme. `respond` gets each request and its body."""

    class Handler(BaseHTTPRequestHandler):
        def do_POST(self) -> None:
            respond(self, self.rfile.read(int(self.headers["Content-Length"])).decode())

        def log_message(self, *arguments: object) -> None:
            pass

    server = HTTPServer(("127.0.0.1", 0), Handler)
    threading.Thread(target=server.serve_forever, args=(0.01,), daemon=True).start()
    yield f"127.0.0.1:{server.server_port}/sparql"
    server.shutdown()


@pytest.fixture
def refusing() -> Iterator[tuple[str, list[str]]]:
    """A server that wants to know who asks; yields its URL and what it was told."""
    told: list[str] = []

    def respond(request: BaseHTTPRequestHandler, body: str) -> None:
        told.append(request.headers.get("Authorization", ""))
        request.send_error(401)

    with answering(respond) as address:
        yield address, told


def of_virtuoso(request: BaseHTTPRequestHandler, body: str, boolean: bool) -> None:
    """Answer a query in a body of parameters alone; refuse updates, for want of a default graph."""
    assert request.headers["Content-Type"].startswith(
        ("application/x-www-form-urlencoded", "application/sparql-update")
    )
    if not body.startswith("query="):
        return request.send_error(400, explain="No plain default graph specified in the preamble")
    table = '{"head": {"vars": ["__ASK_RETVAL"]}, "results": {"bindings": []}}'
    request.send_response(200)
    request.send_header("Content-Type", "application/sparql-results+json")
    request.end_headers()
    request.wfile.write(('{"head": {}, "boolean": true}' if boolean and "ASK" in body else table).encode())
    return None


def test_one_that_departs_too_far_is_refused() -> None:
    a_table = pytest.raises(InputError, match="answers ASK by a table, as Virtuoso does")
    with answering(partial(of_virtuoso, boolean=False)) as address, a_table:
        KnowledgeGraph(f"http://{address}")
    with answering(partial(of_virtuoso, boolean=True)) as address:
        graph = KnowledgeGraph(f"http://{address}")
        for write in (lambda: graph.replace([quad("x", 1.0, A)], A), lambda: graph.change([], [quad("x", 1.0, A)])):
            with pytest.raises(InputError, match=r"takes no SPARQL 1\.1 Update .*No plain default graph.*nothing was"):
                write()


def test_credentials(refusing: tuple[str, list[str]], monkeypatch: pytest.MonkeyPatch) -> None:
    address, told = refusing
    with pytest.raises(InputError, match="refuses the query: 401"):
        KnowledgeGraph(f"http://{address}")
    monkeypatch.setenv(TOKEN, "abc")
    with pytest.raises(InputError) as caught:
        KnowledgeGraph(f"http://{address}")
    assert "abc" not in str(caught.value)
    with pytest.raises(InputError):
        KnowledgeGraph(f"http://me:s%40crt@{address}")
    assert told == ["", "Bearer abc", f"Basic {base64.b64encode(b'me:s@crt').decode()}"]

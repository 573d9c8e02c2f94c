"""Updates behind a token, and what readers see while the endpoint, or another process, writes."""

from __future__ import annotations

import subprocess
import sys
import time

import httpx
import pytest
import rdflib
from rdflib.plugins.stores.sparqlstore import SPARQLUpdateStore
from tests.endpoint import CLIENT, TOKEN, serving

from irtwin.knowledge.store.graph import KnowledgeGraph

pytestmark = pytest.mark.slow

VALUES = "SELECT ?o { <http://e/s> <http://e/p> ?o } ORDER BY ?o"


def values(server) -> list[str]:
    return [row["o"]["value"] for row in server.ask(VALUES).json()["results"]["bindings"]]


def test_who_has_the_token_writes_and_reads_it_at_once(writable) -> None:
    for number in range(2):
        done = writable.update(
            f"DELETE WHERE {{ <http://e/s> ?p ?o }} ; INSERT DATA {{ <http://e/s> <http://e/p> {number} }}"
        )
        assert (done.status_code, done.content) == (204, b"")
        assert [values(writable) for _ in range(4)] == [[str(number)]] * 4


@pytest.mark.parametrize(
    "authorization", [None, "Bearer wrong", "Bearer", "Basic YS10b2tlbi1mb3ItdGVzdHM6", "Bearer é"]
)
def test_who_has_not_is_refused(writable, authorization: str | None) -> None:
    headers = {"Content-Type": "application/sparql-update"}
    if authorization is not None:
        headers["Authorization"] = authorization.encode()
    before = values(writable)
    response = CLIENT.post(writable.sparql, content="CLEAR ALL", headers=headers)
    assert (response.status_code, response.headers["www-authenticate"]) == (401, "Bearer")
    assert TOKEN not in response.text
    assert values(writable) == before


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("INSERT DATA {\n <http://e/s> }", "not a SPARQL update: error at 2:"),
        ("INSERT DATA { GRAPH <http://e/g> { <http://e/s> a <http://e/C> } } ; CREATE GRAPH <http://e/g>", "nothing"),
    ],
)
def test_an_update_that_fails_changes_nothing(writable, text: str, message: str) -> None:
    count = "SELECT (COUNT(*) AS ?n) { ?s ?p ?o }"
    before = writable.ask(count).content
    response = writable.update(text)
    assert (response.status_code, message in response.text) == (400, True), response.text
    assert writable.ask(count).content == before


def update_of(server, text: str, **dataset: str) -> httpx.Response:
    return CLIENT.post(server.sparql, data={"update": text} | dataset, headers={"Authorization": f"Bearer {TOKEN}"})


def test_the_dataset_of_an_update_is_what_its_patterns_are_asked_of(writable) -> None:
    facts = "".join(f"GRAPH <http://e/g{k}> {{ <http://e/of> <http://e/p> {k} }} " for k in range(3))
    assert writable.update(f"INSERT DATA {{ {facts} }}").status_code == 204
    copied = "INSERT { <http://e/copy> <http://e/p> ?o } WHERE { <http://e/of> <http://e/p> ?o }"
    assert update_of(writable, copied, **{"using-graph-uri": "http://e/g1"}).status_code == 204
    named = "INSERT { <http://e/copy> ?g ?o } WHERE { GRAPH ?g { <http://e/of> <http://e/p> ?o } }"
    assert update_of(writable, named, **{"using-named-graph-uri": "http://e/g2"}).status_code == 204
    found = writable.ask("SELECT ?p ?o { <http://e/copy> ?p ?o } ORDER BY ?o").json()["results"]["bindings"]
    assert [(row["p"]["value"], row["o"]["value"]) for row in found] == [("http://e/p", "1"), ("http://e/g2", "2")]


@pytest.mark.parametrize(
    ("text", "graph", "message"),
    [
        ("WITH <http://e/g> DELETE { ?s ?p ?o } WHERE { ?s ?p ?o }", "http://e/g", "use only one"),
        ("DELETE WHERE { ?s ?p ?o }", "no IRI", "a graph's name is no IRI"),
    ],
)
def test_a_dataset_that_cannot_be_is_refused(writable, text: str, graph: str, message: str) -> None:
    response = update_of(writable, text, **{"using-graph-uri": graph})
    assert (response.status_code, message in response.text) == (400, True), response.text


def test_rdflib_writes_through_it(writable) -> None:
    store = SPARQLUpdateStore(
        writable.sparql, writable.sparql, headers={"Authorization": f"Bearer {TOKEN}"}, context_aware=False
    )
    subject, predicate = rdflib.URIRef("http://e/rdflib"), rdflib.URIRef("http://e/p")
    graph = rdflib.Graph(store)
    graph.add((subject, predicate, rdflib.Literal('ü "quoted"\n')))
    assert list(graph.objects(subject, predicate)) == [rdflib.Literal('ü "quoted"\n')]


def test_another_process_holding_the_graph_makes_updates_wait(writable) -> None:
    with KnowledgeGraph(writable.graph):
        response = writable.update("INSERT DATA { <http://e/s> <http://e/p> 1 }")
        assert response.status_code == 503
        assert response.text == "another process is writing the graph: try again later\n"
        assert response.headers["retry-after"] == "5"
        assert writable.ask("ASK { ?s ?p ?o }").json()["boolean"] is True


WRITER = """
import sys, time
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.knowledge.store.named_graphs import in_graph
from pyoxigraph import Literal, NamedNode, Triple

with KnowledgeGraph(sys.argv[1]) as graph:
    print("open", flush=True)
    for number in range(int(sys.argv[2])):
        triples = [Triple(NamedNode(f"http://e/{i}"), NamedNode("http://e/v"), Literal(number)) for i in range(50)]
        graph.replace(in_graph(triples, "http://e/live"), "http://e/live")
        print(number, time.time(), flush=True)
        time.sleep(float(sys.argv[3]))
    sys.stdin.read()
"""
STATE = "SELECT (COUNT(*) AS ?n) (MIN(?v) AS ?low) (MAX(?v) AS ?high) { ?s <http://e/v> ?v }"


def state(server) -> tuple[int, int, int] | None:
    (row,) = server.ask(STATE).json()["results"]["bindings"]
    return (int(row["n"]["value"]), int(row["low"]["value"]), int(row["high"]["value"])) if "low" in row else None


@pytest.mark.nightly
def test_readers_see_whole_states_of_a_writer_and_the_last_within_a_second(new_graph) -> None:
    folder = new_graph()
    with serving(folder) as running:
        command = [sys.executable, "-c", WRITER, str(folder), "8", "0.2"]
        with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as writer:
            assert writer.stdout is not None and writer.stdin is not None
            assert writer.stdout.readline() == "open\n"
            seen = []
            while not (line := writer.stdout.readline()).startswith("7 "):
                assert line, "the writer ended"
                seen.append(state(running))
            written = float(line.split()[1])
            while state(running) != (50, 7, 7):
                assert time.time() - written < 30
            writer.stdin.close()
        whole = [found for found in seen if found is not None]
        assert whole and all(count == 50 and low == high for count, low, high in whole)
        assert len({high for _, _, high in whole}) > 1

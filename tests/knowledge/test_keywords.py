"""No text makes the graph ask another server or load a document; the words themselves are harmless."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Iterator
from contextlib import suppress
from random import Random
from string import ascii_lowercase

import pytest
from pyoxigraph import Store
from tests.sparql_family import Family, Listener, listener

from irtwin.errors import InputError
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.knowledge.store.keywords import refuse_service, refuse_service_and_load
from irtwin.knowledge.store.no_network import leave_network
from irtwin.knowledge.store.table import table_of
from irtwin.knowledge.vocabulary import PREFIXES

BASE = "http://e/"
SPELLINGS = " ".join(f"ser{letter}ice" for letter in ascii_lowercase)
QUERIES = (
    "SELECT * { #x\rSERVICE <URL> { ?s ?p ?o } }",
    "SELECT * { #x\r\nSERVICE <URL> { ?s ?p ?o } }",
    'SELECT * { BIND("""a\\\\""" AS ?x) SERVICE <URL> { ?s ?p ?o } BIND("""b""" AS ?y) }',
    "SELECT * { BIND('''a\\\\''' AS ?x) SERVICE <URL> { ?s ?p ?o } BIND('''b''' AS ?y) }",
    'SELECT * { BIND("" AS ?x) SERVICE <URL> { ?s ?p ?o } BIND("""b""" AS ?y) }',
    "PREFIX x: <http://e/> SELECT * { BIND(x: AS ?x) ?s ?p x:.SERVICE<URL>{ ?s ?p ?o } }",
    "PREFIX x: <http://e/> SELECT * { OPTIONAL { x: x: x: } OPTIONAL { ?s ?p x:.SERVICE<URL>{ ?s ?p ?o } } }",
    "PREFIX x: <URL> SELECT * { BIND(1 AS ?a) FILTER(?a<?b)SERVICE#>\nx:{ ?s ?p ?o } }",
    "SELECT * { SERVICE SILENT <URL> { ?s ?p ?o } }",
    "SELECT * { SERVICESILENT<URL>{ ?s ?p ?o } }",
    "PREFIX l: <URL> SELECT * { SERVICEl:{ ?s ?p ?o } }",
    "PREFIX SERVICEl: <http://e/> PREFIX l: <URL> SELECT * { SERVICEl:{ ?s ?p ?o } }",
    "PREFIX : <URL> SELECT * { ?s ?p 1 ; SERVICE:x { ?s ?p ?o } }",
    "SELECT * { ?s ?p trueSERVICE <URL> { ?s ?p ?o } }",
    "SELECT * { { SELECT * { FILTER EXISTS { SERVICE <URL> { ?s ?p ?o } } } } }",
    "ASK { SERVICE <URL> { ?s ?p ?o } }",
    "CONSTRUCT { ?s ?p ?o } { SERVICE <URL> { ?s ?p ?o } }",
    "DESCRIBE ?s { SERVICE <URL> { ?s ?p ?o } }",
    'SELECT ("service serAice serBice" AS ?x) { SERVICE <URL> { ?s ?p ?o } }',
    f"SELECT * {{ SERVICE <URL> {{ ?s ?p ?o }} }} # {SPELLINGS}",
    "SELECT * { \\u0053ERVICE <URL> { ?s ?p ?o } }",
    "SELECT * { \\U00000053ERVICE <URL> { ?s ?p ?o } }",
    "SELECT * { \u017fERVICE <URL> { ?s ?p ?o } }",
    "SELECT * { service silent <URL> { ?s ?p ?o } }",
    "PREFIX : <URL> SELECT * { SERVICE:sparql { ?s ?p ?o } }",
    "PREFIX service: <URL> SELECT * { SERVICE service:x { ?s ?p ?o } }",
    "SELECT * { BIND(1 AS ?x) ?s ?p 1SERVICE <URL> { ?s ?p ?o } }",
    "SELECT * { VALUES ?x { <URL> } SERVICE?x { ?s ?p ?o } }",
    "SELECT * { # ' \n SERVICE <URL> { ?s ?p '' } }",
    'SELECT * { BIND("\\"" AS ?q) SERVICE <URL> { ?s ?p "" } }',
    "SELECT * { BIND('''it's''' AS ?q) SERVICE <URL> { ?s ?p '' } }",
    "SELECT * { BIND(1 AS ?x) FILTER(?x<2) SERVICE <URL> { ?s ?p ?o FILTER(?o>1) } }",
)  # fmt: skip
UPDATES = (
    "#x\rLOAD <URL>",
    "LOAD<URL>",
    "load silent <URL> INTO GRAPH <http://e/g>",
    "PREFIX l: <URL> LOADl:",
    'INSERT DATA { <x:a> <x:b> """a\\\\""" } ; LOAD <URL> ; INSERT DATA { <x:a> <x:b> """b""" }',
    "INSERT { ?s ?p ?o } WHERE { #\rSERVICE <URL> { ?s ?p ?o } }",
    "DELETE WHERE { ?s ?p ?o } ; #\r LOAD <URL>",
    "PREFIX x: <http://e/> INSERT { ?s ?p ?o } WHERE { ?s ?p x:.SERVICE<URL>{ ?s ?p ?o } }",
)


@pytest.fixture
def elsewhere() -> Iterator[Listener]:
    with listener() as listening:
        yield listening


@pytest.mark.parametrize("text", QUERIES)
def test_no_query_asks_another_server(elsewhere: Listener, text: str) -> None:
    with pytest.raises(InputError):
        KnowledgeGraph().query(text.replace("URL", elsewhere.url))
    assert elsewhere.connections() == 0


@pytest.mark.parametrize("text", QUERIES)
def test_beside_a_server_that_may_be_asked_no_query_asks_another(elsewhere: Listener, text: str) -> None:
    listed = "http://e.org/sparql"
    for hidden in (
        text,
        text.replace("SERVICE", f"SERVICE<{listed}>{{}}SERVICE"),
        text.replace("URL", f"URL#<{listed}>"),
    ):
        with pytest.raises(InputError):
            KnowledgeGraph().answer(hidden.replace("URL", elsewhere.url), services=[listed])
    assert elsewhere.connections() == 0


@pytest.mark.parametrize(
    "clause",
    ["SERVICE <URL>", "service\tSilent\r\n<URL>", "SERVICE<URL>{} # SERVICE <http://e.org/>\n SERVICE SILENT<URL>"],
)
def test_a_server_that_may_be_asked_is_asked(elsewhere: Listener, clause: str) -> None:
    query = f"ASK {{ {clause.replace('URL', elsewhere.url)} {{ ?s ?p 'SERVICE <http://e.org/>' }} }}"
    with suppress(OSError):
        KnowledgeGraph().answer(query, services=["http://e.org/sparql", elsewhere.url])
    assert elsewhere.connections() > 0


@pytest.mark.parametrize("text", UPDATES)
def test_no_update_reads_from_elsewhere(elsewhere: Listener, text: str) -> None:
    with pytest.raises(InputError, match="LOAD and SERVICE read from elsewhere"):
        KnowledgeGraph().update(text.replace("URL", elsewhere.url))
    assert elsewhere.connections() == 0


@pytest.mark.parametrize(
    "text",
    [
        "SELECT (1 AS ?service) (2 AS ?serwice) (3 AS ?SERVICE) {}",
        "SELECT ('''it's a \\\\SERVICE''' AS ?x) (\"SERVICE\" AS ?y) {}",
        "SELECT * { ?s ?p ?o } # SERVICE <http://e/>",
        "SELECT * { ?s ?p ?o } #\rORDER BY ?service",
        "PREFIX service: <http://e/service> SELECT (service:SERVICE AS ?x) {}",
        "PREFIX SERVICE: <http://e/> SELECT * { SERVICE:a ?p SERVICE:b }",
        "PREFIX x: <http://e/service#> SELECT * { x:a.SERVICE ?p x:SERVICE, x:Customer_Service }",
        "SELECT ('a'@service AS ?x) (<service:a> AS ?y) (1 AS ?z) { _:SERVICE ?p 1 FILTER(?p<?service) }",
        "SELECT ('a'^^<http://e/%73ervice> AS ?x) {}",
        "ASK { FILTER(STRLEN('service \\u0022 SERVICE') = 17) }",
    ],
)
def test_a_query_may_hold_the_word(text: str) -> None:
    with_word, without = KnowledgeGraph().query(text), KnowledgeGraph().query(text.replace("ervic", "erbic"))
    assert len(with_word) == len(without)


@pytest.mark.parametrize(
    "text",
    [
        "INSERT DATA { <http://e/load> <http://e/service> 'LOAD SERVICE' } # LOAD <http://e/>",
        "PREFIX load: <http://e/> INSERT DATA { load:load load:service load:a }",
        "INSERT { <x:a> <x:load> ?load } WHERE { BIND(1 AS ?load) FILTER(1<?load || true) #\rFILTER(?load = 1) }",
    ],
)
def test_an_update_may_hold_the_words(text: str) -> None:
    graph = KnowledgeGraph()
    graph.update(text)
    assert len(graph.triples()) == 1


@pytest.mark.parametrize("count", [300, pytest.param(10_000, marks=[pytest.mark.slow, pytest.mark.nightly])])
def test_a_family_of_texts_leaves_no_connection(elsewhere: Listener, count: int) -> None:
    graph = KnowledgeGraph()
    refused = 0
    for seed in range(count // 2):
        hostile = Family(seed, elsewhere.url)
        for ask, text in ((graph.query, hostile.query()), (graph.update, hostile.update())):
            try:
                ask(text)
            except InputError:
                refused += 1
    assert elsewhere.connections() == 0
    assert refused > 0.75 * count  # the others hold no such clause, or one in a comment


@pytest.mark.parametrize("count", [300, pytest.param(10_000, marks=[pytest.mark.slow, pytest.mark.nightly])])
def test_a_family_of_texts_asks_the_server_that_it_may_alone(elsewhere: Listener, count: int) -> None:
    graph, asked = KnowledgeGraph(), 0
    with listener() as other:
        for seed in range(count):
            text = Family(seed, elsewhere.url).query()
            changed = _with_listed(text, other.url, Random(seed))
            for form, services in ((changed, [other.url]), (text, [elsewhere.url])):
                before = elsewhere.connections()
                with suppress(InputError, OSError, RuntimeError):
                    table_of(graph.answer(form, services=services))
                came = elsewhere.connections() - before
                assert came == 0 or services == [elsewhere.url]
                asked += came
    assert asked > 0.1 * count


def _with_listed(text: str, url: str, chance: Random) -> str:
    first, *others = text.split("SERVICE")
    forms = ("SERVICE", f"SERVICE <{url}>", f"SERVICE <{url}>{{}}SERVICE", f"<{url}>SERVICE")
    return first + "".join(chance.choice(forms) + other for other in others)


@pytest.mark.parametrize("count", [300, pytest.param(10_000, marks=[pytest.mark.slow, pytest.mark.nightly])])
def test_a_family_of_harmless_texts_is_let_through(count: int) -> None:
    understood = 0
    for seed in range(count // 2):
        query, update = Family(seed, None).query(), Family(seed, None).update()
        for ask, check, text in (
            (Store().query, refuse_service, query),
            (Store().update, refuse_service_and_load, update),
        ):
            try:
                ask(text, base_iri=BASE, prefixes=PREFIXES)
            except SyntaxError:
                continue
            check(text, BASE)
            understood += 1
    assert understood > 0.8 * count


UNCHECKED = """
import json, sys
from pyoxigraph import Store
from irtwin.knowledge.store.no_network import leave_network

if json.loads(sys.argv[1]):
    assert leave_network()
for kind, text in json.load(sys.stdin):
    try:
        found = Store().query(text) if kind == "query" else Store().update(text)
        list(found or ())
    except (SyntaxError, OSError, RuntimeError, TypeError):
        pass
"""


@pytest.mark.skipif(sys.platform != "linux", reason="the kernel's filter is Linux'")
def test_without_a_network_the_store_alone_reaches_nobody(elsewhere: Listener) -> None:
    texts = [("query", Family(seed, elsewhere.url).query()) for seed in range(100)]
    texts += [("update", Family(seed, elsewhere.url).update()) for seed in range(100)]
    texts += [("query", text.replace("URL", elsewhere.url)) for text in QUERIES]

    def run(without_network: bool) -> int:
        before = elsewhere.connections()
        arguments = [sys.executable, "-c", UNCHECKED, json.dumps(without_network)]
        subprocess.run(arguments, input=json.dumps(texts), text=True, check=True)
        return elsewhere.connections() - before

    assert run(without_network=True) == 0
    assert run(without_network=False) > 50  # so the texts are what they are meant to be


def test_a_system_without_the_filter_is_told_apart(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("platform.machine", lambda: "s390x")
    assert not leave_network()


def test_a_server_may_read_escapes_before_all_else() -> None:
    hidden = "SELECT ('\\u0027) { \\u0053ERVICE <http://e/> { ?s ?p ?o } } #' AS ?x) {}"
    closed = "SELECT ('\\u0027 AS ?x) { SERVICE <http://e/> { ?s ?p ?o } } #' AS ?x) {}"
    for text in (hidden, closed):
        refuse_service(text, BASE)
        with pytest.raises(InputError, match="SERVICE asks another server"):
            refuse_service(text, BASE, code_points_first=True)

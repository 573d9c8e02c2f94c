"""Queries that are broken, reach out, or ask for too much, sent to a real endpoint with little time and memory."""

from __future__ import annotations

import time
from collections.abc import Iterator

import psutil
import pytest
from tests.endpoint import Server, make_graph, serving

pytestmark = pytest.mark.slow

SECONDS, MEGABYTES = 2, 128
GOOD = (
    "PREFIX e: <http://e/> SELECT DISTINCT ?a (SUM(?v) AS ?n) WHERE { ?a a e:C ; e:p ?v . "
    'OPTIONAL { ?a e:q "x"@en } FILTER(?v > 1) { SELECT ?a { ?a ?b ?c } } } GROUP BY ?a HAVING (?n > 1) ORDER BY ?a'
)
CUT_OFF = [GOOD[:end] for end in range(3, GOOD.index("} GROUP") + 1, 9)]  # each misses at least one bracket
MALFORMED = {
    "nothing": "",
    "a null byte": "SELECT * { ?s ?p ?o }\0",
    "binary": "\x01\x02\x7f" * 1000,
    "another language": "SELECT * FROM person; DROP TABLE person",
    "an update": "INSERT DATA { <http://e/a> <http://e/p> 1 }",
    "two queries": "ASK {} ASK {}",
    "open text": 'ASK { ?s ?p "x }',
    "open IRI": "ASK { ?s ?p <http://e/ }",
    "no IRI": "ASK { ?s ?p <http://e/{}> }",
    "unknown prefix": "ASK { ?s nobody:p ?o }",
    "literal as property": 'ASK { ?s "p" ?o }',
    "negative limit": "SELECT * {} LIMIT -1",
    "limit beyond integers": f"SELECT * {{}} LIMIT {'9' * 5000}",
    "aggregate in a filter": "SELECT * { ?s ?p ?o FILTER(SUM(?o) > 1) }",
    "ungrouped variable": "SELECT ?s (COUNT(?o) AS ?n) { ?s ?p ?o }",
    "variable twice": "SELECT (1 AS ?x) (2 AS ?x) {}",
    "unknown function": "SELECT (<http://e/f>(1) AS ?x) {}",
    "load": "LOAD <file:///etc/passwd>",
    "service": "SELECT * { SERVICE <http://127.0.0.1:1/> { ?s ?p ?o } }",
}
DEEP = {
    "open groups": "ASK " + "{" * 100_000,
    "groups": "ASK " + "{" * 50_000 + "}" * 50_000,
    "brackets": "ASK { FILTER(" + "(" * 50_000 + "1" + ")" * 50_000 + ") }",
    "negations": "ASK { FILTER(" + "!" * 50_000 + "1) }",
    "optionals": "ASK { " + "?s ?p ?o OPTIONAL { " * 20_000 + "}" * 20_000 + "}",
    "unions": "ASK { " + "{ ?s ?p ?o } UNION " * 20_000 + "{} }",
    "sums": "SELECT (" + "1+" * 50_000 + "1 AS ?x) {}",
    "paths": "ASK { ?s " + "(" * 100_000 + "<http://e/p>" + ")" * 100_000 + " ?o }",
    "subqueries": "ASK { " + "{ SELECT * { " * 20_000 + "} }" * 20_000 + "}",
}
TOO_MUCH = {
    "product": "SELECT (COUNT(*) AS ?n) { ?a ?b ?c . ?d ?e ?f . ?g ?h ?i }",
    "sorted pairs": "SELECT * { ?a ?b ?c . ?d ?e ?f } ORDER BY ?c ?f",
    "distinct pairs": "SELECT DISTINCT ?a ?c ?d ?f { ?a ?b ?c . ?d ?e ?f } ORDER BY ?a LIMIT 1",
    "groups of pairs": "SELECT ?a ?d (COUNT(*) AS ?n) { ?a ?b ?c . ?d ?e ?f } GROUP BY ?a ?d ?f ORDER BY ?n LIMIT 1",
    "all paths": "SELECT (COUNT(*) AS ?n) { ?a (!<http://e/x>|^!<http://e/x>)* ?b . ?c (!<http://e/x>)* ?d }",
    "long sequence": "ASK { ?s " + "<http://e/p>/" * 2000 + "<http://e/p> ?o }",
    "many triples": "ASK { " + "?s ?p ?o . " * 2000 + "}",
    "text that doubles": "SELECT (STRLEN(?z) AS ?n) { BIND('xxxxxxxxxxxxxxxx' AS ?a0) "
    + " ".join(f"BIND(CONCAT({', '.join([f'?a{n}'] * 16)}) AS ?a{n + 1})" for n in range(7))
    + " BIND(?a7 AS ?z) }",
    "slow pattern": "SELECT (COUNT(*) AS ?n) { ?a ?b ?c . ?d ?e ?f "
    "FILTER(REGEX(CONCAT(STR(?a), STR(?f)), '(.*)*x(.*)*y')) }",
}


@pytest.fixture(scope="module")
def small(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    folder = make_graph(tmp_path_factory.mktemp("workspace"))
    with serving(folder, "--timeout", SECONDS, "--memory", MEGABYTES, token=None) as running:
        yield running


def refused(server: Server, query: str, *statuses: int) -> str:
    began = time.monotonic()
    response = server.ask(query)
    assert response.status_code in statuses, response.text[:300]
    assert time.monotonic() - began < 10 * SECONDS
    for pid in server.workers():
        assert psutil.Process(pid).memory_info().rss < (MEGABYTES + 250) << 20
    assert 0 < len(response.text) < 20_000
    assert "Traceback" not in response.text
    return response.text


@pytest.mark.parametrize("query", CUT_OFF, ids=len)
def test_cut_off(small: Server, query: str) -> None:
    assert "not a SPARQL query: error at 1:" in refused(small, query, 400)


@pytest.mark.parametrize("name", MALFORMED)
def test_malformed(small: Server, name: str) -> None:
    said = refused(small, MALFORMED[name], 400)
    assert any(part in said for part in ("not a SPARQL query: error at ", "SERVICE asks another", "function")), said


@pytest.mark.parametrize("name", DEEP)
def test_deep(small: Server, name: str) -> None:
    assert refused(small, DEEP[name], 400) == "the query is nested too deeply, or too long, to be read\n"


BY_DAY = ("product", "sorted pairs", "long sequence", "text that doubles")  # time, memory, and texts that grow


@pytest.mark.slow
@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=() if name in BY_DAY else pytest.mark.nightly) for name in TOO_MUCH]
)
def test_too_much(small: Server, name: str) -> None:
    said = refused(small, TOO_MUCH[name], 503)
    assert said.startswith(
        (f"the query was cancelled after {SECONDS} s", "the query needs more than 128 MB of memory")
    ), said


def test_the_server_is_well_after_all_that(small: Server) -> None:
    assert small.ask("ASK { ?s ?p ?o }").json()["boolean"] is True

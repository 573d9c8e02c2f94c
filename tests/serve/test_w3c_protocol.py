"""The 34 tests of the W3C's SPARQL 1.1 Protocol suite, by their names there.

As there, but for three things: updates carry the token; `query_multiple_dataset` names two graphs, where the manifest
writes them as one by an `&` too much escaped; and the graph that `update_base_uri` clears is there.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any
from urllib.parse import quote

import httpx
import pytest
from tests.endpoint import CLIENT, TOKEN, Server, serving

pytestmark = pytest.mark.slow

DATA = "http://kasei.us/2009/09/sparql/data/data"
FORM, QUERY, UPDATE = "application/x-www-form-urlencoded", "application/sparql-query", "application/sparql-update"
DOCUMENT, RESOURCE = "http://xmlns.com/foaf/0.1/Document", "http://purl.org/dc/terms/BibliographicResource"
DATA0, DATA1, DATA2, DATA3 = (f"{DATA}{number}.rdf" for number in range(4))
ALL_DATA = " ".join(f"GRAPH <{name}> {{ <{name}> a <{DOCUMENT}> }}" for name in (DATA1, DATA2, DATA3))
PREFIXES = "PREFIX dc: <http://purl.org/dc/terms/>\nPREFIX foaf: <http://xmlns.com/foaf/0.1/>\n"
IN_NAMED = f"GRAPH ?g1 {{ <{DATA1}> a ?type }} GRAPH ?g2 {{ <{DATA2}> a ?type }}"
BOTH = f"ASK {{ <{DATA1}> a ?type . <{DATA2}> a ?type . }}"
BOTH_NAMED = f"ASK {{ {IN_NAMED} }}"
FULL = f"ASK {{\n  <{DATA3}> a ?type\n  {IN_NAMED}\n}}"
EMPTY = "query=ASK%20%7B%7D"


@pytest.fixture(scope="module")
def w3c(new_graph: Callable[[], Path]) -> Iterator[Server]:
    """A server of the suite's data; updates that are done come last, for each takes a second, and none is put back."""
    with serving(new_graph()) as running:
        done = running.update(f"CLEAR ALL ; INSERT DATA {{ {ALL_DATA} }}")
        assert done.status_code == 204, done.text
        yield running


def send(server: Server, method: str, parameters: str = "", kind: str | None = None, body: bytes | str = ""):
    headers = {"Authorization": f"Bearer {TOKEN}", **({"Content-Type": kind} if kind else {})}
    return CLIENT.request(method, f"{server.sparql}?{parameters}", content=body, headers=headers)


def graphs(**chosen: list[str]) -> str:
    """Return the parameters that choose graphs: default, named, using or using_named."""
    return "&".join(
        f"{name.replace('_', '-')}-graph-uri={quote(iri, safe='')}" for name, iris in chosen.items() for iri in iris
    )


def is_true(response: httpx.Response) -> bool:
    assert response.status_code == 200, response.text
    return response.json()["boolean"] is True


def by_name(cases: dict[str, tuple[Any, ...]], arguments: str) -> pytest.MarkDecorator:
    return pytest.mark.parametrize(arguments, cases.values(), ids=cases)


ANSWERED = {
    "query_post_form": ("POST", graphs(default=[DATA0]), FORM, EMPTY),
    "query_get": ("GET", f"{EMPTY}&{graphs(default=[DATA0])}", None, ""),
    "query_post_direct": ("POST", "", QUERY, "ASK {}"),
    "query_dataset_default_graphs_get": ("GET", f"query={quote(BOTH)}&{graphs(default=[DATA1, DATA2])}", None, ""),
    "query_dataset_default_graphs_post": ("POST", graphs(default=[DATA1, DATA2]), QUERY, BOTH),
    "query_dataset_named_graphs_get": ("GET", f"query={quote(BOTH_NAMED)}&{graphs(named=[DATA1, DATA2])}", None, ""),
    "query_dataset_named_graphs_post": ("POST", graphs(named=[DATA1, DATA2]), QUERY, BOTH_NAMED),
    "query_dataset_full": ("POST", graphs(default=[DATA3], named=[DATA1, DATA2]), QUERY, FULL),
    "query_multiple_dataset": ("POST", graphs(named=[DATA1, DATA2]), QUERY, f"ASK FROM <{DATA3}> {{ {IN_NAMED} }}"),
}


@by_name(ANSWERED, "method, parameters, kind, body")
def test_a_query_is_answered(w3c: Server, method: str, parameters: str, kind: str | None, body: str) -> None:
    assert is_true(send(w3c, method, parameters, kind, body))


KINDS = {
    "query_content_type_select": ("SELECT (1 AS ?value) {}", ("sparql-results", "csv", "separated")),
    "query_content_type_ask": ("ASK {}", ("sparql-results",)),
    "query_content_type_describe": ("DESCRIBE <http://example.org/>", ("rdf+", "turtle")),
    "query_content_type_construct": ("CONSTRUCT { <s> <p> 1 } WHERE {}", ("rdf+", "turtle")),
}


@by_name(KINDS, "query, kinds")
def test_the_answer_has_a_fitting_type(w3c: Server, query: str, kinds: tuple[str, ...]) -> None:
    response = send(w3c, "POST", graphs(default=[DATA0]), QUERY, query)
    assert response.status_code == 200
    assert any(kind in response.headers["content-type"] for kind in kinds)


CONFLICT = """PREFIX foaf:  <http://xmlns.com/foaf/0.1/>
WITH <http://example/addresses>
DELETE { ?person foaf:givenName 'Bill' }
INSERT { ?person foaf:givenName 'William' }
WHERE {
    ?person foaf:givenName 'Bill'
}"""
REFUSED = {
    "bad_query_method": ("PUT", f"{EMPTY}&{graphs(default=[DATA0])}", FORM, ""),
    "bad_multiple_queries": ("GET", f"{EMPTY}&query=SELECT%20%2A%20%7B%7D", None, ""),
    "bad_query_wrong_media_type": ("POST", "", "text/plain", "ASK {}"),
    "bad_query_missing_form_type": ("POST", "", None, EMPTY),
    "bad_query_missing_direct_type": ("POST", "", None, "ASK {}"),
    "bad_query_non_utf8": ("POST", "", f"{QUERY}; charset=UTF-16", "ASK {}".encode("utf-16")),
    "bad_query_syntax": ("GET", "query=ASK%20%7B", None, ""),
    "bad_update_get": ("GET", "update=CLEAR%20ALL", None, ""),
    "bad_multiple_updates": ("POST", "", FORM, "update=CLEAR%20NAMED&update=CLEAR%20DEFAULT"),
    "bad_update_wrong_media_type": ("POST", "", "text/plain", "CLEAR NAMED"),
    "bad_update_missing_form_type": ("POST", "", None, "update=CLEAR%20NAMED"),
    "bad_update_non_utf8": ("POST", "", f"{UPDATE}; charset=UTF-16", "CLEAR NAMED".encode("utf-16")),
    "bad_update_syntax": ("POST", "", FORM, "update=CLEAR%20XYZ"),
    "bad_update_dataset_conflict": ("POST", graphs(using_named=["http://example/people"]), UPDATE, CONFLICT),
}


@by_name(REFUSED, "method, parameters, kind, body")
def test_what_breaks_the_protocol_is_refused(w3c: Server, method: str, parameters: str, kind, body) -> None:
    assert 400 <= send(w3c, method, parameters, kind, body).status_code < 500
    assert is_true(send(w3c, "POST", "", QUERY, f"ASK {{ <{DATA1}> a <{DOCUMENT}> }}"))  # nothing was done


def update_of(pattern: str = "?s a foaf:Document", what: str = "a dc:BibliographicResource") -> str:
    return f"""{PREFIXES}DROP ALL ;
INSERT DATA {{ {ALL_DATA} }} ;
INSERT {{ GRAPH <{PLACE}> {{ ?s {what} }} }}
WHERE {{ {pattern} }}"""


PLACE = "http://example.org/protocol-update-dataset-test/"
IS_RESOURCE = {name: f"GRAPH <{PLACE}> {{ <{name}> a <{RESOURCE}> }}" for name in (DATA1, DATA2, DATA3)}
TWO_OF_THREE = f"ASK {{ {IS_RESOURCE[DATA1]} {IS_RESOURCE[DATA2]} FILTER NOT EXISTS {{ {IS_RESOURCE[DATA3]} }} }}"
ONE = f"""{PREFIXES}CLEAR ALL ;
INSERT DATA {{ GRAPH <{DATA1}> {{ <{DATA1}> a foaf:Document }} }} ;
INSERT {{ GRAPH <{PLACE}> {{ ?s a dc:BibliographicResource }} }}
WHERE {{ ?s a foaf:Document }}"""
IN_NAMED_ONES, SAYS_WHICH = "GRAPH ?g { ?s a foaf:Document }", "<http://example.org/in> ?in"
IN_ANY = """{ GRAPH ?g { ?s a foaf:Document } BIND(?g AS ?in) }
UNION { ?s a foaf:Document . BIND("default" AS ?in) }"""
IN_BOTH = f"""ASK {{
  GRAPH <{PLACE}> {{
    <{DATA1}> <http://example.org/in> "default" .
    <{DATA2}> <http://example.org/in> <{DATA2}> .
  }}
  FILTER NOT EXISTS {{ GRAPH <{PLACE}> {{ <{DATA3}> ?p ?o }} }}
}}"""
OF_DATASET = {
    "update_dataset_default_graph": (graphs(using=[DATA1]), ONE, f"ASK {{ {IS_RESOURCE[DATA1]} }}"),
    "update_dataset_default_graphs": (graphs(using=[DATA1, DATA2]), update_of(), TWO_OF_THREE),
    "update_dataset_named_graphs": (graphs(using_named=[DATA1, DATA2]), update_of(IN_NAMED_ONES), TWO_OF_THREE),
    "update_dataset_full": (graphs(using=[DATA1], using_named=[DATA2]), update_of(IN_ANY, SAYS_WHICH), IN_BOTH),
}


@by_name(OF_DATASET, "parameters, update, then")
def test_an_update_asks_the_graphs_of_its_request(w3c: Server, parameters: str, update: str, then: str) -> None:
    response = send(w3c, "POST", parameters, UPDATE, update)
    assert response.status_code == 204, response.text
    assert is_true(send(w3c, "POST", "", QUERY, then))


@by_name({"update_post_form": (FORM, "update=CLEAR+ALL"), "update_post_direct": (UPDATE, "CLEAR ALL")}, "kind, body")
def test_an_update_is_done(w3c: Server, kind: str, body: str) -> None:
    assert send(w3c, "POST", "", kind, body).status_code == 204
    assert not is_true(send(w3c, "POST", "", QUERY, "ASK { ?s ?p ?o }"))


def test_update_base_uri(w3c: Server) -> None:
    place = "http://example.org/protocol-base-test/"
    assert w3c.update(f"CREATE SILENT GRAPH <{place}>").status_code == 204
    said = "<http://example.org/s> <http://example.org/p> <test>"
    update = f"CLEAR GRAPH <{place}> ;\nINSERT DATA {{ GRAPH <{place}> {{ {said} }} }}"
    assert send(w3c, "POST", "", UPDATE, update).status_code == 204
    query = f"SELECT ?o WHERE {{ GRAPH <{place}> {{ <http://example.org/s> <http://example.org/p> ?o }} }}"
    (row,) = send(w3c, "POST", "", QUERY, query).json()["results"]["bindings"]
    assert row["o"] == {"type": "uri", "value": f"{w3c.url}/test"}

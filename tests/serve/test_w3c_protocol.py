"""The 34 tests of the W3C's SPARQL 1.1 Protocol suite, by their names there.

As there, but for three things: updates carry the token; `query_multiple_dataset` names two graphs, where the manifest
writes them as one by an `&` too much escaped; and the graph that `update_base_uri` clears is there.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from urllib.parse import quote

import httpx
import pytest
from tests.endpoint import CLIENT, TOKEN, Server

pytestmark = pytest.mark.slow

DATA = "http://kasei.us/2009/09/sparql/data/data"
FORM, QUERY, UPDATE = "application/x-www-form-urlencoded", "application/sparql-query", "application/sparql-update"
DOCUMENT, RESOURCE = "http://xmlns.com/foaf/0.1/Document", "http://purl.org/dc/terms/BibliographicResource"
DATA0, DATA1, DATA2, DATA3 = (f"{DATA}{number}.rdf" for number in range(4))
ALL_DATA = " ".join(f"GRAPH <{name}> {{ <{name}> a <{DOCUMENT}> }}" for name in (DATA1, DATA2, DATA3))
PREFIXES = "PREFIX dc: <http://purl.org/dc/terms/>\nPREFIX foaf: <http://xmlns.com/foaf/0.1/>\n"
BOTH_NAMED = f"GRAPH ?g1 {{ <{DATA1}> a ?type }} GRAPH ?g2 {{ <{DATA2}> a ?type }}"
BOTH = f"ASK {{ <{DATA1}> a ?type . <{DATA2}> a ?type . }}"


@pytest.fixture(scope="module")
def w3c(new_graph: Callable[[], Path], start) -> Iterator[Server]:
    """A server of the suite's data; updates that are done come last, for each takes a second, and none is put back."""
    with start(new_graph()) as running:
        done = running.update(f"CLEAR ALL ; INSERT DATA {{ {ALL_DATA} }}")
        assert done.status_code == 204, done.text
        yield running


def send(server: Server, method: str, parameters: str = "", kind: str | None = None, body: bytes | str = ""):
    headers = {"Authorization": f"Bearer {TOKEN}", **({"Content-Type": kind} if kind else {})}
    return CLIENT.request(method, f"{server.sparql}?{parameters}", content=body, headers=headers)


def chosen(**graphs: list[str]) -> str:
    return "&".join(
        f"{name.replace('_', '-')}-uri={quote(iri, safe='')}" for name, iris in graphs.items() for iri in iris
    )


def is_true(response: httpx.Response) -> bool:
    assert response.status_code == 200, response.text
    return response.json()["boolean"] is True


@pytest.mark.parametrize(
    ("method", "parameters", "kind", "body"),
    [
        pytest.param("POST", chosen(default_graph=[DATA0]), FORM, "query=ASK%20%7B%7D", id="query_post_form"),
        pytest.param("GET", f"query=ASK%20%7B%7D&{chosen(default_graph=[DATA0])}", None, "", id="query_get"),
        pytest.param("POST", "", QUERY, "ASK {}", id="query_post_direct"),
        pytest.param(
            "GET",
            f"query={quote(BOTH)}&{chosen(default_graph=[DATA1, DATA2])}",
            None,
            "",
            id="query_dataset_default_graphs_get",
        ),
        pytest.param("POST", chosen(default_graph=[DATA1, DATA2]), QUERY, BOTH, id="query_dataset_default_graphs_post"),
        pytest.param(
            "GET",
            f"query={quote(f'ASK {{ {BOTH_NAMED} }}')}&{chosen(named_graph=[DATA1, DATA2])}",
            None,
            "",
            id="query_dataset_named_graphs_get",
        ),
        pytest.param(
            "POST",
            chosen(named_graph=[DATA1, DATA2]),
            QUERY,
            f"ASK {{ {BOTH_NAMED} }}",
            id="query_dataset_named_graphs_post",
        ),
        pytest.param(
            "POST",
            chosen(default_graph=[DATA3], named_graph=[DATA1, DATA2]),
            QUERY,
            f"ASK {{\n  <{DATA3}> a ?type\n  {BOTH_NAMED}\n}}",
            id="query_dataset_full",
        ),
        pytest.param(
            "POST",
            chosen(named_graph=[DATA1, DATA2]),
            QUERY,
            f"ASK FROM <{DATA3}> {{ {BOTH_NAMED} }}",
            id="query_multiple_dataset",
        ),
    ],
)
def test_a_query_is_answered(w3c: Server, method: str, parameters: str, kind: str | None, body: str) -> None:
    assert is_true(send(w3c, method, parameters, kind, body))


@pytest.mark.parametrize(
    ("query", "kinds"),
    [
        pytest.param("SELECT (1 AS ?value) {}", ("sparql-results", "csv", "separated"), id="query_content_type_select"),
        pytest.param("ASK {}", ("sparql-results",), id="query_content_type_ask"),
        pytest.param("DESCRIBE <http://example.org/>", ("rdf+", "turtle"), id="query_content_type_describe"),
        pytest.param("CONSTRUCT { <s> <p> 1 } WHERE {}", ("rdf+", "turtle"), id="query_content_type_construct"),
    ],
)
def test_the_answer_has_a_fitting_type(w3c: Server, query: str, kinds: tuple[str, ...]) -> None:
    response = send(w3c, "POST", chosen(default_graph=[DATA0]), QUERY, query)
    assert response.status_code == 200
    assert any(kind in response.headers["content-type"] for kind in kinds)


@pytest.mark.parametrize(
    ("method", "parameters", "kind", "body"),
    [
        pytest.param("PUT", f"query=ASK%20%7B%7D&{chosen(default_graph=[DATA0])}", FORM, "", id="bad_query_method"),
        pytest.param("GET", "query=ASK%20%7B%7D&query=SELECT%20%2A%20%7B%7D", None, "", id="bad_multiple_queries"),
        pytest.param("POST", "", "text/plain", "ASK {}", id="bad_query_wrong_media_type"),
        pytest.param("POST", "", None, "query=ASK%20%7B%7D", id="bad_query_missing_form_type"),
        pytest.param("POST", "", None, "ASK {}", id="bad_query_missing_direct_type"),
        pytest.param("POST", "", f"{QUERY}; charset=UTF-16", "ASK {}".encode("utf-16"), id="bad_query_non_utf8"),
        pytest.param("GET", "query=ASK%20%7B", None, "", id="bad_query_syntax"),
        pytest.param("GET", "update=CLEAR%20ALL", None, "", id="bad_update_get"),
        pytest.param("POST", "", FORM, "update=CLEAR%20NAMED&update=CLEAR%20DEFAULT", id="bad_multiple_updates"),
        pytest.param("POST", "", "text/plain", "CLEAR NAMED", id="bad_update_wrong_media_type"),
        pytest.param("POST", "", None, "update=CLEAR%20NAMED", id="bad_update_missing_form_type"),
        pytest.param("POST", "", f"{UPDATE}; charset=UTF-16", "CLEAR NAMED".encode("utf-16"), id="bad_update_non_utf8"),
        pytest.param("POST", "", FORM, "update=CLEAR%20XYZ", id="bad_update_syntax"),
        pytest.param(
            "POST",
            chosen(using_named_graph=["http://example/people"]),
            UPDATE,
            "PREFIX foaf:  <http://xmlns.com/foaf/0.1/>\nWITH <http://example/addresses>\n"
            "DELETE { ?person foaf:givenName 'Bill' }\nINSERT { ?person foaf:givenName 'William' }\n"
            "WHERE {\n    ?person foaf:givenName 'Bill'\n}",
            id="bad_update_dataset_conflict",
        ),
    ],
)
def test_what_breaks_the_protocol_is_refused(w3c: Server, method: str, parameters: str, kind, body) -> None:
    assert 400 <= send(w3c, method, parameters, kind, body).status_code < 500
    assert is_true(send(w3c, "POST", "", QUERY, f"ASK {{ <{DATA1}> a <{DOCUMENT}> }}"))  # nothing was done


def update_of(place: str, pattern: str = "?s a foaf:Document", what: str = "a dc:BibliographicResource") -> str:
    return f"""{PREFIXES}DROP ALL ;
INSERT DATA {{ {ALL_DATA} }} ;
INSERT {{ GRAPH <{place}> {{ ?s {what} }} }}
WHERE {{ {pattern} }}"""


PLACE = "http://example.org/protocol-update-dataset-test/"
IS_RESOURCE = {name: f"GRAPH <{PLACE}> {{ <{name}> a <{RESOURCE}> }}" for name in (DATA1, DATA2, DATA3)}
TWO_OF_THREE = f"ASK {{ {IS_RESOURCE[DATA1]} {IS_RESOURCE[DATA2]} FILTER NOT EXISTS {{ {IS_RESOURCE[DATA3]} }} }}"


@pytest.mark.parametrize(
    ("parameters", "update", "then"),
    [
        pytest.param(
            chosen(using_graph=[DATA1]),
            f"{PREFIXES}CLEAR ALL ;\nINSERT DATA {{ GRAPH <{DATA1}> {{ <{DATA1}> a foaf:Document }} }} ;\n"
            f"INSERT {{ GRAPH <{PLACE}> {{ ?s a dc:BibliographicResource }} }}\nWHERE {{ ?s a foaf:Document }}",
            f"ASK {{ {IS_RESOURCE[DATA1]} }}",
            id="update_dataset_default_graph",
        ),
        pytest.param(
            chosen(using_graph=[DATA1, DATA2]), update_of(PLACE), TWO_OF_THREE, id="update_dataset_default_graphs"
        ),
        pytest.param(
            chosen(using_named_graph=[DATA1, DATA2]),
            update_of(PLACE, "GRAPH ?g { ?s a foaf:Document }"),
            TWO_OF_THREE,
            id="update_dataset_named_graphs",
        ),
        pytest.param(
            chosen(using_graph=[DATA1], using_named_graph=[DATA2]),
            update_of(
                PLACE,
                "{ GRAPH ?g { ?s a foaf:Document } BIND(?g AS ?in) } "
                'UNION { ?s a foaf:Document . BIND("default" AS ?in) }',
                "<http://example.org/in> ?in",
            ),
            f"""ASK {{
              GRAPH <{PLACE}> {{
                <{DATA1}> <http://example.org/in> "default" .
                <{DATA2}> <http://example.org/in> <{DATA2}> .
              }}
              FILTER NOT EXISTS {{ GRAPH <{PLACE}> {{ <{DATA3}> ?p ?o }} }}
            }}""",
            id="update_dataset_full",
        ),
    ],
)
def test_an_update_asks_the_graphs_of_its_request(w3c: Server, parameters: str, update: str, then: str) -> None:
    response = send(w3c, "POST", parameters, UPDATE, update)
    assert response.status_code == 204, response.text
    assert is_true(send(w3c, "POST", "", QUERY, then))


@pytest.mark.parametrize(
    ("kind", "body"),
    [
        pytest.param(FORM, "update=CLEAR+ALL", id="update_post_form"),
        pytest.param(UPDATE, "CLEAR ALL", id="update_post_direct"),
    ],
)
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

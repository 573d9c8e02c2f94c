"""What clients of all kinds may count on: packed answers, ETags, chosen origins, and graphs by their names."""

from __future__ import annotations

import pytest
from tests.endpoint import CLIENT, serving

pytestmark = pytest.mark.slow

FEW = {"query": "SELECT ?robot { ?robot a irt:Industrial_Robot } ORDER BY ?robot"}
SITE = "https://desk.example"


@pytest.fixture(scope="module")
def welcoming(new_graph):
    with serving(new_graph(), "--allow-origin", SITE, token=None) as running:
        yield running


def test_an_answer_that_is_known_is_not_sent_again(welcoming) -> None:
    first = CLIENT.get(welcoming.sparql, params=FEW)
    again = CLIENT.get(welcoming.sparql, params=FEW, headers={"If-None-Match": first.headers["etag"]})
    assert (first.status_code, again.status_code, again.content) == (200, 304, b"")
    other = CLIENT.get(welcoming.sparql, params=FEW, headers={"If-None-Match": 'W/"x"'})
    assert (other.status_code, other.content) == (200, first.content)


def test_a_large_answer_that_is_known_is_not_sent_again(welcoming) -> None:
    everything, lines = {"default": ""}, {"Accept": "application/n-triples"}
    first = CLIENT.get(welcoming.sparql, params=everything, headers=lines)
    known = {"If-None-Match": first.headers["etag"]}
    again = CLIENT.get(welcoming.sparql, params=everything, headers=lines | known)
    assert len(first.content) > 1 << 20 and (again.status_code, again.content) == (304, b"")
    other = CLIENT.get(welcoming.sparql, params={"query": "SELECT * { ?s ?p ?o }"})
    assert other.headers["etag"] != first.headers["etag"]
    by_chance = CLIENT.get(welcoming.sparql, params={"query": "SELECT ?s ?p ?o (RAND() AS ?r) { ?s ?p ?o }"})
    assert len(by_chance.content) > 1 << 20 and "etag" not in by_chance.headers


def test_large_answers_are_packed_for_who_takes_them(welcoming) -> None:
    everything = {"query": "SELECT * { ?s ?p ?o }"}
    packed = CLIENT.get(welcoming.sparql, params=everything)
    plain = CLIENT.get(welcoming.sparql, params=everything, headers={"Accept-Encoding": "identity"})
    assert packed.headers["content-encoding"] == "gzip" and "content-encoding" not in plain.headers
    assert packed.json() == plain.json()


@pytest.mark.parametrize(("origin", "status"), [(SITE, 200), ("https://other.example", 403)])
def test_pages_of_chosen_sites_may_ask_and_no_others(welcoming, origin: str, status: int) -> None:
    headers = {"Origin": origin, "Sec-Fetch-Site": "cross-site", "Sec-Fetch-Mode": "cors"}
    said = CLIENT.get(welcoming.sparql, params=FEW, headers=headers)
    assert said.status_code == status
    assert said.headers.get("access-control-allow-origin") == (origin if status == 200 else None)
    assert welcoming.get("/questions.json", **headers).status_code == 403


def test_a_graph_is_read_by_its_name(welcoming) -> None:
    turtle = {"Accept": "application/n-triples"}
    whole = CLIENT.get(welcoming.sparql, params={"default": ""}, headers=turtle)
    named = {"graph": "https://w3id.org/irtwin/graph/ontology"}
    ontology = CLIENT.get(welcoming.sparql, params=named, headers=turtle)
    assert 1000 < len(ontology.text.splitlines()) < len(whole.text.splitlines())
    assert CLIENT.head(welcoming.sparql, params=named).status_code == 200
    assert CLIENT.get(welcoming.sparql, params={**named, "default": ""}).status_code == 400
    assert CLIENT.get(welcoming.sparql, params={"graph": "no IRI"}).status_code == 400

"""Graphs as a whole, read and written by the SPARQL 1.1 Graph Store HTTP Protocol."""

from __future__ import annotations

import pytest
from tests.endpoint import CLIENT, TOKEN

pytestmark = pytest.mark.slow

OWN = {"graph": "https://example.org/notes"}
TURTLE = "@prefix : <https://example.org/> . :press :stands 'here' ; :by [ :name 'wall' ] ."


def send(server, method: str, body: str = "", *, kind: str = "text/turtle", token: bool = True, **parameters: str):
    headers = {"Content-Type": kind} | ({"Authorization": f"Bearer {TOKEN}"} if token else {})
    return CLIENT.request(method, server.sparql, params=parameters or OWN, content=body, headers=headers)


def lines(server) -> list[str]:
    said = CLIENT.get(server.sparql, params=OWN, headers={"Accept": "application/n-triples"})
    return sorted(said.text.splitlines())


def test_a_graph_is_put_added_to_and_deleted(writable) -> None:
    assert send(writable, "PUT", TURTLE).status_code == 204
    assert len(lines(writable)) == 3
    more = '<https://example.org/saw> <https://example.org/stands> "there" .'
    assert send(writable, "POST", more, kind="application/n-triples").status_code == 204
    assert len(lines(writable)) == 4
    assert send(writable, "PUT", more, kind="application/n-triples").status_code == 204
    assert lines(writable) == [more]
    before = CLIENT.get(writable.sparql, params={"default": ""}).headers["etag"]
    assert send(writable, "PUT", TURTLE).status_code == 204
    assert CLIENT.get(writable.sparql, params={"default": ""}).headers["etag"] != before
    assert send(writable, "DELETE").status_code == 204
    for method in ("GET", "HEAD", "DELETE"):
        assert send(writable, method).status_code == 404


@pytest.mark.parametrize(
    ("method", "body", "asked", "status", "said"),
    [
        ("PUT", TURTLE, {"token": False}, 401, "an update needs the token"),
        ("PUT", "<a> <b>", {}, 400, "the graph cannot be read: "),
        ("PUT", "a,b", {"kind": "text/csv"}, 415, "a graph is sent as text/turtle"),
        ("PUT", TURTLE, {"default": ""}, 400, "name the one graph that is changed"),
        ("POST", TURTLE, {"graph": "no IRI"}, 400, "'no IRI' is no absolute IRI"),
        ("PATCH", "", {}, 405, "PATCH is not for a graph"),
    ],
)
def test_what_cannot_be_is_refused(writable, method: str, body: str, asked, status: int, said: str) -> None:
    response = send(writable, method, body, **asked)
    assert (response.status_code, said in response.text) == (status, True), response.text

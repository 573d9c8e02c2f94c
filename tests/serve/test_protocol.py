"""The SPARQL 1.1 Protocol, request by request, over real HTTP."""

from __future__ import annotations

import socket
from urllib.parse import urlencode, urlsplit

import httpx
import pytest
from tests.endpoint import CLIENT

FORM = "application/x-www-form-urlencoded"
QUERY = "application/sparql-query"
UPDATE = "application/sparql-update"
ROBOTS = "SELECT ?robot WHERE { ?robot a irt:Industrial_Robot } ORDER BY ?robot"
GRAPH_OF_ROBOTS = "https://w3id.org/irtwin/graph/source/robot"


def post(server, body: str | bytes, content_type: str, params=None, **headers: str) -> httpx.Response:
    return CLIENT.post(server.sparql, content=body, params=params, headers={"Content-Type": content_type, **headers})


def rows(response: httpx.Response) -> list[dict[str, str]]:
    assert response.status_code == 200, response.text
    found = response.json()["results"]["bindings"]
    return [{name: term["value"] for name, term in row.items()} for row in found]


def test_a_query_comes_in_three_ways_and_gets_one_answer(server) -> None:
    by_get = CLIENT.get(server.sparql, params={"query": ROBOTS})
    by_form = CLIENT.post(server.sparql, data={"query": ROBOTS})
    by_body = post(server, ROBOTS, QUERY)
    with_charset = post(server, ROBOTS, f"{QUERY}; charset=UTF-8")
    assert len(rows(by_get)) == 2
    assert by_get.content == by_form.content == by_body.content == with_charset.content


@pytest.mark.parametrize(
    ("query", "accept", "media_type", "begins"),
    [
        (ROBOTS, "application/sparql-results+json", "application/sparql-results+json", b'{"head":{"vars":["robot"]}'),
        (ROBOTS, "application/sparql-results+xml", "application/sparql-results+xml", b"<?xml"),
        (ROBOTS, "text/csv", "text/csv; charset=utf-8", b"robot\r\nhttps://"),
        (ROBOTS, "text/tab-separated-values", "text/tab-separated-values; charset=utf-8", b"?robot\n<https://"),
        ("ASK { ?s ?p ?o }", "application/json", "application/json", b'{"head":{},"boolean":true}'),
        ("ASK { ?s ?p ?o }", "application/sparql-results+xml", "application/sparql-results+xml", b"<?xml"),
        ("ASK { ?s ?p ?o }", "text/csv", "text/csv; charset=utf-8", b"true"),
        ("DESCRIBE irt:Industrial_Robot", "", "text/turtle; charset=utf-8", b"@prefix"),
        ("DESCRIBE irt:Industrial_Robot", "application/n-triples", "application/n-triples", b"<https://"),
        ("DESCRIBE irt:Industrial_Robot", "application/rdf+xml", "application/rdf+xml", b"<?xml"),
        ("CONSTRUCT WHERE { ?s a irt:Robot_Joint }", "application/ld+json", "application/ld+json", b"[{"),
        ("CONSTRUCT WHERE { ?s a irt:Robot_Joint }", "text/html, */*;q=0.1", "text/turtle; charset=utf-8", b"@prefix"),
    ],
)
def test_each_form_of_answer(server, query: str, accept: str, media_type: str, begins: bytes) -> None:
    response = post(server, query, QUERY, Accept=accept)
    assert response.status_code == 200
    assert response.headers["content-type"] == media_type
    assert response.headers["vary"].partition(",")[0] == "Accept"  # and the packing, where it is packed
    assert response.content.startswith(begins)


@pytest.mark.parametrize(
    ("query", "accept"),
    [
        (ROBOTS, "image/png"),
        (ROBOTS, "text/turtle"),
        ("DESCRIBE irt:Robot_Joint", "text/csv"),
        (ROBOTS, "*/*;q=0"),
    ],
)
def test_a_form_that_there_is_not_is_406(server, query: str, accept: str) -> None:
    response = post(server, query, QUERY, Accept=accept)
    assert response.status_code == 406
    assert "none of them is in Accept" in response.text


def test_a_syntax_error_is_400_with_line_and_column(server) -> None:
    response = post(server, "SELECT ?s WHERE {\n  ?s ?p }", QUERY)
    assert response.status_code == 400
    assert "error at 2:10" in response.text
    assert response.headers["content-type"].startswith("text/plain")


ENCODED = urlencode({"query": "ASK {}"})


@pytest.mark.parametrize(
    ("method", "params", "content_type", "body", "status", "message"),
    [
        ("GET", "query=ASK{}&query=ASK{}", None, None, 400, "2 times `query`"),
        ("GET", "update=CLEAR+ALL", None, None, 400, "sent by POST"),
        ("GET", "query=%ff", None, None, 400, "not UTF-8"),
        ("GET", "&".join(["a=1"] * 2000), None, None, 400, "more than 1000 parameters"),
        ("GET", "query=", None, None, 400, "not a SPARQL query"),
        ("GET", "query=ASK{}&default-graph-uri=not+an+iri", None, None, 400, "is not the name of a graph"),
        ("POST", "", FORM, "nothing=1", 400, "one of `query` and `update`"),
        ("POST", "", FORM, f"{ENCODED}&update=CLEAR+ALL", 400, "one of `query` and `update`"),
        ("POST", "", FORM, b"query=\xff", 400, "not UTF-8, from byte 6"),
        ("POST", "", QUERY, b"ASK {\xff}", 400, "not UTF-8, from byte 5"),
        ("POST", ENCODED, QUERY, "ASK {}", 400, "leave it out of the address"),
        ("POST", "", "text/plain", "ASK {}", 415, "POST takes"),
        ("POST", "", None, "ASK {}", 415, "a body without Content-Type"),
        ("POST", "", f"{QUERY}; charset=latin-1", "ASK {}", 415, "charset of a request is UTF-8"),
        ("POST", "", QUERY, "#" * (1 << 20) + "\nASK {}", 413, "at most 1,048,576 bytes"),
        ("PUT", "", QUERY, "ASK {}", 405, "PUT is not for this address"),
        ("DELETE", "", None, None, 405, "DELETE is not for this address"),
        ("POST", "", UPDATE, "CLEAR ALL", 403, "read-only"),
        ("POST", "", FORM, "update=CLEAR+ALL", 403, "read-only"),
        ("POST", "", QUERY, "CLEAR ALL", 400, "not a SPARQL query"),
        ("POST", "", QUERY, "SELECT * { SERVICE <http://127.0.0.1:1/> { ?s ?p ?o } }", 400, "SERVICE asks another"),
        ("POST", "", QUERY, "LOAD <file:///etc/passwd>", 400, "not a SPARQL query"),
    ],
)
def test_what_is_refused(server, method, params, content_type, body, status, message) -> None:
    headers = {} if content_type is None else {"Content-Type": content_type}
    response = CLIENT.request(method, f"{server.sparql}?{params}", headers=headers, content=body)
    assert response.status_code == status, response.text
    assert message in response.text
    assert response.text.count("\n") == 1 or status == 400
    if status == 405:
        assert response.headers["allow"] == "GET, HEAD, POST, OPTIONS"


def test_head_and_options(server) -> None:
    head = CLIENT.head(server.sparql, params={"query": ROBOTS}, headers={"Accept": "text/csv"})
    assert (head.status_code, head.content) == (200, b"")
    assert head.headers["content-type"] == "text/csv; charset=utf-8"
    options = CLIENT.options(server.sparql)
    assert (options.status_code, options.headers["allow"]) == (204, "GET, HEAD, POST, OPTIONS")


@pytest.mark.parametrize("way", ["get", "form", "body"])
def test_the_request_chooses_the_dataset(server, way: str) -> None:
    count = "SELECT (COUNT(*) AS ?n) { ?s ?p ?o }"
    named = "SELECT DISTINCT ?g { GRAPH ?g { ?s ?p ?o } }"

    def ask(query: str, *graphs: tuple[str, str]) -> list[dict[str, str]]:
        pairs = [("query", query), *graphs]
        if way == "get":
            return rows(CLIENT.get(f"{server.sparql}?{urlencode(pairs)}"))
        if way == "form":
            return rows(post(server, urlencode(pairs), FORM))
        return rows(CLIENT.post(f"{server.sparql}?{urlencode(graphs)}", content=query, headers={"Content-Type": QUERY}))

    whole, robots = int(ask(count)[0]["n"]), int(ask(count, ("default-graph-uri", GRAPH_OF_ROBOTS))[0]["n"])
    assert 0 < robots < whole
    assert ask(count, ("default-graph-uri", "http://example.com/remote.ttl")) == [{"n": "0"}]
    assert ask(named, ("named-graph-uri", GRAPH_OF_ROBOTS)) == [{"g": GRAPH_OF_ROBOTS}]
    assert ask(count, ("named-graph-uri", GRAPH_OF_ROBOTS)) == [{"n": "0"}]
    over_from = count.replace("{", f"FROM <{GRAPH_OF_ROBOTS}> {{", 1)
    assert ask(over_from) == [{"n": str(robots)}]
    assert ask(over_from, ("default-graph-uri", "http://example.com/other")) == [{"n": "0"}]


def test_from_reads_nothing_from_elsewhere(server) -> None:
    """A listener on this machine sees that nobody comes."""
    with socket.create_server(("127.0.0.1", 0)) as listener:
        listener.settimeout(0.3)
        url = f"http://127.0.0.1:{listener.getsockname()[1]}/data.ttl"
        for query in (f"ASK FROM <{url}> {{ ?s ?p ?o }}", f"ASK FROM NAMED <{url}> {{ GRAPH <{url}> {{ ?s ?p ?o }} }}"):
            assert post(server, query, QUERY).json()["boolean"] is False
        assert post(server, f"ASK {{ SERVICE <{url}> {{ ?s ?p ?o }} }}", QUERY).status_code == 400
        with pytest.raises(TimeoutError):
            listener.accept()


def test_a_request_that_is_no_http_leaves_the_server_well(server) -> None:
    address = urlsplit(server.url)
    with socket.create_connection((address.hostname, address.port), timeout=10) as raw:
        raw.sendall(b"\x00\xff nonsense\r\n\r\n")
        assert b"400" in raw.recv(1000)
    assert post(server, "ASK {}", QUERY).status_code == 200

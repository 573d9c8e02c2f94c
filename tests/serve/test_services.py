"""SERVICE to endpoints that the server was started with: they answer, are told nothing of ours, and hold nobody up."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass, field
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

import click
import httpx
import pytest
from tests.endpoint import Server, serving
from tests.sparql_servers import oxigraph

from irtwin.cli.command_line import cli

pytestmark = pytest.mark.slow

SOLUTION = b'{"s": {"type": "uri", "value": "http://e/s"}}'
HEAD = b'{"head": {"vars": ["s"]}, "results": {"bindings": ['


@dataclass
class Elsewhere:
    """A server that does what its path says, and keeps what it was told."""

    url: str = ""
    told: list[tuple[str, dict[str, str]]] = field(default_factory=list)
    over: threading.Event = field(default_factory=threading.Event)


class Hostile(BaseHTTPRequestHandler):
    """Answers of servers that are broken, or mean harm."""

    elsewhere: Elsewhere

    def do_POST(self) -> None:
        self.rfile.read(int(self.headers["Content-Length"]))
        self.elsewhere.told.append((self.path, {name.lower(): value for name, value in self.headers.items()}))
        with suppress(OSError):
            getattr(self, self.path.strip("/"))()

    do_GET = do_POST

    def redirect(self) -> None:
        self.send_response(302)
        self.send_header("Location", f"{self.elsewhere.url}/unlisted")
        self.end_headers()

    def fails(self) -> None:
        self.send_error(500, "Out of Order")

    def unlisted(self) -> None:
        self._begin()
        self.wfile.write(HEAD + SOLUTION + b"]}}")

    def cut(self) -> None:
        self._begin()
        self.wfile.write(HEAD + SOLUTION)

    def endless(self) -> None:
        self._begin()
        self.wfile.write(HEAD + SOLUTION)
        while not self.elsewhere.over.is_set():
            self.wfile.write((b"," + SOLUTION) * 1000)

    def long_word(self) -> None:
        self._begin()
        self.wfile.write(HEAD + SOLUTION[:-3])
        while not self.elsewhere.over.is_set():
            self.wfile.write(b"s" * 100_000)

    def slow(self) -> None:
        self._begin()
        self.wfile.write(HEAD + SOLUTION)
        self.elsewhere.over.wait(60)

    def _begin(self) -> None:
        self.send_response(200)
        self.send_header("Content-Type", "application/sparql-results+json")
        self.send_header("Content-Length", str(1 << 40))
        self.end_headers()

    def log_message(self, *said: object) -> None:
        pass


@pytest.fixture(scope="module")
def elsewhere() -> Iterator[Elsewhere]:
    """A hostile server."""
    listening = ThreadingHTTPServer(("127.0.0.1", 0), Hostile)
    Hostile.elsewhere = one = Elsewhere(f"http://127.0.0.1:{listening.server_address[1]}")
    threading.Thread(target=listening.serve_forever, daemon=True).start()
    try:
        yield one
    finally:
        one.over.set()
        listening.shutdown()


@pytest.fixture(scope="module")
def federated(elsewhere: Elsewhere, new_graph: Callable[[], Path]) -> Iterator[Server]:
    """A server of which queries may ask most paths of `elsewhere`, for two seconds."""
    listed = ("redirect", "fails", "cut", "endless", "long_word", "slow")
    allowed = [word for path in listed for word in ("--allow-service", f"{elsewhere.url}/{path}")]
    with serving(new_graph(), "--timeout", 2, *allowed) as running:
        yield running


def asking(server: Server, url: str, head: str = "SELECT *") -> httpx.Response:
    return server.ask(f"{head} {{ SERVICE <{url}> {{ ?s ?p ?o }} }}")


def test_a_query_joins_what_another_endpoint_says(new_graph: Callable[[], Path]) -> None:
    with oxigraph() as other, serving(new_graph(), "--allow-service", other.url) as running:
        robot = "SELECT ?robot { ?robot a irt:Industrial_Robot } ORDER BY ?robot LIMIT 1"
        iri = running.ask(robot).json()["results"]["bindings"][0]["robot"]["value"]
        query = f"SELECT ?of {{ ?robot a irt:Industrial_Robot SERVICE <{other.url}> {{ ?robot <http://e/made> ?of }} }}"
        assert running.ask(query).json()["results"]["bindings"] == []
        other.update(f"INSERT DATA {{ <{iri}> <http://e/made> 1999 . <http://e/other> <http://e/made> 2000 }}")
        assert [row["of"]["value"] for row in running.ask(query).json()["results"]["bindings"]] == ["1999"]
        update = f"INSERT {{ ?s ?p ?o }} WHERE {{ SERVICE <{other.url}> {{ ?s ?p ?o }} }}"
        assert running.update(update).status_code == 400
        description = running.get("/sparql", Accept="text/turtle").text
        assert "BasicFederatedQuery" in description


def test_nothing_of_ours_is_told_but_what_is_asked(federated: Server, elsewhere: Elsewhere) -> None:
    body = f"ASK {{ SERVICE <{elsewhere.url}/fails> {{ ?s ?p ?o }} }}"
    federated.ask(body, Authorization="Bearer a-token", Cookie="a=b", From="me")
    path, headers = elsewhere.told[-1]
    assert path == "/fails"
    assert set(headers) <= {"host", "accept", "content-type", "user-agent", "content-length"}


@pytest.mark.parametrize("path", ["unlisted", "redirect/more", ""])
def test_another_address_of_a_listed_host_is_refused(federated: Server, elsewhere: Elsewhere, path: str) -> None:
    before = len(elsewhere.told)
    response = asking(federated, f"{elsewhere.url}/{path}")
    assert (response.status_code, response.text[:29]) == (400, "SERVICE asks another server, "), response.text
    nested = f"SELECT * {{ SERVICE <{elsewhere.url}/slow> {{ SERVICE <{elsewhere.url}/{path}> {{ ?s ?p ?o }} }} }}"
    variable = f"SELECT * {{ VALUES ?of {{ <{elsewhere.url}/slow> }} SERVICE ?of {{ ?s ?p ?o }} }}"
    assert federated.ask(nested).status_code == federated.ask(variable).status_code == 400
    assert len(elsewhere.told) == before


def test_a_redirect_is_not_followed(federated: Server, elsewhere: Elsewhere) -> None:
    before = len(elsewhere.told)
    response = asking(federated, f"{elsewhere.url}/redirect")
    assert (response.status_code, "too many redirects" in response.text) == (502, True), response.text
    assert [path for path, _ in elsewhere.told[before:]] == ["/redirect"]


@pytest.mark.parametrize(("path", "why"), [("fails", "Error 500"), ("cut", ""), ("long_word", "Reached the buffer")])
def test_a_server_that_fails_is_told_in_one_line(federated: Server, elsewhere: Elsewhere, path: str, why: str) -> None:
    response = asking(federated, f"{elsewhere.url}/{path}")
    assert response.status_code == 502
    assert response.text.startswith(f"a server that SERVICE names does not answer this: {why}")
    assert response.text.count("\n") == 1


@pytest.mark.parametrize(
    ("path", "head", "why"),
    [
        ("slow", "SELECT *", "the query was cancelled after 2 s"),
        ("endless", "SELECT (COUNT(*) AS ?n)", "the query was cancelled after 2 s"),
    ],
)
def test_limits_hold_for_what_another_server_sends(
    federated: Server, elsewhere: Elsewhere, path: str, head: str, why: str
) -> None:
    response = asking(federated, f"{elsewhere.url}/{path}", head)
    assert (response.status_code, response.text[: len(why)]) == (503, why), response.text
    assert federated.ask("ASK {}").json()["boolean"] is True


@pytest.mark.parametrize(
    "url", ["file:///etc/passwd", "ftp://e.org/", "https://", "http://me:word@e.org/", "http://e.org/> <x", "e.org"]
)
def test_an_address_that_is_no_endpoint_is_refused(url: str) -> None:
    with pytest.raises(click.BadParameter, match="give the whole http or https address"):
        cli.main(["serve", "--allow-service", url], standalone_mode=False)

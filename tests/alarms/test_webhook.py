"""Alarms reach a web server on this machine; what it answers decides whether they are sent again."""

from __future__ import annotations

import socket
import threading
from collections.abc import Iterator
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

import pytest
from tests.dripping import dripping

from irtwin.alarms import delivery
from irtwin.alarms.delivery import Delivery, Undelivered
from irtwin.alarms.webhook import Webhook

TOKEN = "s3cret-token"


class Server(ThreadingHTTPServer):
    """Answers each POST with the next of `statuses`, 204 after the last."""

    daemon_threads = True

    def __init__(self) -> None:
        super().__init__(("127.0.0.1", 0), Handler)
        self.statuses: list[int] = []
        self.got: list[tuple[str, str | None, bytes]] = []

    @property
    def url(self) -> str:
        return f"http://127.0.0.1:{self.server_address[1]}/hooks/private-path"


class Handler(BaseHTTPRequestHandler):
    server: Server

    def do_POST(self) -> None:
        body = self.rfile.read(int(self.headers["content-length"]))
        self.server.got.append((self.path, self.headers["authorization"], body))
        self.send_response(self.server.statuses.pop(0) if self.server.statuses else 204)
        self.send_header("location", "http://127.0.0.1:1/elsewhere")
        self.send_header("content-length", "0")
        self.end_headers()

    def log_message(self, *_: object) -> None:
        pass


@pytest.fixture
def server() -> Iterator[Server]:
    with Server() as server:
        thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.01})
        thread.start()
        yield server
        server.shutdown()
        thread.join()


def test_a_message_is_posted_with_its_token(server: Server) -> None:
    Webhook(server.url, TOKEN, 5.0).send(b'{"event": "raised"}')
    assert server.got == [("/hooks/private-path", f"Bearer {TOKEN}", b'{"event": "raised"}')]


def test_a_server_that_is_down_for_a_while_gets_it_later(server: Server, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(delivery, "FIRST_PAUSE", 0.001)
    server.statuses = [503, 429]
    said: list[str] = []
    taking = Delivery(Webhook(server.url, None, 5.0), said.append)
    taking.put(b"{}")
    taking._waiting.put(None)
    taking._thread.join(30)
    assert (len(server.got), said) == (3, [])


@pytest.mark.parametrize(
    ("status", "reason", "lasting"),
    [
        (302, "it answered 302, a redirect, which is not followed; set its url anew", True),
        (307, "it answered 307, a redirect, which is not followed; set its url anew", True),
        (401, "it answered 401", True),
        (500, "it answered 500", False),
    ],
)
def test_what_a_refusal_says(server: Server, status: int, reason: str, lasting: bool) -> None:
    server.statuses = [status]
    with pytest.raises(Undelivered) as refused:
        Webhook(server.url, TOKEN, 5.0).send(b"{}")
    assert (str(refused.value), refused.value.lasting, len(server.got)) == (reason, lasting, 1)


def test_a_server_that_never_answers_or_is_not_there() -> None:
    with socket.create_server(("127.0.0.1", 0)) as silent:
        port = silent.getsockname()[1]
        with pytest.raises(Undelivered, match=r"no answer within 0\.1 s"):
            Webhook(f"http://127.0.0.1:{port}/", None, 0.1).send(b"{}")
    with pytest.raises(Undelivered, match="refused"):
        Webhook(f"http://127.0.0.1:{port}/", None, 5.0).send(b"{}")


def test_neither_path_nor_token_is_said(server: Server) -> None:
    server.statuses = [400]
    said: list[str] = []
    taking = Delivery(Webhook(server.url, TOKEN, 5.0), said.append)
    taking.put(b"{}")
    taking.close(30)
    (line,) = said
    assert line.startswith("webhook at 127.0.0.1:") and "private" not in line and TOKEN not in line


@pytest.mark.parametrize(
    ("first", "what"),
    [(b"HTTP/1.1 2", b"0"), (b"", b"HTTP/1.1 103 Early Hints\r\n\r\n"), (b"HTTP/1.1 200 OK\r\nx: ", b"y")],
    ids=["a byte of its status", "early hints", "a byte of a header"],
)
def test_an_answer_that_never_ends_is_told(first: bytes, what: bytes, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(delivery, "FIRST_PAUSE", 0.01)
    said: list[str] = []
    with dripping(what, 0.1, first) as port:
        taking = Delivery(Webhook(f"http://127.0.0.1:{port}/", None, 0.3), said.append)
        taking.put(b"{}")
        taking._waiting.put(None)
        taking._thread.join(30)
        assert not taking._thread.is_alive()
    assert taking.lost == 1
    assert "a message could not be delivered: " in said[0]

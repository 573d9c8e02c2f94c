"""Clients that hold connections without asking, or ask without reading, keep nobody else waiting."""

from __future__ import annotations

import asyncio
import socket
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path
from urllib.parse import urlencode

import httpx
import pytest
import uvicorn
from tests.endpoint import Server, serving

from irtwin.serve import connections
from irtwin.serve.answer import IN_MEMORY, Replies, Reply

pytestmark = [pytest.mark.slow, pytest.mark.anyio]

LARGE = "SELECT * { ?a ?b ?c . VALUES ?n { 1 2 3 4 5 6 7 8 9 10 11 12 } }"  # some MB
MOST = 256  # connections


@pytest.fixture(scope="module")
def patient(new_graph: Callable[[], Path]) -> Iterator[Server]:
    """A server that gives a query longer than the test's own client waits."""
    with serving(new_graph(), "--timeout", 120) as running:
        yield running


def test_half_open_connections_give_way(server: Server) -> None:
    with ExitStack() as held:
        for _ in range(MOST + 20):
            held.enter_context(server.connected(b"GET /sparql HTTP/1.1\r\nHost: local"))
        for _ in range(3):
            assert httpx.get(server.sparql, params={"query": "ASK {}"}, timeout=30).status_code == 200


@pytest.mark.nightly
def test_clients_that_do_not_read_hold_no_worker(patient: Server) -> None:
    query = urlencode({"query": LARGE})
    with ExitStack() as held:
        for _ in range(12):
            held.enter_context(patient.connected(f"GET /sparql?{query} HTTP/1.1\r\nHost: localhost\r\n\r\n".encode()))
        small = httpx.get(patient.sparql, params={"query": "ASK {}"}, timeout=60)
        assert small.status_code == 200


def test_who_reads_late_gets_all_of_it(patient: Server) -> None:
    query = urlencode({"query": LARGE})
    head = f"GET /sparql?{query} HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\nAccept: text/csv\r\n\r\n".encode()
    with patient.connected(head) as late:
        at_once = httpx.get(patient.sparql, params={"query": LARGE}, headers={"Accept": "text/csv"}, timeout=60)
        answer = b"".join(iter(lambda: late.recv(1 << 16), b""))
    assert answer.count(b"\r\n") > at_once.content.count(b"\r\n") > 1000
    assert answer.endswith(b"0\r\n\r\n")  # the last chunk: it is whole


async def serve(requests: Callable[[int], None]) -> None:
    async def application(scope, receive, send) -> None:
        await send({"type": "http.response.start", "status": 200, "headers": []})
        for _ in range(100):
            await send({"type": "http.response.body", "body": bytes(1 << 20), "more_body": True})

    listening = socket.create_server(("127.0.0.1", 0))
    config = uvicorn.Config(application, http=connections.TimedConnection, lifespan="off", log_level="critical")
    server = uvicorn.Server(config)
    running = asyncio.create_task(server.serve(sockets=[listening]))
    await asyncio.to_thread(requests, listening.getsockname()[1])
    server.should_exit = True
    await running


@pytest.mark.parametrize("sent", [b"", b"GET / HTTP/1.1\r\nHost:", b"GET / HTTP/1.1\r\nHost: localhost\r\n\r\n"])
async def test_who_does_not_get_on_is_left(monkeypatch: pytest.MonkeyPatch, sent: bytes) -> None:
    """Nothing sent, half a head sent, or an answer not read: the server ends the connection by itself."""
    monkeypatch.setattr(connections, "HEAD", 0.2)
    monkeypatch.setattr(connections, "STALL", 0.2)

    def ask(port: int) -> None:
        with socket.create_connection(("127.0.0.1", port), timeout=30) as raw:
            raw.sendall(sent)
            if sent.endswith(b"\r\n\r\n"):
                time.sleep(1.0)
            try:
                received = sum(map(len, iter(lambda: raw.recv(1 << 20), b"")))
            except ConnectionResetError:
                received = 0
            assert received < 100 << 20

    await serve(ask)


async def test_an_answer_waits_in_memory_and_then_in_a_file() -> None:
    answers = Replies(room=100 << 20)
    with answers.new() as answer:
        parts = [bytes([number]) * (1 << 20) for number in range(8)]
        for part in parts[:7]:
            answer.write(part)
        assert answer.waiting == 7 << 20 > IN_MEMORY
        pieces = answer.pieces()
        first = await anext(pieces)
        answer.write(parts[7])
        answer.end()
        assert b"".join([first, *[piece async for piece in pieces]]) == b"".join(parts)
        assert answer.whole and not answer.broken_off


async def test_a_client_that_keeps_up_needs_no_room() -> None:
    answer = Reply()

    async def take() -> int:
        return sum([len(piece) async for piece in answer.pieces()])

    taking = asyncio.create_task(take())
    for _ in range(50):
        answer.write(bytes(1 << 20))
        while answer.waiting:
            await asyncio.sleep(0)
    answer.end()
    assert await taking == 50 << 20
    assert not answer._file._rolled
    answer.close()


def test_the_answer_that_takes_most_room_is_given_up() -> None:
    answers = Replies(room=100)
    with answers.new() as small, answers.new() as large:
        small.write(bytes(40))
        large.write(bytes(60))
        answers.make_room()
        assert not small.broken_off and not large.broken_off
        small.write(bytes(10))
        answers.make_room()
        assert large.broken_off and not small.broken_off and large.waiting == 0

"""Clients share what a server has: one that asks for all of it keeps nobody else out."""

from __future__ import annotations

import socket
import threading
import time
from contextlib import ExitStack

import httpx
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.endpoint import Server

from irtwin.serve import samples
from irtwin.serve.shares import Displaced, client_of, gives_way

GREEDY, OTHER = "127.0.0.2", "127.0.0.3"  # addresses of this machine: two clients
TOO_MUCH = "SELECT (COUNT(*) AS ?n) { ?a ?b ?c . ?d ?e ?f . ?g ?h ?i }"
CONNECTIONS = 256
EVENTS = b"GET /live/arm/events HTTP/1.1\r\nHost: localhost\r\n\r\n"
SLOW_BODY = (
    b"POST /sparql HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/sparql-query\r\nContent-Length: 99\r\n\r\nA"
)


@pytest.mark.parametrize(
    ("address", "client"),
    [
        ("192.168.0.7", "192.168.0.7"),
        ("::ffff:192.168.0.7", "192.168.0.7"),
        ("2001:db8:1:2:3:4:5:6", "2001:db8:1:2::/64"),
        ("2001:db8:1:2::99", "2001:db8:1:2::/64"),
        ("fe80::1%eth0", "fe80::/64"),
        ("::1", "::/64"),
        ("unknown", "unknown"),
        ("", ""),
    ],
)
def test_a_client_is_an_address_or_a_network_of_64_bits(address: str, client: str) -> None:
    assert client_of(address) == client


@given(st.lists(st.sampled_from("ABCD"), max_size=200), st.integers(1, 20))
def test_no_client_is_kept_out_and_none_has_two_more_than_one_that_was_refused(asked: list[str], room: int) -> None:
    taken: dict[str, int] = dict.fromkeys("ABCD", 0)
    for client in asked:
        if sum(taken.values()) < room:
            taken[client] += 1
            continue
        try:
            most = gives_way(taken, client)
        except Displaced:
            assert max(taken.values()) <= taken[client] + 1
        else:
            assert taken[most] == max(taken.values()) > taken[client] + 1
            taken[most] -= 1
            taken[client] += 1
        assert sum(taken.values()) == room
    assert room < len(taken) or all(taken[client] for client in asked)


def asking(of: str) -> httpx.Client:
    return httpx.Client(transport=httpx.HTTPTransport(local_address=of), timeout=60)


def status(raw: socket.socket) -> bytes:
    return raw.recv(1 << 12).split(b" ")[1]


@pytest.mark.nightly
@pytest.mark.slow
def test_another_clients_small_queries_are_answered_beside_twenty_that_run_to_their_limit(strict: Server) -> None:
    over = threading.Event()

    def ask_too_much() -> None:
        with asking(GREEDY) as http:
            while not over.is_set():
                http.get(strict.sparql, params={"query": TOO_MUCH})

    threads = [threading.Thread(target=ask_too_much) for _ in range(20)]
    for thread in threads:
        thread.start()
    try:
        found, until = [], time.monotonic() + 5  # twice all workers of the greedy are ended and replaced
        with asking(OTHER) as http:
            while time.monotonic() < until:
                found.append(http.get(strict.sparql, params={"query": "ASK {}"}).status_code)
                time.sleep(0.05)
    finally:
        over.set()
        for thread in threads:
            thread.join()
    assert set(found) == {200}


@pytest.mark.slow
def test_another_client_looks_on_beside_one_that_took_all_streams(strict: Server) -> None:
    with ExitStack() as held:
        theirs = [held.enter_context(strict.connected(EVENTS, GREEDY)) for _ in range(samples.MOST)]
        assert {status(raw) for raw in theirs} == {b"200"}
        other = held.enter_context(strict.connected(EVENTS, OTHER))
        assert status(other) == b"200"
        assert status(held.enter_context(strict.connected(EVENTS, GREEDY))) == b"503"
        others = [held.enter_context(strict.connected(EVENTS, OTHER)) for _ in range(samples.MOST)]
        assert [status(raw) for raw in others].count(b"200") == samples.MOST // 2 - 1


@pytest.mark.slow
def test_another_client_is_answered_beside_one_that_took_all_connections(writable: Server) -> None:
    with ExitStack() as held:
        for _ in range(CONNECTIONS + 40):
            held.enter_context(writable.connected(SLOW_BODY, GREEDY))
        with asking(OTHER) as http:
            answers = [http.get(writable.sparql, params={"query": "ASK {}"}).status_code for _ in range(5)]
    assert answers == [200] * 5


@pytest.mark.slow
def test_who_forwards_is_believed_on_this_machine_alone(strict: Server) -> None:
    """Who says other clients in X-Forwarded-For stays one, but for 127.0.0.1: a proxy there tells its own apart."""
    forged = [EVENTS[:-2] + f"X-Forwarded-For: 10.0.0.{number}\r\n\r\n".encode() for number in range(2)]
    for of, said in ((GREEDY, b"503"), ("127.0.0.1", b"200")):
        with ExitStack() as held:
            for _ in range(samples.MOST):
                held.enter_context(strict.connected(forged[0], of))
            time.sleep(0.5)
            assert status(held.enter_context(strict.connected(forged[1], of))) == said
        time.sleep(0.5)

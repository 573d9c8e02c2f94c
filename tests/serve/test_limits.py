"""Time, memory and size of a query; workers that go; clients that leave; queues."""

from __future__ import annotations

import asyncio
import os
import signal
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import httpx
import psutil
import pytest
from tests.endpoint import serving
from tests.serve.conftest import pool
from tests.waiting import wait_for

from irtwin.serve.pool import Limits, Pool
from irtwin.serve.protocol import Operation, Refusal

pytestmark = [pytest.mark.slow, pytest.mark.anyio]

PRODUCT = "SELECT (COUNT(*) AS ?n) { ?a ?b ?c . ?d ?e ?f . ?g ?h ?i }"
ALL_PAIRS = "SELECT DISTINCT * { ?a ?b ?c . ?d ?e ?f }"


def settle(server, gone: int) -> None:
    """Wait until a worker is gone and another in its place."""
    wait_for(lambda: gone not in (pids := server.workers()) and len(pids) >= 2, 20)


def busy(server) -> int:
    """Wait for a worker that computes, and return its process id."""
    deadline, before = time.monotonic() + 20, server.workers()
    while time.monotonic() < deadline:
        time.sleep(0.05)
        for pid, used in server.workers().items():
            if used - before.get(pid, used) > 0.03:
                return pid
    raise AssertionError("no worker is busy")


def test_a_query_that_takes_too_long_is_ended(strict) -> None:
    with ThreadPoolExecutor(1) as threads:
        asked = threads.submit(strict.ask, PRODUCT)
        worker = busy(strict)
        response = asked.result()
    assert response.status_code == 503
    assert response.text == "the query was cancelled after 2 s: ask for less, or add a LIMIT\n"
    settle(strict, gone=worker)
    assert strict.ask("ASK {}").json()["boolean"] is True


def test_an_update_that_takes_too_long_changes_nothing(strict) -> None:
    count = "SELECT (COUNT(*) AS ?n) { ?s ?p ?o }"
    before = strict.ask(count).content
    # No solution is kept, so that the time is over before the memory.
    never = 'FILTER(CONCAT(STR(?a), STR(?d), STR(?g)) = "")'
    response = strict.update(f"INSERT {{ ?a ?b ?i }} WHERE {{ ?a ?b ?c . ?d ?e ?f . ?g ?h ?i {never} }}")
    assert (response.status_code, response.text[:24]) == (503, "the update was cancelled"), response.text
    assert strict.ask(count).content == before


def test_what_takes_too_much_memory_is_ended_and_changes_nothing(new_graph: Callable[[], Path]) -> None:
    count = "SELECT (COUNT(*) AS ?n) { ?s ?p ?o }"
    with serving(new_graph(), "--memory", 128) as small:
        before = small.ask(count).content
        query = small.ask(f"{ALL_PAIRS} ORDER BY ?c ?f")
        assert (query.status_code, query.text) == (503, "the query needs more than 128 MB of memory: ask for less\n")
        update = small.update("INSERT { ?a ?b ?f } WHERE { ?a ?b ?c . ?d ?e ?f }")
        assert (update.status_code, "out of memory; nothing changed" in update.text) == (500, True), update.text
        assert small.ask(count).content == before
        assert small.update("INSERT DATA { <a:a> <a:a> <a:a> }").status_code == 204  # the next is done


def test_a_client_that_leaves_ends_its_query_and_others_are_answered_meanwhile(server) -> None:
    """The time limit of this server is half a minute: it is not what ends the query."""
    with ThreadPoolExecutor(1) as threads:
        asked = threads.submit(httpx.post, server.sparql, data={"query": PRODUCT}, timeout=4.0)
        worker = busy(server)
        assert server.ask("ASK { ?s ?p ?o }").json()["boolean"] is True
        assert not asked.done()
        with pytest.raises(httpx.ReadTimeout):
            asked.result()
    settle(server, gone=worker)


def test_a_client_that_leaves_in_mid_answer_ends_its_query(server) -> None:
    before = set(server.workers())
    with httpx.stream("POST", server.sparql, data={"query": ALL_PAIRS}, timeout=30) as response:
        assert response.status_code == 200
        pieces = response.iter_bytes()  # a name for it: the client leaves as soon as nobody holds it
        assert next(pieces)
        assert before <= set(server.workers())
    wait_for(lambda: not before <= set(server.workers()), 20)  # else the query goes on
    settle(server, gone=(before - set(server.workers())).pop())
    assert server.ask("ASK {}").status_code == 200


def test_a_broken_off_answer_does_not_look_whole(strict) -> None:
    with pytest.raises(httpx.RemoteProtocolError, match="incomplete chunked read"):
        strict.ask(ALL_PAIRS.replace("DISTINCT ", ""))


def test_killed_workers_are_replaced(server) -> None:
    before = server.workers()
    for worker in before:
        os.kill(worker, signal.SIGKILL)
    answers = [server.ask("ASK { ?s ?p ?o }") for _ in range(6)]
    assert all(answer.status_code == 200 and answer.json()["boolean"] for answer in answers)
    for worker in before:
        settle(server, gone=worker)


def test_many_clients_at_once_get_their_own_answers(server) -> None:
    def ask(number: int) -> int:
        response = server.ask(f"SELECT ({number} AS ?n) {{ ?s a irt:Industrial_Robot }} LIMIT 1")
        return int(response.json()["results"]["bindings"][0]["n"]["value"])

    with ThreadPoolExecutor(16) as threads:
        assert list(threads.map(ask, range(200))) == list(range(200))


async def read(workers: Pool, query: str) -> bytes:
    async with workers.worker("here") as worker:
        await worker.ask(Operation("query", query), "http://e/sparql", "text/csv", False)
        return b"".join([piece async for piece in worker.pieces()])


async def test_an_answer_beyond_the_size_limit_is_refused(new_graph: Callable[[], Path]) -> None:
    async with pool(new_graph(), Limits(answer=1000)) as workers:
        with pytest.raises(Refusal, match="larger than this endpoint sends"):
            await read(workers, "SELECT * { ?s ?p ?o }")
        assert (await read(workers, "SELECT (1 AS ?n) {}")).split() == [b"n", b"1"]


async def test_a_large_answer_comes_whole(new_graph: Callable[[], Path]) -> None:
    async with pool(new_graph(), Limits()) as workers:
        triples = len((await read(workers, "SELECT * { ?s ?p ?o }")).splitlines()) - 1
        answer = await read(workers, "SELECT * { ?s ?p ?o VALUES ?n { 1 2 3 4 5 6 7 8 9 10 11 12 } }")
        assert len(answer.splitlines()) - 1 == 12 * triples
        assert len(answer) > 3 << 20


async def test_who_finds_the_queue_full_is_told_to_come_back(new_graph: Callable[[], Path]) -> None:
    async with pool(new_graph(), Limits(waiting=1, seconds=1)) as workers, workers.worker("here"):
        waiting = asyncio.create_task(read(workers, "ASK {}"))
        await asyncio.sleep(0)
        with pytest.raises(Refusal, match="too many queries are waiting") as full:
            await read(workers, "ASK {}")
        assert (full.value.status, full.value.headers) == (503, {"Retry-After": "2"})
        with pytest.raises(Refusal, match="no worker came free in time"):
            await waiting


def test_a_worker_that_outlives_its_server_ends_itself(new_graph: Callable[[], Path]) -> None:
    with serving(new_graph(), "--timeout", 1) as running, ThreadPoolExecutor(1) as threads:
        asked = threads.submit(running.ask, PRODUCT)
        worker = busy(running)
        running.process.kill()
        with pytest.raises(httpx.HTTPError):
            asked.result()
        psutil.Process(worker).wait(timeout=60)

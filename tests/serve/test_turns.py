"""Clients that wait for a worker: they take turns, and one with many requests keeps nobody out."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Coroutine
from pathlib import Path
from typing import Any

import pytest

from irtwin.location import Location
from irtwin.serve.pool import Limits, Pool
from irtwin.serve.protocol import Operation, Refusal
from irtwin.serve.shares import Displaced
from irtwin.serve.turns import Turns

Served = list[str]


def scenario(run: Callable[[], Coroutine[Any, Any, None]]) -> None:
    asyncio.run(asyncio.wait_for(run(), 60))


async def waiting(turns: Turns[str], served: Served, *requests: str) -> list[asyncio.Task[None]]:
    """Let requests such as "A1" wait, in this order; what is served is given on at once."""

    async def wait(request: str) -> None:
        thing = await turns.take(request[0])
        served.append(request)
        turns.give(request[0], thing)

    tasks = []
    for request in requests:
        tasks.append(asyncio.create_task(wait(request)))
        await asyncio.sleep(0)
    return tasks


def test_clients_take_turns() -> None:
    async def run() -> None:
        turns, served = Turns[str](64, 1), Served()
        tasks = await waiting(turns, served, "A1", "A2", "A3", "A4", "B1", "C1", "B2")
        turns.add("worker")
        await asyncio.gather(*tasks)
        assert served == ["A1", "B1", "C1", "A2", "B2", "A3", "A4"]

    scenario(run)


def test_a_free_one_is_lent_at_once() -> None:
    async def run() -> None:
        turns = Turns[str](0, 1)
        turns.add("worker")
        assert await turns.take("A") == "worker"
        with pytest.raises(Displaced):
            await turns.take("A")

    scenario(run)


def test_in_a_full_queue_who_has_fewer_places_takes_one_of_who_has_most() -> None:
    async def run() -> None:
        turns, served = Turns[str](3, 1), Served()
        tasks = await waiting(turns, served, "A1", "A2", "A3", "A4", "B1", "B2")
        turns.add("worker")
        ends = await asyncio.gather(*tasks, return_exceptions=True)
        assert served == ["A1", "B1", "A2"]
        assert [isinstance(end, Displaced) for end in ends] == [False, False, True, True, False, True]

    scenario(run)


def test_who_leaves_keeps_nothing() -> None:
    async def run() -> None:
        turns, served = Turns[str](64, 1), Served()
        tasks = await waiting(turns, served, "A1", "B1", "C1", "A2")
        tasks[0].cancel()
        await asyncio.sleep(0)
        tasks[1].cancel()
        turns.add("worker")  # to C1, though B1 did not get to say that it left
        tasks[2].cancel()  # with the worker in its hand
        await asyncio.gather(*tasks, return_exceptions=True)
        assert served == ["A2"]
        assert await turns.take("A") == "worker"

    scenario(run)


def test_no_client_holds_more_than_its_share() -> None:
    async def run() -> None:
        turns, served = Turns[str](64, 2), Served()
        for worker in ("first", "second", "third"):
            turns.add(worker)
        assert [await turns.take("A") for _ in range(2)] == ["first", "second"]
        (third_of_a,) = await waiting(turns, served, "A3")
        assert served == []
        assert await turns.take("B") == "third"
        turns.give("B", "third")
        assert not third_of_a.done()
        turns.lose("A")
        await third_of_a
        assert served == ["A3"]

    scenario(run)


@pytest.mark.slow
def test_a_small_query_does_not_wait_for_all_of_another_client(new_graph: Callable[[], Path]) -> None:
    async def run() -> None:
        pool, done = Pool(Location(new_graph().parent), 1, Limits()), Served()

        async def ask(client: str, number: int) -> None:
            async with pool.worker(client) as worker:
                await worker.ask(Operation("query", "ASK {}"), "http://e/", "text/csv", False)
                assert [piece async for piece in worker.pieces()] == [b"true"]
            done.append(f"{client} {number}")

        await pool.open()
        try:
            many = [asyncio.create_task(ask("10.0.0.1", number)) for number in range(20)]
            await asyncio.sleep(0)
            await asyncio.gather(*many, ask("10.0.0.2", 0))
        finally:
            await pool.close()
        assert done.index("10.0.0.2 0") <= 2

    scenario(run)


@pytest.mark.slow
def test_the_queue_says_that_it_is_full(new_graph: Callable[[], Path]) -> None:
    async def run() -> None:
        pool = Pool(Location(new_graph().parent), 1, Limits(waiting=0))
        await pool.open()
        try:
            async with pool.worker("A"):
                with pytest.raises(Refusal, match="too many queries are waiting"):
                    async with pool.worker("B"):
                        pass
        finally:
            await pool.close()

    scenario(run)

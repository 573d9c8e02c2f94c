"""Clients that wait for a worker: they take turns, and one with many requests keeps nobody out."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from pathlib import Path

import pytest
from tests.serve.conftest import pool

from irtwin.serve.pool import Limits
from irtwin.serve.protocol import Operation
from irtwin.serve.shares import Displaced
from irtwin.serve.turns import Turns

pytestmark = [pytest.mark.anyio, pytest.mark.timeout(60)]
Served = list[str]


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


async def test_clients_take_turns() -> None:
    turns, served = Turns[str](64, 1), Served()
    tasks = await waiting(turns, served, "A1", "A2", "A3", "A4", "B1", "C1", "B2")
    turns.add("worker")
    await asyncio.gather(*tasks)
    assert served == ["A1", "B1", "C1", "A2", "B2", "A3", "A4"]


async def test_a_free_one_is_lent_at_once() -> None:
    turns = Turns[str](0, 1)
    turns.add("worker")
    assert await turns.take("A") == "worker"
    with pytest.raises(Displaced):
        await turns.take("A")


async def test_in_a_full_queue_who_has_fewer_places_takes_one_of_who_has_most() -> None:
    turns, served = Turns[str](3, 1), Served()
    tasks = await waiting(turns, served, "A1", "A2", "A3", "A4", "B1", "B2")
    turns.add("worker")
    ends = await asyncio.gather(*tasks, return_exceptions=True)
    assert served == ["A1", "B1", "A2"]
    assert [isinstance(end, Displaced) for end in ends] == [False, False, True, True, False, True]


async def test_who_leaves_keeps_nothing() -> None:
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


async def test_no_client_holds_more_than_its_share() -> None:
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


@pytest.mark.slow
async def test_a_small_query_does_not_wait_for_all_of_another_client(new_graph: Callable[[], Path]) -> None:
    done = Served()
    async with pool(new_graph(), Limits()) as workers:

        async def ask(client: str, number: int) -> None:
            async with workers.worker(client) as worker:
                await worker.ask(Operation("query", "ASK {}"), "http://e/", "text/csv", False)
                assert [piece async for piece in worker.pieces()] == [b"true"]
            done.append(f"{client} {number}")

        many = [asyncio.create_task(ask("10.0.0.1", number)) for number in range(20)]
        await asyncio.sleep(0)
        await asyncio.gather(*many, ask("10.0.0.2", 0))
    assert done.index("10.0.0.2 0") <= 2

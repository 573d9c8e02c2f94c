"""Samples reach the pages of their robot; a page that does not take them is let go."""

from __future__ import annotations

import asyncio
import json
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any

import pytest

from irtwin.live.broadcast import SOCKET
from irtwin.serve import samples as room
from irtwin.serve.protocol import Refusal
from irtwin.serve.samples import Page, Samples

pytestmark = pytest.mark.anyio


@asynccontextmanager
async def serving(send: Callable[..., Any], address: Path) -> AsyncIterator[None]:
    """Send what a live process does; from Python 3.12 on a server that is left would wait for its connections."""
    server = await asyncio.start_unix_server(send, address)
    try:
        yield
    finally:
        server.close()


async def taken(page: Page, count: int) -> list[dict]:
    found: list[dict] = []
    async for piece in page.events():
        found += [json.loads(line[6:]) for line in piece.decode().splitlines() if line.startswith("data: ")]
        if len(found) >= count:
            break
    return found


async def test_a_page_gets_the_lines_of_its_robot(tmp_path: Path) -> None:
    async def send(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        robot = (await reader.readline()).decode().rstrip("\n")
        for number in range(3):
            writer.write(json.dumps({"robot": robot, "time": number}).encode() + b"\n")
        await writer.drain()

    (tmp_path / "live").mkdir()
    async with serving(send, tmp_path / "live" / SOCKET):
        samples = Samples(tmp_path)
        pages = [samples.page("a", "10.0.0.1"), samples.page("b", "10.0.0.1"), samples.page("b", "10.0.0.1")]
        found = await asyncio.wait_for(asyncio.gather(*(taken(page, 3) for page in pages)), 30)
        samples.close()
    assert [[one["time"] for one in each] for each in found] == [[0, 1, 2]] * 3
    assert [each[0]["robot"] for each in found] == ["a", "b", "b"]


async def test_watching_that_begins_later_is_found(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(room, "_AGAIN", 0.01)
    monkeypatch.setattr(room, "_LONGEST_LINE", 1000)
    samples = Samples(tmp_path)
    page = samples.page("a", "10.0.0.1")
    reading = asyncio.create_task(taken(page, 1))
    await asyncio.sleep(0.1)
    (tmp_path / "live").mkdir()

    async def send(_: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        writer.write(b"{" * 100_000 + b"\n")
        writer.close()

    async def send_well(_: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        writer.write(b'{"robot": "a", "time": 1}\n')
        await writer.drain()

    address = tmp_path / "live" / SOCKET
    async with serving(send, address):
        await asyncio.sleep(0.1)
    address.unlink(missing_ok=True)
    async with serving(send_well, address):
        assert await asyncio.wait_for(reading, 30) == [{"robot": "a", "time": 1}]
        samples.close()


async def test_a_page_that_takes_nothing_is_let_go() -> None:
    page = Page("a", "10.0.0.1")
    for _ in range(401):
        page.put(b"{}\n")
    assert page.lost
    assert [piece async for piece in page.events()] == [b"retry: 1000\n\n"]


async def test_more_pages_than_may_look_on_are_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(room, "MOST", 2)
    samples = Samples(tmp_path)
    first = samples.page("a", "10.0.0.1")
    samples.page("a", "10.0.0.1")
    with pytest.raises(Refusal, match="2 pages look on already"):
        samples.page("a", "10.0.0.1")
    samples.leave(first)
    samples.page("a", "10.0.0.1")
    samples.close()


async def test_another_client_takes_the_newest_page_of_the_one_that_has_most(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(room, "MOST", 3)
    samples = Samples(tmp_path)
    theirs = [samples.page("a", "10.0.0.1") for _ in range(3)]
    other = samples.page("a", "10.0.0.2")
    assert [page.lost for page in (*theirs, other)] == [False, False, True, False]
    with pytest.raises(Refusal, match="3 pages look on already"):
        samples.page("a", "10.0.0.1")
    with pytest.raises(Refusal, match="3 pages look on already"):  # one of two would be no fairer
        samples.page("a", "10.0.0.2")
    samples.leave(theirs[2])
    assert not samples.page("a", "10.0.0.3").lost
    assert theirs[1].lost
    samples.close()


async def test_a_page_without_samples_gets_a_word_now_and_then(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(room, "_QUIET", 0.01)
    page, found = Page("a", "10.0.0.1"), []
    async for piece in page.events():
        found.append(piece)
        if len(found) == 3:
            page.let_go()
    assert found[1:] == [b": nothing new\n\n"] * 2

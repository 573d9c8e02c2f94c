"""Samples on their way from `irtwin live` to pages: a connection to it, and a bounded queue, for each page."""

from __future__ import annotations

import asyncio
from collections import Counter, deque
from collections.abc import AsyncIterator
from contextlib import suppress
from pathlib import Path

from irtwin.live.broadcast import SOCKET, reachable
from irtwin.serve.protocol import Refusal
from irtwin.serve.shares import Displaced, gives_way
from irtwin.storage.schema import LIVE

MOST = 16  # pages that may look on
_HELD = 400  # samples that wait for a page: some five seconds
_AGAIN = 1.0  # s until the next try where nobody watches
_QUIET = 10.0  # s after which a page without samples gets a word, so that one that is gone is found out
_LONGEST_LINE = 1 << 20  # bytes


class Page:
    """Who looks on at one robot: the newest lines that were not sent yet; `lost` once there were too many."""

    def __init__(self, robot_id: str, client: str) -> None:
        self.robot_id, self.client = robot_id, client
        self.lost = False
        self._lines: deque[bytes] = deque()
        self._news = asyncio.Event()

    def put(self, line: bytes) -> None:
        """Give a line; too many that are not taken end it."""
        self.lost = self.lost or len(self._lines) >= _HELD
        self._lines.append(line)
        self._news.set()

    def let_go(self) -> None:
        """End it."""
        self.lost = True
        self._news.set()

    async def events(self) -> AsyncIterator[bytes]:
        """Give server-sent events until it is lost: what came meanwhile as one piece each."""
        yield b"retry: 1000\n\n"
        while not self.lost:
            with suppress(TimeoutError):
                async with asyncio.timeout(_QUIET):
                    await self._news.wait()
            self._news.clear()
            lines, self._lines = self._lines, deque()
            yield b"".join(b"data: " + line + b"\n" for line in lines) if lines else b": nothing new\n\n"


class Samples:
    """Hands what `irtwin live` tells of a workspace to the pages, and waits for it to come where it is not there."""

    def __init__(self, workspace: Path) -> None:
        self._socket = workspace / LIVE / SOCKET
        self._pages: dict[Page, asyncio.Task[None]] = {}  # what reads for each, the newest last

    def page(self, robot_id: str, client: str) -> Page:
        """Let one more page of a client look on, in the place of another's that has more. Raises Refusal."""
        if len(self._pages) >= MOST:
            self._make_room(client)
        page = Page(robot_id, client)
        self._pages[page] = asyncio.create_task(self._read(page))
        return page

    def leave(self, page: Page) -> None:
        """Note that a page is gone, for which nothing more is read."""
        if page in self._pages:
            self._pages.pop(page).cancel()

    def _make_room(self, client: str) -> None:
        try:
            most = gives_way(Counter(page.client for page in self._pages), client)
        except Displaced:
            raise Refusal(503, f"{MOST} pages look on already: close one", {"Retry-After": "5"}) from None
        newest = next(page for page in reversed(self._pages) if page.client == most)
        newest.let_go()
        self.leave(newest)

    def close(self) -> None:
        """Let all pages go."""
        for page in list(self._pages):
            page.let_go()
            self.leave(page)

    async def _read(self, page: Page) -> None:
        while True:
            with suppress(OSError, ValueError):  # nobody watches, or watching ended, or a line is too long
                with reachable(self._socket) as address:
                    lines, writing = await asyncio.open_unix_connection(address, limit=_LONGEST_LINE)
                try:
                    writing.write(page.robot_id.encode() + b"\n")
                    while line := await lines.readline():
                        page.put(line)
                finally:
                    writing.close()
            await asyncio.sleep(_AGAIN)

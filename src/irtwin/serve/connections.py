"""HTTP connections that have to get on: a head that is not sent, or an answer that is not read, ends them."""

from __future__ import annotations

import asyncio
from typing import Any, cast

import h11
from uvicorn.protocols.http.h11_impl import H11Protocol

HEAD = 10.0  # s from a connection's opening, or from its last answer, to the end of a request's head
STALL = 30.0  # s in which a client has to take some 50 kB of an answer


class Connection(H11Protocol):
    """uvicorn's connection, with a limit on what it waits for.

    Where there are as many connections as may be, a new one takes the place of the one that has been waiting longest
    for a head: who holds connections open without asking anything keeps nobody out.
    """

    def __init__(self, *arguments: Any, **named: Any):
        super().__init__(*arguments, **named)
        self._head: asyncio.TimerHandle | None = None
        self._stall: asyncio.TimerHandle | None = None

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """Begin to wait for a head."""
        super().connection_made(transport)
        self._watch()
        if self.limit_concurrency is not None and len(self.connections) >= self.limit_concurrency:
            self._take_the_place_of_another()

    def connection_lost(self, exc: Exception | None) -> None:
        """Wait for nothing more."""
        self._end_head()
        self._end_stall()
        super().connection_lost(exc)

    def data_received(self, data: bytes) -> None:
        """Take what came, which may have been the end of a head."""
        super().data_received(data)
        self._watch()

    def on_response_complete(self) -> None:
        """Begin to wait for the next head, or for the client to take the rest of the answer."""
        super().on_response_complete()
        self._watch()

    def pause_writing(self) -> None:
        """Begin to wait for the client to read."""
        super().pause_writing()
        self._stall = self._stall or self.loop.call_later(STALL, self.transport.abort)

    def resume_writing(self) -> None:
        """Go on: the client reads."""
        self._end_stall()
        super().resume_writing()

    def _watch(self) -> None:
        if self.conn.their_state is h11.IDLE or self.transport.is_closing():
            self._head = self._head or self.loop.call_later(HEAD, self.transport.abort)
        else:
            self._end_head()

    def _take_the_place_of_another(self) -> None:
        others = cast("set[Connection]", self.connections - {self})
        waiting = {other: other._head.when() for other in others if other._head is not None}
        if waiting:
            longest = min(waiting, key=lambda other: waiting[other])
            longest.transport.abort()
            self.connections.discard(longest)  # now: others may come before its end is told

    def _end_head(self) -> None:
        if self._head is not None:
            self._head.cancel()
            self._head = None

    def _end_stall(self) -> None:
        if self._stall is not None:
            self._stall.cancel()
            self._stall = None

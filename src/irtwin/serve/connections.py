"""HTTP connections that have to get on: a head that is not sent, or an answer that is not read, ends them."""

from __future__ import annotations

import asyncio
from collections import Counter
from typing import Any, cast

import h11
from uvicorn.protocols.http.h11_impl import H11Protocol

from irtwin.serve.shares import Displaced, client_of, gives_way

HEAD = 10.0  # s from a connection's opening, or from its last answer, to the end of a request's head
STALL = 30.0  # s in which a client has to take some 50 kB of an answer


class TimedConnection(H11Protocol):
    """uvicorn's connection, with a limit on what it waits for.

    Where there are as many connections as may be, a new one takes the place of one of the client that has most: of the
    one that has been waiting longest for a head, else of the newest. A client that has as many as any other gives up
    one of its own that waits. So who holds connections open, with a request or without, keeps nobody else out.
    """

    def __init__(self, *arguments: Any, **named: Any):
        super().__init__(*arguments, **named)
        self._head: asyncio.TimerHandle | None = None
        self._stall: asyncio.TimerHandle | None = None
        self._of = ""  # its client
        self._opened = 0.0  # by the loop's clock

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """Begin to wait for a head."""
        super().connection_made(transport)
        self._of = client_of(self.client[0] if self.client is not None else "")
        self._opened = self.loop.time()
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
        others = cast("set[TimedConnection]", self.connections - {self})
        try:
            most = gives_way(Counter(other._of for other in others), self._of)
        except Displaced:
            most = self._of
        theirs = [other for other in others if other._of == most]
        waiting = {other: other._head.when() for other in theirs if other._head is not None}
        if waiting:
            self._end(min(waiting, key=lambda other: waiting[other]))
        elif most != self._of:
            self._end(max(theirs, key=lambda other: other._opened))

    def _end(self, other: TimedConnection) -> None:
        other.transport.abort()
        self.connections.discard(other)  # now: others may come before its end is told

    def _end_head(self) -> None:
        if self._head is not None:
            self._head.cancel()
            self._head = None

    def _end_stall(self) -> None:
        if self._stall is not None:
            self._stall.cancel()
            self._stall = None

"""An answer on its way from a worker, which is quick, to a client, which may be slow."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Iterator
from contextlib import contextmanager
from tempfile import SpooledTemporaryFile

IN_MEMORY = 4 << 20  # bytes of an answer; what its client has not taken beyond them lies in a temporary file
_PIECE = 1 << 16  # bytes


class Reply:
    """The bytes that the client has not taken yet.

    `whole` once the last of them is there, `broken_off` where it never will be.
    """

    def __init__(self) -> None:
        self.whole = False
        self.broken_off = False
        self._file = SpooledTemporaryFile(max_size=IN_MEMORY)  # noqa: SIM115 `close` ends it
        self._written = self._read = 0
        self._news = asyncio.Event()

    @property
    def waiting(self) -> int:
        """How many bytes wait for the client."""
        return self._written - self._read

    def write(self, data: bytes) -> None:
        """Take a piece; OSError where it finds no room."""
        if not self.waiting:
            self._written = self._read = 0
        self._file.seek(self._written)
        self._file.write(data)
        self._written += len(data)
        self._news.set()

    def end(self) -> None:
        """Say that all has been written."""
        self.whole = True
        self._news.set()

    def break_off(self) -> None:
        """Give up: what waits is not to be sent, and the answer is never whole."""
        self.broken_off, self._written = True, self._read
        self._news.set()

    async def pieces(self) -> AsyncIterator[bytes]:
        """Give the bytes as they come, till the end or the giving up."""
        while True:
            if self.waiting:
                self._file.seek(self._read)
                piece = self._file.read(min(_PIECE, self.waiting))
                self._read += len(piece)
                yield piece
            elif self.whole or self.broken_off:
                return
            else:
                self._news.clear()
                await self._news.wait()

    def close(self) -> None:
        """Let go of the file."""
        self._file.close()


class Replies:
    """The answers under way, which have some room together; the one that takes most of it is given up first."""

    def __init__(self, room: int):
        self._room = room
        self._under_way: set[Reply] = set()

    @contextmanager
    def new(self) -> Iterator[Reply]:
        """Give an answer, until it is sent."""
        answer = Reply()
        self._under_way.add(answer)
        try:
            yield answer
        finally:
            self._under_way.discard(answer)
            answer.close()

    def make_room(self) -> None:
        """Give answers up until the others fit."""
        while sum(answer.waiting for answer in self._under_way) > self._room:
            max(self._under_way, key=lambda answer: answer.waiting).break_off()

"""The worker processes: lent to one query at a time, ended and replaced where a query must not go on."""

from __future__ import annotations

import asyncio
import json
import logging
import os
import signal
import sys
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager, suppress
from dataclasses import asdict, dataclass
from typing import Any, TypeVar

from irtwin.knowledge.store.readable import NOT_READABLE
from irtwin.knowledge.store.snapshot import remove_left_behind
from irtwin.location import Location
from irtwin.serve.protocol import Operation, Refusal
from irtwin.serve.shares import Displaced
from irtwin.serve.turns import Turns
from irtwin.serve.worker import FRAME

_log = logging.getLogger(__name__)
_RETRY_AFTER = {"Retry-After": "2"}  # s
_TRIES = 3  # workers that may be lost before they begin
T = TypeVar("T")


@dataclass(frozen=True)
class Limits:
    """What a query may use, and how many may wait."""

    seconds: float = 30.0  # to wait for a worker; then again, to the last byte of the answer
    memory: int = 1 << 30  # bytes of one worker
    answer: int = 256 << 20  # bytes
    request: int = 1 << 20  # bytes
    waiting: int = 64  # queries
    services: tuple[str, ...] = ()  # IRIs of endpoints that it may ask by SERVICE


@dataclass(frozen=True)
class AnswerHead:
    """What is known of an answer before its bytes: media type, how the graph stands (`irtwin.asking`), and its ETag.

    The ETag is made of the answer, where all was there before its first byte left, else of the query and the state of
    the graph, where these say what it is.
    """

    media_type: str
    standing: str | None
    etag: str | None


class NotBegun(Exception):
    """A worker that was lost before it began with a query: another one may take it."""


async def begun(ask: Callable[[], Awaitable[T]]) -> T:
    """Ask, and once more where a worker was lost before it began. Raises Refusal where that goes on."""
    for _ in range(_TRIES):
        with suppress(NotBegun):
            return await ask()
    raise Refusal(503, "the graph cannot be read just now: try again later", _RETRY_AFTER)


class Worker:
    """One worker process."""

    def __init__(self, process: asyncio.subprocess.Process, limits: Limits):
        self._process = process
        self._limits = limits
        self.idle = True  # nothing of an answer is on its way

    @classmethod
    async def start(cls, location: Location, limits: Limits) -> Worker:
        """Start a process, and wait until it has opened the graph."""
        arguments = map(str, (limits.memory, limits.seconds, limits.answer, *limits.services))
        process = await asyncio.create_subprocess_exec(
            *(sys.executable, "-m", "irtwin.serve.worker", *arguments),
            stdin=asyncio.subprocess.PIPE,
            stdout=asyncio.subprocess.PIPE,
            # Memory that cannot be had is no bug to trace; Arrow's own pool would take 1 GB at once, a worker's all.
            env={**os.environ, "RUST_BACKTRACE": "0", "ARROW_DEFAULT_MEMORY_POOL": "system"},
            start_new_session=True,  # Ctrl-C in the terminal is the server's alone
        )
        worker = cls(process, limits)
        worker._write(location.telling())
        await worker._frame()
        return worker

    @property
    def pid(self) -> int:
        """The process' id."""
        return self._process.pid

    @property
    def alive(self) -> bool:
        """Whether the process is there."""
        return self._process.returncode is None

    async def ask(self, query: Operation, base: str, accept: str, at_once: bool) -> AnswerHead:
        """Send a query; return the head of the answer, whose bytes `pieces` gives. Raises Refusal, NotBegun.

        Relative IRIs are below `base`; `at_once`: of the graph as it is now, not half a second ago.
        """
        self.idle = False
        self._write({**asdict(query), "base": base, "accept": accept, "at_once": at_once})
        try:
            kind, data = await self._frame()
        except Refusal:
            raise NotBegun from None
        if kind == b"B":
            _, data = await self._frame()
        head = json.loads(data)
        if "status" in head:
            self.idle = True
            raise Refusal(head["status"], head["message"])
        return AnswerHead(**head)

    async def pieces(self) -> AsyncIterator[bytes]:
        """Give the answer's bytes as they come; Refusal where they end too early."""
        while True:
            kind, data = await self._frame()
            if kind == b"E":
                self.idle = True
                return
            yield data

    async def end(self) -> None:
        """End the process, whatever it is doing."""
        assert self._process.stdout is not None
        if self._process.returncode is None:
            self._process.kill()
        await self._process.stdout.read()  # asyncio takes a process for ended only once its pipes are empty
        await self._process.wait()

    def _write(self, document: dict[str, Any]) -> None:
        assert self._process.stdin is not None
        self._process.stdin.write(json.dumps(document).encode() + b"\n")

    async def _frame(self) -> tuple[bytes, bytes]:
        assert self._process.stdout is not None
        try:
            kind, size = FRAME.unpack(await self._process.stdout.readexactly(FRAME.size))
            return kind, await self._process.stdout.readexactly(size)
        except (asyncio.IncompleteReadError, ConnectionError):
            raise self._epitaph(await self._process.wait()) from None

    def _epitaph(self, status: int) -> Refusal:
        if status == -signal.SIGABRT:
            return Refusal(503, f"the query needs more than {self._limits.memory >> 20} MB of memory: ask for less")
        if status == -signal.SIGSEGV:
            return Refusal(400, f"the query {NOT_READABLE}")
        return Refusal(500, f"the query was lost: its worker ended with status {status}; ask again")


class Pool:
    """A fixed number of workers, and a queue of bounded length before them, in which clients take turns.

    Where there are several, no client holds the last one: a small query need not wait for another client's large ones.
    A worker that a query ended counts as its client's until another stands in its place.
    """

    def __init__(self, location: Location, size: int, limits: Limits):
        self._location = location
        self._size = size
        self._limits = limits
        self._idle: Turns[Worker] = Turns(limits.waiting, max(1, size - 1))
        self._starting: set[asyncio.Task[None]] = set()
        self.workers: set[Worker] = set()

    async def open(self) -> None:
        """Start the workers."""
        await asyncio.gather(*(self._start() for _ in range(self._size)))

    async def close(self) -> None:
        """End the workers, and what they do."""
        for task in self._starting:
            task.cancel()
        await asyncio.gather(*(worker.end() for worker in self.workers))
        remove_left_behind(self._location.graph_folder)

    @asynccontextmanager
    async def worker(self, client: str) -> AsyncIterator[Worker]:
        """Lend a worker to a client, by its address; one that is not done when it is given back is ended.

        Raises Refusal where all are taken.
        """
        worker = await self._wait(client)
        try:
            yield worker
        finally:
            if worker.idle and worker.alive:
                self._idle.give(client, worker)
            else:
                self._replace(worker, client)

    async def _wait(self, client: str) -> Worker:
        try:
            async with asyncio.timeout(self._limits.seconds):
                while not (worker := await self._idle.take(client)).alive:
                    self._replace(worker, client)
                return worker
        except TimeoutError:
            raise Refusal(503, "no worker came free in time: try again later", _RETRY_AFTER) from None
        except Displaced:
            raise Refusal(503, "too many queries are waiting: try again later", _RETRY_AFTER) from None

    def _replace(self, worker: Worker, client: str) -> None:
        async def replace() -> None:
            await worker.end()
            self.workers.discard(worker)
            while True:
                try:
                    await self._start()
                    return self._idle.lose(client)
                except Refusal as error:
                    _log.error("no worker can be started: %s", error.message)
                    await asyncio.sleep(1.0)

        task = asyncio.create_task(replace())
        self._starting.add(task)
        task.add_done_callback(self._starting.discard)

    async def _start(self) -> None:
        worker = await Worker.start(self._location, self._limits)
        self.workers.add(worker)
        self._idle.add(worker)

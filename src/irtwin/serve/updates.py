"""SPARQL updates: for who has the token, one at a time, each in a process of its own that can be ended.

What that process does is in `irtwin.asserting`, which stands above this room. It is forked from one that has imported
it: to import takes three times as long as most updates.
"""

from __future__ import annotations

import asyncio
import hmac
import json
import os
import signal
import sys
import time
from asyncio.subprocess import PIPE, Process
from contextlib import suppress
from dataclasses import asdict

from irtwin.knowledge.store.snapshot import OLDEST
from irtwin.location import Location
from irtwin.serve.pool import Limits
from irtwin.serve.protocol import Operation, Refusal

NOBODY = "who has the token"  # where the request has no From
_LONGEST_NAME = 200  # characters


class Updates:
    """The way in for updates; closed where there is no token."""

    def __init__(self, location: Location, token: str | None, limits: Limits):
        self._location = location
        self._token = token
        self._limits = limits
        self._turn = asyncio.Lock()
        self._last = -float("inf")
        self._process: Process | None = None

    @property
    def allowed(self) -> bool:
        """Whether the endpoint takes updates at all."""
        return self._token is not None

    @property
    def just_now(self) -> bool:
        """Whether an update is so young that a worker may not have seen it."""
        return time.monotonic() - self._last < 2 * OLDEST

    def admit(self, authorization: str) -> None:
        """Raise Refusal where this is not who may update."""
        if self._token is None:
            raise Refusal(403, "this endpoint is read-only")
        if not hmac.compare_digest(authorization.encode(), f"Bearer {self._token}".encode()):
            raise Refusal(401, "an update needs the token: Authorization: Bearer TOKEN", {"WWW-Authenticate": "Bearer"})

    async def do(self, operation: Operation, base: str, authorization: str, author: str) -> None:
        """Do an update, whole or not at all; relative IRIs are below `base`. Raises Refusal.

        It is over when the graph says what the database has been told.
        """
        self.admit(authorization)
        async with self._turn:
            await self._run(
                {**asdict(operation), "location": self._location.telling(), "base": base, "author": _named(author)}
            )
            self._last = time.monotonic()

    async def close(self) -> None:
        """End the processes."""
        if self._process is not None:
            await _end(self._process)

    async def _run(self, request: dict[str, object]) -> None:
        process, self._process = self._process, None
        if process is None or process.returncode is not None:
            command = (sys.executable, "-m", "irtwin.asserting", str(self._limits.memory))
            process = await asyncio.create_subprocess_exec(*command, stdin=PIPE, stdout=PIPE, start_new_session=True)
        assert process.stdin is not None and process.stdout is not None
        try:
            async with asyncio.timeout(self._limits.seconds):
                process.stdin.write(json.dumps(request).encode() + b"\n")
                line = await process.stdout.readline()
            if line.strip():
                await process.stdout.readline()  # once the graph has followed
            if line:
                self._process = process
        except TimeoutError:
            raise Refusal(503, f"the update was cancelled after {self._limits.seconds:g} s; nothing changed") from None
        finally:
            if self._process is None:
                await _end(process)
        if not line.strip():
            raise Refusal(500, "the update failed: too deeply nested, or out of memory; nothing changed")
        answer = json.loads(line)
        if answer:
            raise Refusal(answer["status"], answer["message"], answer["headers"])


async def _end(process: Process) -> None:
    """End a process and what it forked."""
    with suppress(ProcessLookupError):
        os.killpg(process.pid, signal.SIGKILL)
    await process.wait()


def _named(author: str) -> str:
    """Return who asserts, as the request says, on one line."""
    readable = "".join(letter for letter in author if letter.isprintable()).strip()
    return readable[:_LONGEST_NAME] or NOBODY

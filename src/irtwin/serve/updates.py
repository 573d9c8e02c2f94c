"""SPARQL updates: for who has the token, one at a time, each in a process of its own that can be ended.

What that process does is in `irtwin.asserting`, which stands above this room.
"""

from __future__ import annotations

import asyncio
import hmac
import json
import sys
import time
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

    async def _run(self, request: dict[str, object]) -> None:
        process = await asyncio.create_subprocess_exec(
            *(sys.executable, "-m", "irtwin.asserting", str(self._limits.memory)),
            stdin=asyncio.subprocess.PIPE,
            stdout=asyncio.subprocess.PIPE,
            start_new_session=True,
        )
        assert process.stdin is not None and process.stdout is not None
        try:
            async with asyncio.timeout(self._limits.seconds):
                process.stdin.write(json.dumps(request).encode())
                process.stdin.write_eof()
                line = await process.stdout.readline()
            if line:
                await process.wait()
        except TimeoutError:
            raise Refusal(503, f"the update was cancelled after {self._limits.seconds:g} s; nothing changed") from None
        finally:
            if process.returncode is None:
                process.kill()
                await process.wait()
        if not line:
            raise Refusal(500, "the update failed: too deeply nested, or out of memory; nothing changed")
        answer = json.loads(line)
        if answer:
            raise Refusal(answer["status"], answer["message"], answer["headers"])


def _named(author: str) -> str:
    """Return who asserts, as the request says, on one line."""
    readable = "".join(letter for letter in author if letter.isprintable()).strip()
    return readable[:_LONGEST_NAME] or NOBODY

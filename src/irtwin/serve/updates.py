"""SPARQL updates: for who has the token, one at a time, each in a process of its own that can be ended."""

from __future__ import annotations

import asyncio
import hmac
import json
import sys
import time
from dataclasses import asdict

from irtwin.errors import InputError
from irtwin.knowledge.store.no_network import leave_network
from irtwin.knowledge.store.snapshot import OLDEST
from irtwin.knowledge.store.sparql_server import ServerFault
from irtwin.limits import limit_memory
from irtwin.serve.pool import Limits
from irtwin.serve.protocol import Operation, Refusal
from irtwin.serve.source import Source
from irtwin.serve.worker import SERVER_FAILS


class Updates:
    """The way in for updates; closed where there is no token."""

    def __init__(self, source: Source, token: str | None, limits: Limits):
        self._source = source
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

    async def do(self, operation: Operation, base: str, authorization: str) -> None:
        """Do an update, whole or not at all; relative IRIs are below `base`. Raises Refusal."""
        if self._token is None:
            raise Refusal(403, "this endpoint is read-only")
        if not hmac.compare_digest(authorization.encode(), f"Bearer {self._token}".encode()):
            raise Refusal(401, "an update needs the token: Authorization: Bearer TOKEN", {"WWW-Authenticate": "Bearer"})
        async with self._turn:
            await self._run({**asdict(operation), "base": base, "source": self._source.telling()})
            self._last = time.monotonic()

    async def _run(self, request: dict[str, object]) -> None:
        process = await asyncio.create_subprocess_exec(
            *(sys.executable, "-m", "irtwin.serve.updates", str(self._limits.memory)),
            stdin=asyncio.subprocess.PIPE,
            stdout=asyncio.subprocess.PIPE,
            start_new_session=True,
        )
        try:
            async with asyncio.timeout(self._limits.seconds):
                out, _ = await process.communicate(json.dumps(request).encode())
        except TimeoutError:
            raise Refusal(503, f"the update was cancelled after {self._limits.seconds:g} s; nothing changed") from None
        finally:
            if process.returncode is None:
                process.kill()
                await process.wait()
        if process.returncode != 0:
            raise Refusal(500, "the update failed: too deeply nested, or out of memory; nothing changed")
        answer = json.loads(out)
        if answer:
            raise Refusal(answer["status"], answer["message"], answer["headers"])


def main(memory: int) -> None:
    """Do the update on standard input; write what is wrong with it. Both are JSON."""
    request = json.load(sys.stdin.buffer)
    source = Source.told(request["source"])
    if not source.needs_network:
        leave_network()
    answer: dict[str, object] = {}
    try:
        graph = source.writing()
    except ServerFault as error:
        answer = _server_fails(error)
    except InputError:
        message = "another process is writing the graph: try again later"
        answer = {"status": 503, "message": message, "headers": {"Retry-After": "5"}}
    else:
        with graph:
            limit_memory(memory)
            try:
                graph.update(request["text"], request["default_graphs"], request["named_graphs"], base=request["base"])
            except ServerFault as error:
                answer = _server_fails(error)
            except InputError as error:
                answer = {"status": 400, "message": str(error), "headers": {}}
    json.dump(answer, sys.stdout)


def _server_fails(error: ServerFault) -> dict[str, object]:
    print(f"irtwin: {error}", file=sys.stderr)
    return {"status": 502, "message": SERVER_FAILS, "headers": {}}


if __name__ == "__main__":
    main(int(sys.argv[1]))

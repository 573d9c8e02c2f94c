"""A process that answers one query at a time, so that a query can be ended for real: by ending the process.

Oxigraph cannot be told to stop. The server writes one line of JSON to standard input that says where the graph is, and
one for each query, and reads frames from standard output: a letter, the length of what follows, and that. `B` says that
the query begins, `H` is a head (JSON), `D` a piece of the answer, `E` the end. A head with a `status` is a refusal, and
all that comes. Where a SPARQL server keeps the graph, a query that is ended here may go on there, up to its own limit.

By SERVICE a query may ask the endpoints that the server was started with. Oxigraph sends them what stands in the clause
and no header of ours, and follows no redirect.
"""

from __future__ import annotations

import hashlib
import json
import math
import signal
import struct
import sys
from collections.abc import Collection
from contextlib import suppress
from typing import IO, Any, cast

from pyoxigraph import QueryBoolean, QueryResultsFormat, QuerySolutions, RdfFormat, serialize

from irtwin.asking import reading, standing
from irtwin.errors import InputError
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.knowledge.store.no_network import leave_network
from irtwin.knowledge.store.sparql_server import ServerFault
from irtwin.limits import limit_memory, limit_processor_time
from irtwin.location import Location
from irtwin.serve import negotiation
from irtwin.serve.protocol import SERVER_FAILS, Refusal
from irtwin.storage import windows  # noqa: F401  # before the memory is limited, not with the first query for samples

FRAME = struct.Struct(">cI")
_MOST_KEPT = 1 << 16  # bytes of an answer that is kept
_PIECE = 1 << 20  # bytes; a failure before the first piece is full can still be told as such


class _Sink:
    """A binary file that sends what is written to it in frames, the head before the first."""

    def __init__(self, out: IO[bytes], most_bytes: int):
        self.media_type = ""
        self.standing: str | None = None  # of the graph that answers
        self.begun = False
        self.small: bytes | None = None  # the whole answer, where it may be kept
        self._out = out
        self._left = most_bytes
        self._held = bytearray()
        self._etag: str | None = None
        self.asked: str | None = None  # what was asked of which state of the graph, where that names the answer

    def write(self, data: bytes) -> int:
        self._left -= len(data)
        if self._left < 0:
            raise Refusal(503, "the answer is larger than this endpoint sends: add a LIMIT, or ask for less")
        self._held += data
        if len(self._held) >= _PIECE:
            self._send()
        return len(data)

    def flush(self) -> None:
        """Leave it to `end`: pieces are sent when they are full."""

    def end(self) -> None:
        if not self.begun and len(self._held) <= _MOST_KEPT:
            self.small = bytes(self._held)
        if not self.begun:
            self._etag = self._named(self._held)
        self._send()
        _frame(self._out, b"E", b"")

    def _named(self, of: bytes | bytearray) -> str:
        named = hashlib.sha256(self.media_type.encode() + b"\0" + of)
        return f'W/"{named.hexdigest()[:32]}"'

    def _send(self) -> None:
        if not self.begun:
            if self._etag is None and self.asked is not None:
                self._etag = self._named(self.asked.encode())
            head = {"media_type": self.media_type, "standing": self.standing, "etag": self._etag}
            _frame(self._out, b"H", json.dumps(head).encode())
            self.begun = True
        _frame(self._out, b"D", bytes(self._held))
        self._held.clear()


def main(memory: int, seconds: float, most_bytes: int, services: Collection[str]) -> None:
    """Answer queries until standard input ends; bytes of memory and seconds for each; `services` they may ask."""
    out = sys.stdout.buffer
    location = Location.told(json.loads(sys.stdin.buffer.readline()))
    if location.graph_url is None and not services:
        leave_network()
    with reading(location) as current:
        limit_memory(memory)
        _frame(out, b"H", b"{}")
        for line in sys.stdin.buffer:
            limit_processor_time(seconds)
            request = json.loads(line)
            sink = _Sink(out, most_bytes)
            try:
                graph = current(request["at_once"])
                _frame(out, b"B", b"")
                sink.standing = standing(graph, location.folder)
                if services and "service" in request["text"].lower():
                    signal.alarm(math.ceil(seconds) + 1)  # ends what waits for another server, should ours be gone
                    _answer_from_elsewhere(graph, request, sink, services)
                else:
                    _answer_once(graph, request, sink)
            except (Refusal, InputError, MemoryError, OSError, RuntimeError) as error:
                if sink.begun:
                    sys.exit(f"irtwin: an answer was broken off: {error}")
                _refuse(out, error)


def _answer_once(graph: KnowledgeGraph, request: dict[str, Any], sink: _Sink) -> None:
    """Answer as before where the graph has not changed since; keep an answer that is small."""
    answers, asked = graph.answers, (request["text"], json.dumps({**request, "at_once": None}, sort_keys=True))
    if graph.seen is not None and answers.can_keep(request["text"]):
        sink.asked = graph.seen + asked[1]
    kept = answers.get(*asked)
    if kept is None:
        _answer(graph, request, sink)
        if sink.small is not None:
            answers.keep((sink.media_type, sink.small), *asked)
    else:
        sink.media_type, body = kept
        sink.write(body)
        sink.end()


def _answer_from_elsewhere(
    graph: KnowledgeGraph, request: dict[str, Any], sink: _Sink, services: Collection[str]
) -> None:
    """Answer a query that may ask other servers: not as before, as they may have changed."""
    try:
        _answer(graph, request, sink, services)
    except (OSError, RuntimeError) as error:
        said = str(error).partition("\n")[0].removesuffix(" with payload:")[:300]
        raise Refusal(502, f"a server that SERVICE names does not answer this: {said}") from None
    finally:
        signal.alarm(0)


def _answer(graph: KnowledgeGraph, request: dict[str, Any], sink: _Sink, services: Collection[str] = ()) -> None:
    graphs = request["default_graphs"], request["named_graphs"]
    answer = graph.answer(request["text"], *graphs, base=request["base"], services=services)
    file, accept = cast(IO[bytes], sink), request["accept"]
    if isinstance(answer, QuerySolutions | QueryBoolean):
        sink.media_type = negotiation.chosen(accept, negotiation.SOLUTIONS, "this answer")
        answer.serialize(file, format=QueryResultsFormat.from_media_type(sink.media_type))
    else:
        sink.media_type = negotiation.chosen(accept, negotiation.TRIPLES, "this answer")
        serialize(answer, file, format=RdfFormat.from_media_type(sink.media_type), prefixes=graph.prefixes)
    sink.end()


def _refuse(out: IO[bytes], error: Exception) -> None:
    status = error.status if isinstance(error, Refusal) else 400 if isinstance(error, InputError) else 500
    message = "the query needs more memory than it may have" if isinstance(error, MemoryError) else str(error)
    if isinstance(error, ServerFault):  # where the server is concerns who runs this one
        print(f"irtwin: {error}", file=sys.stderr)
        status, message = 502, SERVER_FAILS
    _frame(out, b"H", json.dumps({"status": status, "message": message}).encode())


def _frame(out: IO[bytes], kind: bytes, data: bytes) -> None:
    out.write(FRAME.pack(kind, len(data)) + data)
    out.flush()


if __name__ == "__main__":
    with suppress(BrokenPipeError):  # the server is gone
        try:
            main(int(sys.argv[1]), float(sys.argv[2]), int(sys.argv[3]), sys.argv[4:])
        except InputError as error:  # the graph has gone since the server began
            sys.exit(f"irtwin: {error}")

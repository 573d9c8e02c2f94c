"""`/sparql`: a request in, the worker's answer streamed out, or one line that says why not."""

from __future__ import annotations

import asyncio
import logging
import time
from collections.abc import Sequence
from contextlib import ExitStack

from pyoxigraph import NamedNode, RdfFormat, parse, serialize
from starlette.requests import ClientDisconnect, Request
from starlette.responses import PlainTextResponse, Response
from starlette.types import Receive, Scope, Send

from irtwin.serve import graph_store, negotiation, page
from irtwin.serve.answer import Replies, Reply
from irtwin.serve.asking import Asking
from irtwin.serve.guard import note
from irtwin.serve.pool import AnswerHead, Limits, Pool, Worker, begun
from irtwin.serve.protocol import Operation, Refusal, read_body, read_get, read_parameters, read_post
from irtwin.serve.shares import client
from irtwin.serve.updates import Updates

_METHODS = "GET, HEAD, POST, OPTIONS"
_METHODS_OF_GRAPH = "GET, HEAD, PUT, POST, DELETE, OPTIONS"
_ROOM = 4  # largest answers that may wait for their clients
_NAMED_GRAPHS = "SELECT ?graph WHERE { GRAPH ?graph { } } ORDER BY ?graph"
_PREFIXES = {"sd": "http://www.w3.org/ns/sparql-service-description#", "formats": "http://www.w3.org/ns/formats/"}
_SERVICE = """
[] a sd:Service ; sd:endpoint %s ; sd:supportedLanguage %s ; sd:feature %s ;
  sd:resultFormat formats:SPARQL_Results_JSON, formats:SPARQL_Results_XML, formats:SPARQL_Results_CSV,
    formats:SPARQL_Results_TSV, formats:Turtle, formats:N-Triples, formats:RDF_XML, formats:JSON-LD ;
  sd:defaultDataset [ a sd:Dataset ; sd:defaultGraph [ a sd:Graph ] %s ] .
"""

_log = logging.getLogger(__name__)


class Endpoint:
    """An ASGI application that speaks the SPARQL 1.1 Protocol."""

    def __init__(self, pool: Pool, updates: Updates, limits: Limits, asking: Asking):
        self._pool, self._asking = pool, asking
        self._updates = updates
        self._limits = limits
        self._answers = Replies(_ROOM * limits.answer)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer one request. A client that leaves ends its query."""
        request = Request(scope, receive)
        try:
            operation = await self._read(request)
        except Refusal as refusal:
            return await refused(refusal)(scope, receive, send)
        except ClientDisconnect:
            return
        answering = asyncio.create_task(self._respond(operation, request, send))
        leaving = asyncio.create_task(_left(receive))
        leaving.add_done_callback(lambda _: answering.cancel())
        try:
            await answering
        except asyncio.CancelledError:
            if not leaving.done():
                raise
        finally:
            leaving.cancel()

    async def _read(self, request: Request) -> Operation | None:
        """Read what is asked; None for the service itself."""
        query_string = request.scope["query_string"].decode("ascii", errors="replace")
        if graph_store.names_graph(parameters := read_parameters(query_string)):
            return await self._of_graph(request, parameters)
        if request.method in ("GET", "HEAD"):
            return read_get(query_string)
        if request.method == "POST":
            return read_post(request.headers.get("content-type", ""), query_string, await self._body(request))
        if request.method == "OPTIONS":
            raise Refusal(204, "", {"Allow": _METHODS})
        raise Refusal(405, f"{request.method} is not for this address", {"Allow": _METHODS})

    async def _of_graph(self, request: Request, parameters: graph_store.Parameters) -> Operation:
        """Read what is to be done with a graph; who may not change one is refused before he is listened to."""
        method = request.method
        if method in ("GET", "HEAD"):
            operation = graph_store.read(parameters)
            await self._check_there(request, operation.default_graphs)
            return operation
        if method == "OPTIONS":
            raise Refusal(204, "", {"Allow": _METHODS_OF_GRAPH})
        if method not in ("PUT", "POST", "DELETE"):
            raise Refusal(405, f"{method} is not for a graph", {"Allow": _METHODS_OF_GRAPH})
        self._updates.admit(request.headers.get("authorization", ""))
        if method == "DELETE":
            operation = graph_store.dropped(parameters)
            await self._check_there(request, parameters["graph"])
            return operation
        sent = request.headers.get("content-type", ""), await self._body(request), _address(request)
        change = graph_store.replaced if method == "PUT" else graph_store.merged
        return await asyncio.to_thread(change, parameters, *sent)

    async def _check_there(self, request: Request, graphs: Sequence[str]) -> None:
        for name in graphs:
            if not await self._asking.holds(request, "GRAPH ?graph { ?s ?p ?o }", {"graph": name}):
                raise Refusal(404, f"there is no graph {name}")

    async def _body(self, request: Request) -> bytes:
        return await read_body(request, self._limits.request, self._limits.seconds)

    async def _respond(self, operation: Operation | None, request: Request, send: Send) -> None:
        try:
            if operation is not None and operation.kind == "query":
                return await begun(lambda: self._stream(operation, request, send))
            response = await self._describe(request) if operation is None else await self._update(operation, request)
        except Refusal as refusal:
            response = refused(refusal)
        await response(request.scope, request.receive, send)

    async def _describe(self, request: Request) -> Response:
        accept = request.headers.get("accept", "")
        if negotiation.wants_page(accept):
            return page.response()
        _, graphs = await self._asking.written(request, _NAMED_GRAPHS, "text/csv")
        named = graphs.decode().splitlines()[1:]
        return _description(accept, _address(request), named, self._updates.allowed, bool(self._limits.services))

    async def _update(self, operation: Operation, request: Request) -> Response:
        headers = request.headers
        await self._updates.do(operation, _address(request), headers.get("authorization", ""), headers.get("from", ""))
        return Response(status_code=204)

    async def _stream(self, operation: Operation, request: Request, send: Send) -> None:
        """Take the answer off the worker as fast as it makes it; the client may take its time."""
        with self._answers.new() as answer, ExitStack() as held:
            async with self._pool.worker(client(request)) as worker:
                deadline = time.monotonic() + self._limits.seconds  # what it waited for a worker is not its own time
                head = await self._ask(worker, operation, request, deadline)
                sending = asyncio.create_task(_send(answer, head, request, send))
                held.callback(sending.cancel)
                try:
                    async with asyncio.timeout_at(deadline):
                        async for piece in worker.pieces():
                            answer.write(piece)
                            self._answers.make_room()
                            if answer.broken_off:
                                raise Refusal(503, "too much is waiting for clients that do not read")
                    answer.end()
                except (TimeoutError, Refusal, OSError) as error:
                    # The status is sent: all that can be done is not to end the body as if it were whole.
                    _log.warning("an answer was broken off: %s", error or f"after {self._limits.seconds:g} s")
                    answer.break_off()
            await sending

    async def _ask(self, worker: Worker, operation: Operation, request: Request, deadline: float) -> AnswerHead:
        """Ask a worker; return what is known of the answer."""
        accept = request.headers.get("accept", "")
        try:
            async with asyncio.timeout_at(deadline):
                head = await worker.ask(operation, _address(request), accept, self._updates.just_now)
        except TimeoutError:
            seconds = self._limits.seconds
            raise Refusal(503, f"the query was cancelled after {seconds:g} s: ask for less, or add a LIMIT") from None
        note(request, head.standing)
        return head


def _description(accept: str, address: str, graphs: Sequence[str], updates: bool, services: bool) -> Response:
    """Return the SPARQL 1.1 Service Description of the service at `address`, in the form that the client prefers."""
    media_type = negotiation.chosen(accept, negotiation.TRIPLES, "the description")
    languages = "sd:SPARQL11Query, sd:SPARQL11Update" if updates else "sd:SPARQL11Query"
    features = "sd:UnionDefaultGraph" + ", sd:BasicFederatedQuery" * services
    named = "".join(f"; sd:namedGraph [ a sd:NamedGraph ; sd:name {NamedNode(graph)} ]" for graph in graphs)
    prefixes = "".join(f"@prefix {name}: <{iri}> . " for name, iri in _PREFIXES.items())
    quads = parse(prefixes + _SERVICE % (NamedNode(address), languages, features, named), RdfFormat.TURTLE)
    form = RdfFormat.from_media_type(media_type)
    body = serialize((quad.triple for quad in quads), format=form, prefixes=_PREFIXES)
    return Response(body, media_type=media_type, headers={"Vary": "Accept"})


def refused(refusal: Refusal) -> Response:
    """Turn a refusal into a response of one line."""
    text = f"{refusal.message}\n" if refusal.message else None
    return PlainTextResponse(text, status_code=refusal.status, headers=refusal.headers)


async def _send(answer: Reply, head: AnswerHead, request: Request, send: Send) -> None:
    """Send an answer at its client's pace, or that he has it already; one that is broken off is not ended."""
    headers = {"Content-Type": _with_charset(head.media_type), "Vary": "Accept", "Cache-Control": "no-cache"}
    if head.etag is not None:
        headers["ETag"] = head.etag
    encoded = [(name.lower().encode(), value.encode()) for name, value in headers.items()]
    known = {tag.strip() for tag in request.headers.get("if-none-match", "").split(",")}
    is_known = head.etag in known and request.method != "POST"
    await send({"type": "http.response.start", "status": 304 if is_known else 200, "headers": encoded})
    async for piece in answer.pieces():
        if is_known:
            continue
        await send({"type": "http.response.body", "body": piece, "more_body": True})
    if answer.whole:
        await send({"type": "http.response.body", "body": b"", "more_body": False})


async def _left(receive: Receive) -> None:
    while (await receive())["type"] != "http.disconnect":
        pass


def _address(request: Request) -> str:
    """Return the endpoint's address as the client wrote it, which relative IRIs are below."""
    return str(request.url.replace(query=""))


def _with_charset(media_type: str) -> str:
    return f"{media_type}; charset=utf-8" if media_type.startswith("text/") else media_type

"""`irtwin serve`: the plant's pages, the endpoint and whatever has an IRI of ours behind one address."""

from __future__ import annotations

import asyncio
import ipaddress
import logging
import os
import signal
import socket
from collections.abc import AsyncIterator, Callable, Sequence
from contextlib import AbstractAsyncContextManager, asynccontextmanager, nullcontext
from functools import partial
from pathlib import Path
from types import FrameType

import uvicorn
from starlette.applications import Starlette
from starlette.exceptions import HTTPException
from starlette.middleware import Middleware
from starlette.middleware.gzip import GZipMiddleware
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import Route

from irtwin.announce import Announce
from irtwin.asking import checked, reading
from irtwin.errors import InputError
from irtwin.input_file import read_text
from irtwin.knowledge.questions.queries import named_questions
from irtwin.knowledge.vocabulary import GRAPH_SOURCE, ID
from irtwin.location import Location
from irtwin.report.plant.page import compile_templates
from irtwin.resources import Resources
from irtwin.serve import individuals, ontology, page
from irtwin.serve.asking import Asking
from irtwin.serve.catching_up import catch_up
from irtwin.serve.connections import TimedConnection
from irtwin.serve.endpoint import Endpoint, refused
from irtwin.serve.guard import Guard
from irtwin.serve.live_page import LivePages
from irtwin.serve.negotiation import wants_page
from irtwin.serve.plant_pages import PlantPages, refusal_page
from irtwin.serve.pool import Limits, Pool
from irtwin.serve.protocol import Refusal
from irtwin.serve.report_files import ReportFiles
from irtwin.serve.updates import Updates
from irtwin.storage.database import Workspace
from irtwin.storage.tariff import read_tariff

_GRACE = 3  # s that answers under way may still take when the server stops
_LONGEST_TOKEN = 100_000  # bytes
_SMALL = 2000  # bytes of an answer that is not worth to be packed
_LATE = "Cancel %s running task(s), timeout graceful shutdown exceeded"  # uvicorn's


def serve(
    location: Location,
    host: str,
    port: int,
    *,
    token: str | None,
    limits: Limits,
    announce: Announce,
    origins: Sequence[str] = (),
    opcua: int | None = None,
) -> None:
    """Serve a workspace's graph until SIGINT or SIGTERM; with `opcua` as an OPC UA server on that port, too.

    Pages of other sites may ask the endpoint where their origin is one of `origins`. Port 0 takes a free one;
    `announce` is told the endpoint's address once it answers. The graph is held against a database elsewhere first.
    Raises InputError where the graph is missing, the port is taken, or the tariff cannot be used.
    """
    base = _base(location)  # what cannot be read is said here, once, rather than by each worker
    read_tariff(location.folder)  # likewise: later, a page would say it
    listening = _bind(host, port)
    if opcua is not None:
        import irtwin.serve.opcua  # noqa: F401, an extra: what it lacks is said now

        _bind(host, opcua, "give --opcua another").close()
    bound = listening.getsockname()[1]
    address = f"http://{_in_url(host)}:{bound}/sparql"
    app = application(
        location,
        host,
        token=token,
        limits=limits,
        base=base,
        opened=lambda: announce(address),
        origins=origins,
        opcua=opcua,
    )
    config = uvicorn.Config(
        app,
        http=TimedConnection,
        log_level="error",
        access_log=False,
        server_header=False,
        limit_concurrency=4 * limits.waiting,
        timeout_graceful_shutdown=_GRACE,
        ws="none",
    )
    # uvicorn stops on these, then raises them again: both are the way to end this command, not a failure of it.
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: None)
    server = _Server(config, app.state.live_pages.samples.close)
    logging.getLogger("uvicorn.error").addFilter(_in_one_line)
    server.run(sockets=[listening])


def _base(location: Location) -> str:
    """Return the base of the graph's individuals.

    Raises InputError where the graph cannot be read or, with a database elsewhere, where that knows of robots and the
    graph does not.
    """
    knows = False
    if location.database is not None:
        with Workspace.existing(location) as place:
            knows = place.knows_robots()
            if location.graph_url is None:
                place.check_graph()
    with reading(location) as current:
        graph = current(False)
        if knows and not graph.graphs(GRAPH_SOURCE):
            raise InputError(
                f"{graph.store.shown}: the graph is empty, though the database knows of robots; "
                f"`irtwin workspace repair --workspace {location.folder}` with the same --database and --graph fills it"
            )
        return graph.base


class _Server(uvicorn.Server):
    """Lets pages that look on go as it stops: they would stay as long as they may."""

    def __init__(self, config: uvicorn.Config, let_go: Callable[[], None]) -> None:
        super().__init__(config)
        self._let_go = let_go

    def handle_exit(self, sig: int, frame: FrameType | None) -> None:
        """Begin to stop; who asks twice breaks off whatever is left, and knows."""
        super().handle_exit(sig, frame)
        if self.force_exit:
            logging.getLogger("uvicorn.error").setLevel(logging.CRITICAL)

    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        """Stop, within the time that answers under way may take."""
        self._let_go()
        await super().shutdown(sockets)


def _in_one_line(record: logging.LogRecord) -> bool:
    """Whether a record is said: not that an answer was broken off at the end, which is told of all together."""
    if record.msg == _LATE:
        record.msg = f"broken off after {_GRACE} s: %s of the answers under way"
    return not (record.exc_info and record.exc_info[0] is asyncio.CancelledError)


def read_token(file: Path | None) -> str | None:
    """Return the token for updates: from the file, else the environment's IRTWIN_TOKEN, else None."""
    if file is None:
        return os.environ.get("IRTWIN_TOKEN") or None
    token = read_text(file, _LONGEST_TOKEN).strip()
    if not token:
        raise InputError(f"{file}: the token file is empty; put a token into it")
    return token


def application(
    location: Location,
    host: str,
    *,
    token: str | None,
    limits: Limits,
    base: str = ID,
    opened: Callable[[], None] = lambda: None,
    origins: Sequence[str] = (),
    opcua: int | None = None,
) -> Starlette:
    """Return the ASGI application; its workers live between its start-up and its shutdown.

    base: what the IRIs of the graph's individuals begin with; origins: of other sites whose pages may ask the endpoint.
    """
    pool = Pool(location, 1 + max(2, os.cpu_count() or 2), limits)
    updates = Updates(location, token, limits)
    live = LivePages(location)
    resources = checked(location.folder)
    asking = Asking(pool, updates, limits, base)
    reports = ReportFiles(location.folder)
    plant = PlantPages(location.folder, asking, reports, updates, limits)

    @asynccontextmanager
    async def lifespan(_: Starlette) -> AsyncIterator[None]:
        try:
            await asyncio.gather(pool.open(), asyncio.to_thread(compile_templates, base))
            async with _opcua(asking, resources, host, opcua):
                opened()
                catching_up = asyncio.create_task(catch_up(asking, location))
                yield
                catching_up.cancel()
                await asyncio.gather(catching_up, return_exceptions=True)
        finally:
            live.samples.close()
            await updates.close()
            await pool.close()

    app = Starlette(
        routes=[
            *plant.routes(),
            Route("/query", lambda request: page.response(), methods=["GET"]),
            Route("/sparql", Endpoint(pool, updates, limits, asking)),
            Route("/questions", partial(ontology.questions, resources), methods=["GET"]),
            Route("/questions.json", partial(page.questions, resources, base), methods=["GET"]),
            *reports.routes(),
            *live.routes(),
            Route("/assets/{name}", page.asset, methods=["GET"]),
            *individuals.routes(asking, resources),
        ],
        middleware=[
            Middleware(Guard, local=_is_loopback(host), origins=frozenset(origins)),
            Middleware(GZipMiddleware, minimum_size=_SMALL, compresslevel=5),
        ],
        exception_handlers={Refusal: _refused, HTTPException: _no_page},
        lifespan=lifespan,
    )
    app.state.live_pages = live
    return app


def _opcua(asking: Asking, resources: Resources, host: str, port: int | None) -> AbstractAsyncContextManager[None]:
    if port is None:
        return nullcontext()
    from irtwin.serve.opcua import answering  # an extra

    return answering(asking, named_questions(resources)["plant_now"].text, host, port)


async def _refused(request: Request, error: Exception) -> Response:
    """Say why in one line; in a browser, on a page that leads back."""
    assert isinstance(error, Refusal)
    if error.message and wants_page(request.headers.get("accept", "")):
        return await refusal_page(error)
    return refused(error)


async def _no_page(request: Request, error: Exception) -> Response:
    assert isinstance(error, HTTPException)
    message = "there is no page at this address" if error.status_code == 404 else error.detail
    return await _refused(request, Refusal(error.status_code, message, error.headers))


def _bind(host: str, port: int, instead: str = "--port 0 picks a free one") -> socket.socket:
    try:
        family, kind, protocol, _, address = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0]
        listening = socket.socket(family, kind, protocol)
        listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        listening.bind(address)
        listening.listen()
    except (OSError, OverflowError) as error:
        reason = getattr(error, "strerror", None) or error
        raise InputError(f"cannot listen on {host}, port {port}: {reason}; {instead}") from None
    return listening


def _is_loopback(host: str) -> bool:
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"


def _in_url(host: str) -> str:
    return f"[{host}]" if ":" in host else host

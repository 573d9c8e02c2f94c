"""What every response says in its headers, how the graph stands among it, and which names the server answers to."""

from __future__ import annotations

from starlette.datastructures import MutableHeaders
from starlette.requests import Request
from starlette.responses import PlainTextResponse
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from irtwin.asking import BEHIND

STANDING = "Irtwin-Graph"  # a header: "behind" or "updating"; absent where the graph is whole
_LOCAL = {"localhost", "127.0.0.1", "[::1]"}
_HEADERS = {
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Content-Security-Policy": "default-src 'none'; frame-ancestors 'none'",
}


class Guard:
    """Adds security headers, and how the graph stands; refuses what pages of other sites ask.

    Those could not read the answer; pages of `origins` may ask the endpoint, and read its answers. With `local`, it
    answers only to this machine's own names.

    A page from elsewhere can have its own name resolve to 127.0.0.1 and then read what is served there as if it were
    its own (DNS rebinding): such a request carries that name in Host.
    """

    def __init__(self, app: ASGIApp, local: bool, origins: frozenset[str] = frozenset()):
        self._app = app
        self._local = local
        self._origins = origins

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass a request on, unless it is for another host."""
        if scope["type"] != "http":
            return await self._app(scope, receive, send)

        request = Request(scope)
        origin = request.headers.get("origin", "")
        is_welcome = origin in self._origins and request.url.path == "/sparql"

        async def send_guarded(message: Message) -> None:
            if message["type"] == "http.response.start":
                headers = MutableHeaders(scope=message)
                for name, value in _HEADERS.items():
                    headers.setdefault(name, value)
                if (standing := noted(request)) is not None:
                    headers[STANDING] = standing
                if is_welcome:
                    headers["Access-Control-Allow-Origin"] = origin
                    headers["Access-Control-Allow-Headers"] = "Accept, Content-Type"  # no token: pages only ask
                    headers["Cross-Origin-Resource-Policy"] = "cross-origin"
                    headers.add_vary_header("Origin")
            await send(message)

        if self._local and _host(request.headers.get("host", "")) not in _LOCAL:
            refusal = PlainTextResponse("this server answers to localhost only\n", status_code=421)
            return await refusal(scope, receive, send_guarded)
        if not is_welcome and _from_another_site(request):
            refusal = PlainTextResponse("this server does not answer to other sites' pages\n", status_code=403)
            return await refusal(scope, receive, send_guarded)
        await self._app(scope, receive, send_guarded)


def note(request: Request, standing: str | None) -> None:
    """Note how the graph stands by which a request is answered; what is worst of several is said."""
    if standing is not None and noted(request) != BEHIND:
        request.state.standing = standing


def noted(request: Request) -> str | None:
    """Return what was noted: "behind", "updating", or None where the graph was whole."""
    return getattr(request.state, "standing", None)


def _from_another_site(request: Request) -> bool:
    """Whether a browser says that another site's page asks; following a link there is the user's own doing."""
    headers = request.headers
    site = headers.get("sec-fetch-site")  # no page can forge it
    if site is None:  # no browser, an old one, or an address that it does not trust: Origin tells, where it is said
        origin = headers.get("origin")
        return origin is not None and origin.lower().partition("://")[2] != headers.get("host", "").lower()
    follows_link = headers.get("sec-fetch-mode") == "navigate" and headers.get("sec-fetch-dest") == "document"
    return site not in ("same-origin", "none") and not (request.method == "GET" and follows_link)


def _host(header: str) -> str:
    """Return the name in a Host header, without the port."""
    name, colon, port = header.rpartition(":")
    return (name if colon and port.isdecimal() else header).lower()

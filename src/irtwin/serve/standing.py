"""How the graph stood that a response is made of: a header says so where it was not whole."""

from __future__ import annotations

from starlette.datastructures import MutableHeaders
from starlette.requests import Request
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from irtwin.asking import BEHIND

HEADER = "Irtwin-Graph"  # "behind" or "updating"; absent where the graph is whole


class Standing:
    """Adds the header to responses of which `note` was told something."""

    def __init__(self, app: ASGIApp):
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass a request on."""

        async def send_told(message: Message) -> None:
            noted = scope.get("state", {}).get("standing")
            if message["type"] == "http.response.start" and noted is not None:
                MutableHeaders(scope=message)[HEADER] = noted
            await send(message)

        await self._app(scope, receive, send_told)


def note(request: Request, standing: str | None) -> None:
    """Note how the graph stands by which a request is answered; what is worst of several is said."""
    if standing is not None and noted(request) != BEHIND:
        request.state.standing = standing


def noted(request: Request) -> str | None:
    """Return what was noted: "behind", "updating", or None where the graph was whole."""
    return getattr(request.state, "standing", None)

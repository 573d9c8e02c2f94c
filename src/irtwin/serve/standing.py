"""How the graph stood that a response is made of; a header of the response says so where it was not whole."""

from __future__ import annotations

from starlette.requests import Request

from irtwin.asking import BEHIND

HEADER = "Irtwin-Graph"  # "behind" or "updating"; absent where the graph is whole


def note(request: Request, standing: str | None) -> None:
    """Note how the graph stands by which a request is answered; what is worst of several is said."""
    if standing is not None and noted(request) != BEHIND:
        request.state.standing = standing


def noted(request: Request) -> str | None:
    """Return what was noted: "behind", "updating", or None where the graph was whole."""
    return getattr(request.state, "standing", None)

"""The query page: the project's own few files around a packed YASGUI, all served from here."""

from __future__ import annotations

import gzip
import json
from functools import cache
from pathlib import Path

from starlette.requests import Request
from starlette.responses import Response

from irtwin.knowledge.questions.queries import named_questions
from irtwin.knowledge.vocabulary import PREFIXES
from irtwin.serve.protocol import Refusal

POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self' 'unsafe-inline'; img-src 'self' data:; font-src data:; "
    "connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)
_FOLDER = Path(__file__).parent / "assets"
_TYPES = {
    "page.css": "text/css",
    "page.js": "text/javascript",
    "yasgui.min.css": "text/css",
    "yasgui.min.js": "text/javascript",
}


def response() -> Response:
    """Return the page."""
    headers = {"Content-Security-Policy": POLICY, "Vary": "Accept"}
    return Response((_FOLDER / "page.html").read_bytes(), media_type="text/html", headers=headers)


def asset(request: Request) -> Response:
    """Return one of the page's files: those that are listed, so that no path leads elsewhere."""
    name = request.path_params["name"]
    if name not in _TYPES:
        raise Refusal(404, "no such file")
    content = _read(name)
    headers = {"Cache-Control": "no-cache", "Vary": "Accept-Encoding"}
    if "gzip" in request.headers.get("accept-encoding", ""):
        content, headers["Content-Encoding"] = _packed(name), "gzip"
    return Response(content, media_type=_TYPES[name], headers=headers)


def questions(request: Request) -> Response:
    """Return the named questions and the prefixes that they use."""
    known = [{"title": q.title, "question": q.question, "text": q.text} for q in named_questions().values()]
    return Response(json.dumps({"prefixes": PREFIXES, "questions": known}), media_type="application/json")


@cache
def _packed(name: str) -> bytes:
    packed = _FOLDER / f"{name}.gz"
    return packed.read_bytes() if packed.exists() else gzip.compress((_FOLDER / name).read_bytes(), mtime=0)


def _read(name: str) -> bytes:
    return gzip.decompress(_packed(name))

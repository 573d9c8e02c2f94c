"""The query page: the project's own few files around YASGUI's editor, all served from here."""

from __future__ import annotations

import gzip
import json
from collections.abc import Callable
from functools import cache, partial
from pathlib import Path

from starlette.requests import Request
from starlette.responses import Response

from irtwin.knowledge.questions.queries import named_questions
from irtwin.knowledge.vocabulary import prefixes
from irtwin.report.page import plotly, script
from irtwin.report.templates import style
from irtwin.report.wording import UNITS, WORDS
from irtwin.resources import Resources, shipped
from irtwin.serve.protocol import Refusal
from irtwin.virtual.robot_data import asset as scene_asset
from irtwin.virtual.robot_data import viewer_script

POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self' 'unsafe-inline'; img-src 'self' data:; font-src data:; "
    "connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)
FOLDER = Path(__file__).parent / "assets"
_TYPES = {".css": "text/css", ".js": "text/javascript"}
_MADE: dict[str, Callable[[], str]] = {  # of what other rooms have
    "meshcat.js": viewer_script,
    "plant.css": lambda: style(shipped(), "layout/style.css", "plant/style.css"),
    "plotly.js": plotly,
    "plotting.js": partial(script, "layout/plotting.js"),
    "robot.js": partial(scene_asset, "robot.js"),
}


@cache
def _names() -> frozenset[str]:
    """Return the names of the page's files: those that ship, and those that are made."""
    names = {file.name.removesuffix(".gz") for file in FOLDER.iterdir()} | _MADE.keys()
    return frozenset(name for name in names if Path(name).suffix in _TYPES)


def response() -> Response:
    """Return the page."""
    headers = {"Content-Security-Policy": POLICY, "Vary": "Accept"}
    return Response((FOLDER / "query.html").read_bytes(), media_type="text/html", headers=headers)


def asset(request: Request) -> Response:
    """Return one of the page's files: those that are there, so that no path leads elsewhere."""
    name = request.path_params["name"]
    if name not in _names():
        raise Refusal(404, "no such file")
    content, headers = _packed(name), {"Cache-Control": "no-cache", "Vary": "Accept-Encoding"}
    if "gzip" in request.headers.get("accept-encoding", ""):
        headers["Content-Encoding"] = "gzip"
    else:
        content = gzip.decompress(content)
    return Response(content, media_type=_TYPES[Path(name).suffix], headers=headers)


def questions(resources: Resources, base: str, request: Request) -> Response:
    """Return the named questions, the prefixes that they use, and what headings are made of."""
    known = [{"title": q.title, "question": q.question, "text": q.text} for q in named_questions(resources).values()]
    values = {"prefixes": prefixes(base), "questions": known, "headings": {"units": UNITS, "words": WORDS}}
    return Response(json.dumps(values), media_type="application/json")


@cache
def _packed(name: str) -> bytes:
    if name in _MADE:
        return gzip.compress(_MADE[name]().encode("utf-8"), mtime=0)
    packed = FOLDER / f"{name}.gz"
    return packed.read_bytes() if packed.exists() else gzip.compress((FOLDER / name).read_bytes(), mtime=0)

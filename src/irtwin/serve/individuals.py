"""What has an IRI of ours, at the same path here: /irtwin/id/robot/UR10 is a robot, or /energy/robot/UR10."""

from __future__ import annotations

import asyncio
import re
from functools import partial
from urllib.parse import unquote, urlsplit

from pyoxigraph import NamedNode
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import Route

from irtwin.knowledge.vocabulary import ONTOLOGY
from irtwin.report.plant import individual, page
from irtwin.report.questions import Answers
from irtwin.resources import Resources
from irtwin.serve import negotiation, ontology
from irtwin.serve.asking import Asking
from irtwin.serve.guard import noted
from irtwin.serve.plant_pages import html
from irtwin.serve.protocol import Refusal, named

_FORMS = {
    "ttl": "text/turtle", "jsonld": "application/ld+json", "nt": "application/n-triples", "rdf": "application/rdf+xml",
}  # fmt: skip
_NOT_ASCII = re.compile(r"(?:%[89A-Fa-f][0-9A-Fa-f])+")
_KNOWN = "{ ?individual ?property ?value } UNION { ?subject ?leads ?individual }"


def routes(asking: Asking, known: Resources) -> list[Route]:
    """Return where the ontology and the graph's individuals are."""
    paths = dict.fromkeys((urlsplit(ONTOLOGY).path, urlsplit(asking.base).path.removesuffix("/")))
    return [Route(f"{path}{{rest:path}}", partial(respond, asking, known), methods=["GET"]) for path in paths]


async def respond(asking: Asking, known: Resources, request: Request) -> Response:
    """Return what has the request's path for its IRI's, as a page or as RDF: a module of the ontology, an individual.

    Raises Refusal, where the graph does not know it too.
    """
    if request.url.path in ontology.paths():
        return await asyncio.to_thread(ontology.module, request, known)
    iri = _iri(request, asking.base)
    accept = _FORMS.get(request.query_params.get("as", ""), request.headers.get("accept", ""))
    if not await asking.holds(request, _KNOWN, {"individual": iri}):
        others = "" if iri.startswith(asking.base) else f"; of the ontology there are {', '.join(ontology.paths())}"
        raise Refusal(404, f"the graph knows nothing of {iri}{others}")
    if negotiation.wants_page(accept):
        answers = await asking.answers(request, page.questions("individual"), {"individual": iri})
        return await html(lambda: _page(iri, answers, asking.base, noted(request)))
    media_type, body = await asking.written(request, f"DESCRIBE {NamedNode(iri)}", accept)
    return Response(body, media_type=media_type, headers={"Vary": "Accept", "Cache-Control": "no-cache"})


def _page(iri: str, answers: Answers, base: str, standing: str | None) -> str:
    shown = individual.individual(iri, answers, base)
    values = {"found": shown, "most": individual.MOST_VALUES, "base": base, "graph_stands": standing}
    return page.render("individual/page.html.jinja", answers, {"individual": iri}, **values)


def _iri(request: Request, base: str) -> str:
    """Return the IRI that has the request's path, whose letters beyond ASCII a client writes as percents."""
    raw = request.scope.get("raw_path", b"").decode("ascii", errors="replace").partition("?")[0]
    path = _NOT_ASCII.sub(lambda match: unquote(match[0]), raw)
    above = base if path.startswith(urlsplit(base).path) else ONTOLOGY
    return named(above.removesuffix(urlsplit(above).path) + path, 404, "no individual has this address").value

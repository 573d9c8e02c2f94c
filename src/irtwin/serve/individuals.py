"""What lies below https://w3id.org/irtwin, at the same path here: /irtwin/id/robot/UR10 is a robot."""

from __future__ import annotations

import asyncio
import re
from urllib.parse import unquote

from pyoxigraph import NamedNode
from starlette.requests import Request
from starlette.responses import Response

from irtwin.knowledge.vocabulary import ID, ONTOLOGY
from irtwin.report.plant import individual, page
from irtwin.report.questions import Answers
from irtwin.resources import Resources
from irtwin.serve import negotiation, ontology
from irtwin.serve.asking import Asking
from irtwin.serve.plant_pages import html
from irtwin.serve.protocol import Refusal

_SITE = ONTOLOGY.removesuffix("/irtwin")
_FORMS = {
    "ttl": "text/turtle", "jsonld": "application/ld+json", "nt": "application/n-triples", "rdf": "application/rdf+xml",
}  # fmt: skip
_NOT_ASCII = re.compile(r"(?:%[89A-Fa-f][0-9A-Fa-f])+")
_KNOWN = "{ ?individual ?property ?value } UNION { ?subject ?leads ?individual }"


async def respond(asking: Asking, known: Resources, request: Request) -> Response:
    """Return what has the request's path for its IRI's, as a page or as RDF: a module of the ontology, an individual.

    Raises Refusal, where the graph does not know it too.
    """
    if request.url.path in ontology.paths():
        return await asyncio.to_thread(ontology.module, request, known)
    iri = _iri(request)
    accept = _FORMS.get(request.query_params.get("as", ""), request.headers.get("accept", ""))
    if not await asking.holds(request, _KNOWN, {"individual": iri}):
        others = "" if iri.startswith(ID) else f"; of the ontology there are {', '.join(ontology.paths())}"
        raise Refusal(404, f"the graph knows nothing of {iri}{others}")
    if negotiation.wants_page(accept):
        answers = await asking.answers(request, page.questions("individual"), {"individual": iri})
        return await html(lambda: _page(iri, answers))
    media_type, body = await asking.written(request, f"DESCRIBE {NamedNode(iri)}", accept)
    return Response(body, media_type=media_type, headers={"Vary": "Accept", "Cache-Control": "no-cache"})


def _page(iri: str, answers: Answers) -> str:
    found, bindings = individual.individual(iri, answers), {"individual": iri}
    return page.render("individual/page.html.jinja", answers, bindings, found=found, most=individual.MOST_VALUES)


def _iri(request: Request) -> str:
    """Return the IRI that has the request's path, whose letters beyond ASCII a client writes as percents."""
    raw = request.scope.get("raw_path", b"").decode("ascii", errors="replace").partition("?")[0]
    iri = _SITE + _NOT_ASCII.sub(lambda found: unquote(found[0]), raw)
    try:
        return NamedNode(iri).value
    except ValueError:
        raise Refusal(404, "no individual has this address") from None

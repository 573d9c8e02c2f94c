"""The ontology by its IRIs' paths: https://w3id.org/irtwin/robot is /irtwin/robot here."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import cast
from urllib.parse import urlsplit

from pyoxigraph import QuerySolutions, RdfFormat, Store, parse, serialize
from starlette.requests import Request
from starlette.responses import Response

from irtwin.knowledge.vocabulary import OWL, PREFIXES
from irtwin.resources import Resources, folder
from irtwin.serve import negotiation

_IRIS = f"SELECT ?iri {{ {{ ?iri a <{OWL}Ontology> }} UNION {{ ?it <{OWL}versionIRI> ?iri }} }}"
# The page carries its style and script, and a policy of its own for them.
_PAGE_HEADERS = {"Vary": "Accept", "Content-Security-Policy": "frame-ancestors 'none'"}


def paths() -> list[str]:
    """Return the paths of the modules and of their versions."""
    return sorted(_modules())


def module(request: Request, known: Resources) -> Response:
    """Return the module whose IRI or version IRI has the request's path; to a browser, the documentation of all.

    `known`: what holds for the workspace; the documentation is of that.
    """
    file = _modules()[request.url.path]
    accept = request.headers.get("accept", "")
    if negotiation.wants_page(accept):
        return Response(_documentation(known), media_type="text/html", headers=_PAGE_HEADERS)
    media_type = negotiation.chosen(accept, negotiation.TRIPLES, "the ontology")
    return Response(_written(file, media_type), media_type=media_type, headers={"Vary": "Accept"})


def questions(known: Resources, request: Request) -> Response:
    """Return the page of the competency questions."""
    return Response(_questions(known), media_type="text/html", headers=_PAGE_HEADERS)


@cache
def _questions(known: Resources) -> str:
    from irtwin.report.ontology.questions_page import page

    return page(known)


@cache
def _documentation(known: Resources) -> str:
    from irtwin.report.ontology.page import page, read_modules  # a second to import, for browsers only

    return page(read_modules(known))


@cache
def _modules() -> dict[str, Path]:
    modules = {}
    for file in sorted(folder("ontology").glob("*.ttl")):
        store = Store()
        store.load(path=str(file), format=RdfFormat.TURTLE)
        for row in cast(QuerySolutions, store.query(_IRIS)):
            modules[urlsplit(row["iri"].value).path] = file
    return modules


@cache
def _written(file: Path, media_type: str) -> bytes:
    """Return a module as it is written, comments and all, or in another form."""
    form = RdfFormat.from_media_type(media_type)
    if form == RdfFormat.TURTLE:
        return file.read_bytes()
    triples = (quad.triple for quad in parse(path=str(file), format=RdfFormat.TURTLE))
    written = serialize(triples, format=form, prefixes=PREFIXES)
    assert written is not None
    return written

"""Where the pages of a plant lie: a path for each individual."""

from __future__ import annotations

from urllib.parse import quote

from irtwin.knowledge.vocabulary import ID, ONTOLOGY

_SITE = ONTOLOGY.removesuffix("/irtwin")
PAGES = {f"{ID}robot/": "/robot/", f"{ID}run/": "/run/"}  # of kinds of individual that have one of their own


def page_of(iri: str) -> str | None:
    """Return the path of the page that a robot or a run has of its own; of anything else, that of the individual."""
    for start, path in PAGES.items():
        tail = iri.removeprefix(start)
        if tail != iri and "/" not in tail:
            return path + quote(tail, safe="")
    return individual(iri)


def individual(iri: str) -> str | None:
    """Return the path of an individual's page: its IRI's. Addresses elsewhere are kept, other schemes lead nowhere."""
    if iri == ONTOLOGY or iri.startswith((f"{ONTOLOGY}/", f"{ONTOLOGY}#")):
        return iri.removeprefix(_SITE)
    return iri if iri.startswith(("http://", "https://")) else None


def tail(iri: str) -> str:
    """Return the end of a robot's or a run's IRI, as paths and forms name it."""
    return next((iri.removeprefix(start) for start in PAGES if iri.startswith(start)), iri)

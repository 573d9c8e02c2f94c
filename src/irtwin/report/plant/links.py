"""Where the pages of a plant lie: a path for each individual of a graph, whose individuals lie below `base`."""

from __future__ import annotations

from urllib.parse import quote, urlsplit

from irtwin.knowledge.vocabulary import ONTOLOGY

_PAGES = ("robot/", "run/")  # of kinds of individual that have one of their own


def page_of(iri: str, base: str) -> str | None:
    """Return the path of the page that a robot or a run has of its own; of anything else, the individual's."""
    for start in _PAGES:
        tail = iri.removeprefix(base + start)
        if tail != iri and "/" not in tail:
            return f"/{start}{quote(tail, safe='')}"
    return individual(iri, base)


def individual(iri: str, base: str) -> str | None:
    """Return the path of an individual's page: its IRI's. Addresses elsewhere are kept, other schemes lead nowhere.

    So are those of the ontology, which has its terms at the paths of their IRIs.
    """
    if iri.startswith(base) or iri == ONTOLOGY or iri.startswith((f"{ONTOLOGY}/", f"{ONTOLOGY}#")):
        site = urlsplit(iri)
        return iri.removeprefix(f"{site.scheme}://{site.netloc}")
    return iri if iri.startswith(("http://", "https://")) else None


def tail(iri: str, base: str) -> str:
    """Return the end of a robot's or a run's IRI, as paths and forms name it."""
    return next((iri.removeprefix(base + start) for start in _PAGES if iri.startswith(base + start)), iri)

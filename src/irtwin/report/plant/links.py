"""Where the pages of a plant lie: a path for each individual."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from urllib.parse import quote, urlsplit

from irtwin.knowledge.vocabulary import ONTOLOGY

_PAGES = {"robot/": "/robot/", "run/": "/run/"}  # of kinds of individual that have one of their own


@dataclass(frozen=True)
class Links:
    """The paths of a graph's individuals, which lie below `base`."""

    base: str

    def page_of(self, iri: str) -> str | None:
        """Return the path of the page that a robot or a run has of its own; of anything else, the individual's."""
        for start, path in _PAGES.items():
            tail = iri.removeprefix(self.base + start)
            if tail != iri and "/" not in tail:
                return path + quote(tail, safe="")
        return self.individual(iri)

    def individual(self, iri: str) -> str | None:
        """Return the path of an individual's page: its IRI's. Addresses elsewhere are kept, other schemes lead nowhere.

        So are those of the ontology, which has its terms at the paths of their IRIs.
        """
        own = iri.startswith(self.base) or iri == ONTOLOGY or iri.startswith((f"{ONTOLOGY}/", f"{ONTOLOGY}#"))
        if own:
            site = urlsplit(iri)
            return iri.removeprefix(f"{site.scheme}://{site.netloc}")
        return iri if iri.startswith(("http://", "https://")) else None

    def tail(self, iri: str) -> str:
        """Return the end of a robot's or a run's IRI, as paths and forms name it."""
        starts = [self.base + start for start in _PAGES]
        return next((iri.removeprefix(start) for start in starts if iri.startswith(start)), iri)


@cache
def links(base: str) -> Links:
    """Return the paths of a graph whose individuals lie below a base."""
    return Links(base)

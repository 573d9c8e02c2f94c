"""Content negotiation (RFC 9110, 12.5.1): which of the forms on offer an Accept header likes best."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

SOLUTIONS = {
    "application/sparql-results+json": "JSON",
    "application/sparql-results+xml": "XML",
    "text/csv": "CSV",
    "text/tab-separated-values": "TSV",
    "application/json": "JSON",
    "application/xml": "XML",
}
TRIPLES = {
    "text/turtle": "Turtle",
    "application/n-triples": "N-Triples",
    "application/rdf+xml": "RDF/XML",
    "application/ld+json": "JSON-LD",
    "application/xml": "RDF/XML",
    "application/json": "JSON-LD",
}


@dataclass(frozen=True)
class _Range:
    kind: str
    subtype: str
    quality: float

    def precision(self, media_type: str) -> int:
        """Return how closely the range names the media type: 0 not at all, 3 exactly."""
        kind, _, subtype = media_type.partition("/")
        if (self.kind, self.subtype) == (kind, subtype):
            return 3
        if (self.kind, self.subtype) == (kind, "*"):
            return 2
        return 1 if (self.kind, self.subtype) == ("*", "*") else 0


def best(accept: str, offered: Sequence[str] | Mapping[str, str]) -> str | None:
    """Return the media type on offer that an Accept header prefers, the first of equals; None where none will do.

    An empty header takes anything. The quality of a type is that of the range that names it most closely.
    """
    ranges = [accepted for part in accept.split(",") if (accepted := _range(part)) is not None]
    if not accept.strip():
        return next(iter(offered))
    choice = max(offered, key=lambda media_type: _quality(media_type, ranges), default=None)
    return choice if choice is not None and _quality(choice, ranges) > 0 else None


def wants_page(accept: str) -> bool:
    """Whether an Accept header would rather have a page than RDF, as browsers do."""
    return bool(accept) and best(accept, [*TRIPLES, "text/html"]) == "text/html"


def _quality(media_type: str, ranges: Sequence[_Range]) -> float:
    closest = max(ranges, key=lambda one: one.precision(media_type), default=None)
    return closest.quality if closest is not None and closest.precision(media_type) else 0.0


def _range(part: str) -> _Range | None:
    """Read one media range; None where it is broken, as if it had not been said."""
    name, *parameters = (piece.strip().lower() for piece in part.split(";"))
    kind, slash, subtype = name.partition("/")
    if not (kind and slash and subtype):
        return None
    for parameter in parameters:
        key, _, value = parameter.partition("=")
        if key.strip() == "q":
            return _Range(kind, subtype, quality) if (quality := _number(value)) is not None else None
    return _Range(kind, subtype, 1.0)


def _number(text: str) -> float | None:
    try:
        quality = float(text)
    except ValueError:
        return None
    return quality if 0 <= quality <= 1 else None

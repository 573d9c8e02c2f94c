"""Content negotiation (RFC 9110, 12.5.1): which of the forms on offer an Accept header likes best."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from irtwin.serve.protocol import Refusal

SOLUTIONS = (
    "application/sparql-results+json", "application/sparql-results+xml", "text/csv", "text/tab-separated-values",
    "application/json", "application/xml",
)  # fmt: skip
TRIPLES = (
    "text/turtle", "application/n-triples", "application/rdf+xml", "application/ld+json", "application/xml",
    "application/json",
)  # fmt: skip


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


def best(accept: str, offered: Sequence[str]) -> str | None:
    """Return the media type on offer that an Accept header prefers, the first of equals; None where none will do.

    An empty header takes anything. The quality of a type is that of the range that names it most closely.
    """
    ranges = [accepted for part in accept.split(",") if (accepted := _range(part)) is not None]
    if not accept.strip():
        return next(iter(offered))
    choice = max(offered, key=lambda media_type: _quality(media_type, ranges), default=None)
    return choice if choice is not None and _quality(choice, ranges) > 0 else None


def chosen(accept: str, offered: Sequence[str], what: str) -> str:
    """Return the media type that an Accept header prefers of what is `offered`. Raises Refusal where none will do."""
    media_type = best(accept, offered)
    if media_type is None:
        raise Refusal(406, f"{what} comes as {', '.join(offered)}; none of them is in Accept")
    return media_type


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

"""Content negotiation (RFC 9110, 12.5.1): which of the forms on offer an Accept header likes best."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from irtwin.serve.protocol import Refusal

SOLUTIONS = (
    "application/sparql-results+json", "application/sparql-results+xml", "text/csv", "text/tab-separated-values",
    "application/json", "application/xml",
)  # fmt: skip
TRIPLES = (
    "text/turtle", "application/n-triples", "application/rdf+xml", "application/ld+json", "application/xml",
    "application/json",
)  # fmt: skip


def best(accept: str, offered: Sequence[str]) -> str | None:
    """Return the media type on offer that an Accept header prefers, the first of equals; None where none will do.

    An empty header takes anything. The quality of a type is that of the range that names it most closely.
    """
    if not accept.strip():
        return offered[0]
    ranges = _ranges(accept)
    choice = max(offered, key=lambda media_type: _quality(media_type, ranges))
    return choice if _quality(choice, ranges) > 0 else None


def chosen(accept: str, offered: Sequence[str], label: str) -> str:
    """Return the media type that an Accept header prefers of what is `offered`. Raises Refusal where none will do."""
    media_type = best(accept, offered)
    if media_type is None:
        raise Refusal(406, f"{label} comes as {', '.join(offered)}; none of them is in Accept")
    return media_type


def wants_page(accept: str) -> bool:
    """Whether an Accept header would rather have a page than RDF, as browsers do."""
    return bool(accept) and best(accept, [*TRIPLES, "text/html"]) == "text/html"


def _quality(media_type: str, ranges: Mapping[str, float]) -> float:
    """Return the quality of the range that names a media type most closely, 0 where none does."""
    kind = media_type.partition("/")[0]
    return next((ranges[pattern] for pattern in (media_type, f"{kind}/*", "*/*") if pattern in ranges), 0.0)


def _ranges(accept: str) -> dict[str, float]:
    """Read media ranges with their qualities; one that is broken counts as not said, of equal ones the first counts."""
    ranges: dict[str, float] = {}
    for part in accept.split(","):
        name, *parameters = (piece.strip().lower() for piece in part.split(";"))
        given = [
            value for key, _, value in (parameter.partition("=") for parameter in parameters) if key.strip() == "q"
        ]
        quality = _number(given[0]) if given else 1.0
        if quality is not None and "" not in name.partition("/"):
            ranges.setdefault(name, quality)
    return ranges


def _number(text: str) -> float | None:
    try:
        quality = float(text)
    except ValueError:
        return None
    return quality if 0 <= quality <= 1 else None

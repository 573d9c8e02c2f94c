"""The IRIs of individuals."""

from __future__ import annotations

from urllib.parse import quote

from irtwin.knowledge.vocabulary import ID


def individual(kind: str, *parts: str) -> str:
    """Return the IRI of an individual: `individual("joint", "UR10", "elbow")` ends in `id/joint/UR10/elbow`."""
    return ID + "/".join(quote(part, safe="") for part in (kind, *parts))

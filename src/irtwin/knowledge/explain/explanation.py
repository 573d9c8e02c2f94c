"""How something is known: what an explanation is, and how it is written."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

LEFT_OUT = "left out"  # says of what there is too much of


@dataclass(frozen=True)
class Explanation:
    """A triple or an individual, with prefixes; who or what says it; and from what, down to files.

    `meaning` is what the rule or provider does, in words. `file` and `checksum` are of the individual's own file, or
    of the document that says the triple, at a `place`; its path begins in the workspace, or in the `folder` of a data
    set.
    """

    what: str
    by: str
    because: tuple[Explanation, ...] = ()
    meaning: str | None = None
    file: str | None = None
    checksum: str | None = None
    folder: str | None = None
    place: str | None = None

    def __str__(self) -> str:
        """Return it as an indented outline."""
        return "\n".join(_lines(self, ""))


def to_json(explanation: Explanation) -> dict[str, Any]:
    """Write an explanation as nested objects, for JSON; what it lacks is left out."""
    plain = {
        name: getattr(explanation, name) for name in ("what", "by", "meaning", "file", "folder", "checksum", "place")
    }
    known = {name: value for name, value in plain.items() if value is not None}
    if explanation.because:
        known["because"] = [to_json(premise) for premise in explanation.because]
    return known


def _lines(explanation: Explanation, margin: str) -> Iterator[str]:
    yield margin + explanation.what
    inner = margin + "    "
    if explanation.by:
        yield f"{inner}by {explanation.by}"
    if explanation.meaning:
        yield f"{inner}({explanation.meaning})"
    if explanation.file:
        checksum = f", sha256 {explanation.checksum}" if explanation.checksum else ""
        folder = f" in {explanation.folder}" if explanation.folder else ""
        yield f"{inner}file {explanation.file}{folder}{checksum}"
    if explanation.place:
        yield f"{inner}at {explanation.place}"
    for premise in explanation.because:
        first, *rest = _lines(premise, inner + "  ")
        yield f"{inner}- {first.lstrip()}"
        yield from rest

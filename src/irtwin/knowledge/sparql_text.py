"""What can be told of a SPARQL query by its text, before it is parsed."""

from __future__ import annotations

import re
from collections.abc import Mapping

from pyoxigraph import NamedNode

# What SPARQL reads as comment, IRI, string, variable or local name, where the word SERVICE means nothing.
_HARMLESS = re.compile(
    r"""<[^<>"{}|^`\\\s]*>|\"\"\".*?\"\"\"|'''.*?'''|"(?:[^"\\\n]|\\.)*"|'(?:[^'\\\n]|\\.)*'|\#[^\n]*|[?$]\w+|:[\w.%-]*""",
    re.DOTALL,
)
_OUTERMOST_GROUP = re.compile(r"\b(?:SELECT|ASK)\b[^{]*\{|\bWHERE\s*\{", re.IGNORECASE)


def asks_another_server(text: str) -> bool:
    """Whether a query may hold a SERVICE clause; true in doubt."""
    return "service" in _HARMLESS.sub(" ", text).lower()


def bound(text: str, bindings: Mapping[str, str]) -> str:
    """Let the variables of a query's outermost group have the given IRIs as their only values."""
    group = _OUTERMOST_GROUP.search(_HARMLESS.sub(lambda match: " " * len(match[0]), text))
    if not bindings or group is None:
        return text
    values = " ".join(f"VALUES ?{name} {{ {NamedNode(iri)} }}" for name, iri in bindings.items())
    return f"{text[: group.end()]} {values} {text[group.end() :]}"

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
_PROLOGUE = re.compile(r"(?:\s+|#[^\n]*(?:\n|$)|BASE\s*<[^<>\s]*>|PREFIX\s*[^\s:<]*:\s*<[^<>\s]*>)*", re.IGNORECASE)
_OUTERMOST_GROUP = re.compile(r"\b(?:SELECT|ASK)\b[^{]*\{|\bWHERE\s*\{", re.IGNORECASE)


def asks_another_server(text: str) -> bool:
    """Whether a query may hold a SERVICE clause; true in doubt."""
    return "service" in _HARMLESS.sub(" ", text).lower()


def loads_a_document(text: str) -> bool:
    """Whether an update may hold a LOAD; true in doubt."""
    return "load" in _HARMLESS.sub(" ", text).lower()


def prologue_and_operations(text: str) -> tuple[str, str]:
    """Part an update's BASE and PREFIX from what it does, which ends without semicolon and comments."""
    bare = _HARMLESS.sub(lambda match: (" " if match[0][0] == "#" else "x") * len(match[0]), text).rstrip()
    prologue = _PROLOGUE.match(text)
    start = prologue.end() if prologue else 0
    return text[:start], text[start : len(bare) - bare.endswith(";")]


def masked(text: str) -> str:
    """Return a text of the same length with blanks for strings, IRIs, comments, variables and local names."""
    return _HARMLESS.sub(lambda match: " " * len(match[0]), text)


def bound(text: str, bindings: Mapping[str, str]) -> str:
    """Let the variables of a query's outermost group have the given IRIs as their only values."""
    group = _OUTERMOST_GROUP.search(masked(text))
    if not bindings or group is None:
        return text
    values = " ".join(f"VALUES ?{name} {{ {NamedNode(iri)} }}" for name, iri in bindings.items())
    return f"{text[: group.end()]} {values} {text[group.end() :]}"

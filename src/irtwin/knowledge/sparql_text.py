"""What can be told of a SPARQL query by its text, before it is parsed."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

from pyoxigraph import NamedNode

from irtwin.errors import InputError

# What SPARQL reads as comment, IRI, string, variable or local name, where the word SERVICE means nothing.
_HARMLESS = re.compile(
    r"""<[^<>"{}|^`\\\s]*>|\"\"\".*?\"\"\"|'''.*?'''|"(?:[^"\\\n]|\\.)*"|'(?:[^'\\\n]|\\.)*'|\#[^\n]*|[?$]\w+|:[\w.%-]*""",
    re.DOTALL,
)
_PROLOGUE = re.compile(r"(?:\s+|#[^\n]*(?:\n|$)|BASE\s*<[^<>\s]*>|PREFIX\s*[^\s:<]*:\s*<[^<>\s]*>)*", re.IGNORECASE)
_WHERE = re.compile(r"(?P<delete>\bDELETE\s*)?\bWHERE\s*(?=\{)|[{}]", re.IGNORECASE)
_OWN_DATASET = re.compile(r"\b(?:USING|WITH)\b", re.IGNORECASE)
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


def using(text: str, default_graphs: Sequence[str], named_graphs: Sequence[str]) -> str:
    """Return an update that says USING and USING NAMED of the graphs wherever it asks; InputError where it does itself.

    `DELETE WHERE { }` has no place for them, so its pattern is written as template too.
    """
    plain = masked(text)
    if _OWN_DATASET.search(plain):
        raise InputError("the update says USING or WITH, and the request using-graph-uri: say it once")
    try:
        clauses = [f"USING {NamedNode(iri)}" for iri in default_graphs]
        clauses += [f"USING NAMED {NamedNode(iri)}" for iri in named_graphs]
    except ValueError as error:
        raise InputError(f"a graph's name is no IRI: {error}") from error
    said, depth, done = [], 0, 0
    for match in _WHERE.finditer(plain):
        depth += {"{": 1, "}": -1}.get(match[0], 0)
        if match[0] not in "{}" and depth == 0:
            template = f"DELETE {_group(text, plain, match.end())} " if match["delete"] else ""
            said += [text[done : match.start()], template, " ".join(clauses), " WHERE "]
            done = match.end()
    return "".join([*said, text[done:]])


def _group(text: str, plain: str, start: int) -> str:
    """Return the group that begins with the brace at `start`; all the rest where it does not end."""
    depth = 0
    for brace in re.compile("[{}]").finditer(plain, start):
        depth += 1 if brace[0] == "{" else -1
        if depth == 0:
            return text[start : brace.end()]
    return text[start:]


def bound(text: str, bindings: Mapping[str, str]) -> str:
    """Let the variables of a query's outermost group have the given IRIs as their only values."""
    group = _OUTERMOST_GROUP.search(masked(text))
    if not bindings or group is None:
        return text
    values = " ".join(f"VALUES ?{name} {{ {NamedNode(iri)} }}" for name, iri in bindings.items())
    return f"{text[: group.end()]} {values} {text[group.end() :]}"

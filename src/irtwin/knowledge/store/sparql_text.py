"""What can be told of a SPARQL text without a parser."""

from __future__ import annotations

import re
from collections.abc import Mapping

from pyoxigraph import Literal, NamedNode

# Comments, strings, variables and local names, and IRIs where no operand stands before them, which `<` compares.
_NO_KEYWORD = re.compile(
    r"""(?<![\w?$)])<[^<>"{}|^`\\\s]*>|"{3}(?:"{0,2}(?:[^"\\]|\\.))*"{3}|'{3}(?:'{0,2}(?:[^'\\]|\\.))*'{3}"""
    r"""|"(?:[^"\\\n\r]|\\.)*"|'(?:[^'\\\n\r]|\\.)*'|\#[^\n\r]*|[?$]\w+|:[\w.%-]*""",
    re.DOTALL,
)
SPACE = r"(?:[ \t\r\n]|#[^\r\n]*+)*+"  # of SPARQL, comments too
_PROLOGUE = re.compile(
    rf"{SPACE}(?:(?:BASE{SPACE}<[^>]*>|PREFIX{SPACE}[^\s:<#]*{SPACE}:{SPACE}<[^>]*>){SPACE})*", re.IGNORECASE | re.ASCII
)
_OUTERMOST_GROUP = re.compile(r"\b(?:SELECT|ASK)\b[^{]*\{|\bWHERE\s*\{", re.IGNORECASE)


def after_prologue(text: str) -> int:
    """Return where a text's BASE and PREFIX, and the comments around them, have ended."""
    match = _PROLOGUE.match(text)
    assert match is not None
    return match.end()


def masked(text: str) -> str:
    """Return a text of the same length with blanks for strings, IRIs, comments, variables and local names.

    For the project's own texts and rules: where `<` follows a variable without a space, it is taken for "less than".
    What a user's text may do is told by the parser: see `keywords`.
    """
    return _NO_KEYWORD.sub(lambda match: " " * len(match[0]), text)


def bound(text: str, bindings: Mapping[str, str | Literal]) -> str:
    """Let the variables of one of the project's own queries have the given IRIs, or literals, as their only values.

    ValueError where it has no outermost group, or where a text is no IRI.
    """
    if not bindings:
        return text
    group = _OUTERMOST_GROUP.search(masked(text))
    if group is None:
        raise ValueError("the query has no group to bind variables in")
    values = " ".join(f"VALUES ?{name} {{ {_term(value)} }}" for name, value in bindings.items())
    return f"{text[: group.end()]} {values} {text[group.end() :]}"


def _term(value: str | Literal) -> NamedNode | Literal:
    return value if isinstance(value, Literal) else NamedNode(value)

"""The dataset of an update that its request chose, as the SPARQL 1.1 Protocol has it, written into its text.

Where USING is to stand, the parser tells: at a place where it parses, and where `US_NG` does not.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from itertools import islice

from pyoxigraph import NamedNode

from irtwin.errors import InputError
from irtwin.knowledge.store.keywords import fault_without, is_update, parse_update
from irtwin.knowledge.store.sparql_text import after_prologue

MOST_PLACES = 100  # each is tried, and costs some parses

_WHERE = re.compile("where", re.IGNORECASE | re.ASCII)


def using(text: str, default_graphs: Sequence[str], named_graphs: Sequence[str], base: str | None = None) -> str:
    """Return an update that says USING and USING NAMED of the graphs wherever it asks.

    `DELETE WHERE { }` has no place for them, so its pattern is written as template too. The text has passed
    `updates.check`. InputError where it says USING or WITH itself, or says WHERE too often.
    """
    try:
        clauses = [f"USING {NamedNode(iri)}" for iri in default_graphs]
        clauses += [f"USING NAMED {NamedNode(iri)}" for iri in named_graphs]
    except ValueError as error:
        raise InputError(f"a graph's name is no IRI: {error}") from error
    if fault_without(text, ("using", "with"), parse_update, base) is not None:
        raise InputError("the update has USING or WITH and the request has using-graph-uri; use only one")
    places = [match.start() for match in _WHERE.finditer(text)]
    if len(places) > MOST_PLACES:
        raise InputError(f"an update with using-graph-uri says WHERE at most {MOST_PLACES} times")
    clause_text = f" {' '.join(clauses)} "
    for place in reversed(places):  # so that those before stay where they are
        before, after = text[:place], text[place:]
        if _is_clause(before, clause_text, after, base):
            text = f"{before}{clause_text}{after}"
        elif _is_clause(before, "{ }" + clause_text, after, base):
            text = f"{before}{_pattern(text, place, base)}{clause_text}{after}"
    return text


def _is_clause(before: str, clause: str, after: str, base: str | None) -> bool:
    """Whether USING may stand at a place as a clause, which it does not within a string or a comment."""
    return is_update(before + clause + after, base) and not is_update(
        before + clause.replace("USING", "US_NG") + after, base
    )


def _pattern(text: str, place: int, base: str | None) -> str:
    """Return the group after a DELETE WHERE: up to the first brace that makes it whole."""
    start = place + len("WHERE")
    prologue = text[: after_prologue(text)]
    ends = (match.end() for match in re.compile("}").finditer(text, start))
    for end in islice(ends, MOST_PLACES):
        if is_update(f"{prologue}DELETE WHERE {text[start:end]}", base):
            return text[start:end]
    raise InputError("a DELETE WHERE is too long to be given the graphs of the request: write DELETE { } WHERE { }")

"""SPARQL updates that keep the default graph the union of the named graphs.

Who writes an update sees one graph, the union, beside the named ones. What it puts there belongs to no source, so it
goes into a named graph of its own; what it takes from there is taken from every named graph that holds it.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable

from pyoxigraph import DefaultGraph, NamedNode, Quad, Store, Triple

from irtwin.errors import InputError
from irtwin.knowledge.blank_nodes import has_blank_node
from irtwin.knowledge.sparql_text import asks_another_server, loads_a_document, masked, prologue_and_operations
from irtwin.knowledge.vocabulary import GRAPH, GRAPH_UPDATE, PREFIXES

_BEFORE = f"{GRAPH}before"  # there only while an update lasts
_OPERATION = re.compile(
    r"\b(?:insert|delete|data|where|with|using|load|clear|create|drop|add|move|copy)\b", re.IGNORECASE
)


def as_change(text: str, holding: Callable[[Iterable[Triple]], Iterable[Quad]]) -> tuple[set[Quad], set[Quad]] | None:
    """Return the quads of named graphs that an update takes out and puts in, where its text alone tells: or None.

    It does where it is one INSERT DATA or DELETE DATA without blank nodes. `holding` finds the quads of named graphs
    that say one of some triples. InputError as `keeping_union`.
    """
    _check(text)
    words = list(_OPERATION.finditer(masked(text)))
    match [word[0].lower() for word in words]:
        case ["insert", "data"]:
            named, union = _inserted(text)
            if has_blank_node(named) or has_blank_node(union):
                return None
            new = union - {quad.triple for quad in (*named, *holding(union))}
            graph = NamedNode(GRAPH_UPDATE)
            return set(), named | {Quad(triple.subject, triple.predicate, triple.object, graph) for triple in new}
        case ["delete", "data"]:
            named, union = _inserted(f"{text[: words[0].start()]}INSERT{text[words[0].end() :]}")
            return named | set(holding(union)), set()
    return None


def keeping_union(text: str) -> str:
    """Return an update that does what `text` says, and what the union then needs, in one transaction.

    InputError where it is no update, or would read what is not in this graph.
    """
    _check(text)
    prologue, operations = prologue_and_operations(text)
    if not operations:
        return prologue
    # Oxigraph takes a prologue before the first operation only, so it stays in front.
    return f"""{prologue}
COPY DEFAULT TO <{_BEFORE}> ;
{operations} ;
INSERT {{ GRAPH <{GRAPH_UPDATE}> {{ ?s ?p ?o }} }}
WHERE {{ ?s ?p ?o FILTER NOT EXISTS {{ GRAPH ?g {{ ?s ?p ?o }} }} }} ;
DELETE {{ GRAPH ?g {{ ?s ?p ?o }} }}
WHERE {{ GRAPH <{_BEFORE}> {{ ?s ?p ?o }} FILTER NOT EXISTS {{ ?s ?p ?o }} GRAPH ?g {{ ?s ?p ?o }} }} ;
DROP SILENT GRAPH <{_BEFORE}> ;
DELETE {{ ?s ?p ?o }} WHERE {{ ?s ?p ?o FILTER NOT EXISTS {{ GRAPH ?g {{ ?s ?p ?o }} }} }} ;
INSERT {{ ?s ?p ?o }} WHERE {{ GRAPH ?g {{ ?s ?p ?o }} FILTER NOT EXISTS {{ ?s ?p ?o }} }}"""


def _check(text: str) -> None:
    """Refuse what reads from elsewhere; parse by itself, so that the parser's line and column are the writer's."""
    if asks_another_server(text) or loads_a_document(text):
        raise InputError("LOAD and SERVICE read from elsewhere, which is not allowed here: use INSERT DATA")
    try:
        Store().update(text, prefixes=PREFIXES)
    except SyntaxError as error:
        raise InputError(f"not a SPARQL update: {error}") from error
    except (RuntimeError, OSError):
        return  # it names a graph that an empty store has not


def _inserted(text: str) -> tuple[set[Quad], set[Triple]]:
    """Return what an INSERT DATA puts into named graphs, and into the union."""
    store = Store()
    store.update(text, prefixes=PREFIXES)
    union = set(store.quads_for_pattern(None, None, None, DefaultGraph()))
    return set(store) - union, {quad.triple for quad in union}

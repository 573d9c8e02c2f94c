"""SPARQL updates that keep the default graph the union of the named graphs.

Who writes an update sees one graph, the union, beside the named ones. What it puts there belongs to no source, so it
goes into a named graph of its own; what it takes from there is taken from every named graph that holds it.
"""

from __future__ import annotations

from pyoxigraph import Store

from irtwin.errors import InputError
from irtwin.knowledge.sparql_text import asks_another_server, loads_a_document, prologue_and_operations
from irtwin.knowledge.vocabulary import GRAPH, GRAPH_UPDATE, PREFIXES

_BEFORE = f"{GRAPH}before"  # there only while an update lasts


def keeping_union(text: str) -> str:
    """Return an update that does what `text` says, and what the union then needs, in one transaction.

    InputError where it is no update, or would read what is not in this graph.
    """
    if asks_another_server(text) or loads_a_document(text):
        raise InputError("LOAD and SERVICE read from elsewhere, which is not allowed here: use INSERT DATA")
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
    """Parse an update by itself, so that the parser's line and column are the writer's."""
    try:
        Store().update(text, prefixes=PREFIXES)
    except SyntaxError as error:
        raise InputError(f"not a SPARQL update: {error}") from error
    except (RuntimeError, OSError):
        return  # it names a graph that an empty store has not

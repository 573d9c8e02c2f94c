"""What SPARQL updates take out of named graphs and put in, so that the default graph stays their union.

Who writes an update sees one graph, the union, beside the named ones. What it puts there belongs to no source, so it
goes into a named graph of its own; what it takes from there is taken from every named graph that holds it.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from contextlib import suppress

from pyoxigraph import DefaultGraph, NamedNode, Quad, Store, Triple

from irtwin.errors import InputError
from irtwin.knowledge.store.blank_nodes import has_blank_node
from irtwin.knowledge.store.keywords import is_update, parse_update, refuse_service_and_load
from irtwin.knowledge.store.named_graphs import in_graph
from irtwin.knowledge.store.sparql_text import SPACE, after_prologue
from irtwin.knowledge.store.syntax_error import in_words
from irtwin.knowledge.store.union_store import with_union
from irtwin.knowledge.vocabulary import GRAPH_ASSERTED, PREFIXES

_NO_GRAPH = re.compile(r"The graph <([^>]*)> does not exist")
_DATA = re.compile(rf"(INSERT|DELETE){SPACE}DATA", re.IGNORECASE | re.ASCII)
_DELETE_WHERE = re.compile(rf"DELETE{SPACE}(?=WHERE)", re.IGNORECASE | re.ASCII)
_WORDS = ("delete", "insert")
_END = " \t\r\n;"  # of an update, after which nothing is done
_TEMPLATE = re.compile(rf"{SPACE}(INSERT|DELETE){SPACE}\{{", re.IGNORECASE | re.ASCII)


def check(text: str, base: str | None, on_server: bool = False) -> None:
    """Raise InputError where a text is no update, by the writer's own lines and columns, or reads from elsewhere."""
    refuse_service_and_load(text, base, on_server)
    try:
        parse_update(text, base)
    except SyntaxError as error:
        raise InputError(f"not a SPARQL update: {in_words(_in_place(text, base) or error, text)}") from error


def by_asking(
    text: str,
    holding: Callable[[Iterable[Triple]], Iterable[Quad]],
    construct: Callable[[str], set[Triple]],
    base: str | None = None,
    prefixes: dict[str, str] = PREFIXES,
) -> tuple[set[Quad], set[Quad]] | None:
    """Return the quads of named graphs that an update takes out and puts in, where its data, or a query, tell: or None.

    They do where it is one INSERT DATA or DELETE DATA, or one DELETE and INSERT with WHERE of triples alone, without
    blank nodes. `holding` finds the quads of named graphs that say one of some triples; `construct` answers a CONSTRUCT
    over the union of all named graphs. The text has passed `check`.
    """
    start = after_prologue(text)
    prologue = text[:start]
    forms, pattern = _operation(prologue, text[start:], base)

    def made(form: str) -> tuple[set[Quad], set[Triple]]:
        """Return the quads of named graphs and the triples of the union that a form makes."""
        if pattern is None:
            return _inserted(f"{prologue}INSERT DATA {form}", base, prefixes)
        return set(), construct(f"{prologue}CONSTRUCT {form}\n{pattern}")

    try:  # a template of named graphs, USING, or another operation after this one is no CONSTRUCT
        gone, come = ((set(), set()) if (form := forms.get(word)) is None else made(form) for word in _WORDS)
    except SyntaxError:
        return None
    if not forms or any(has_blank_node(some) for some in (*gone, *come)):
        return None
    new = come[1] - {quad.triple for quad in (*come[0], *holding(come[1]))}
    return gone[0] | set(holding(gone[1] - come[1])), come[0] | set(in_graph(new, GRAPH_ASSERTED))


def by_doing(
    text: str, quads: Iterable[Quad], base: str | None = None, prefixes: dict[str, str] = PREFIXES
) -> tuple[set[Quad], set[Quad]]:
    """Return the same as `by_asking`, of any update, by doing it on a copy of all quads in memory.

    Raises SyntaxError or RuntimeError where it fails.
    """
    before = set(quads)

    def done(without: Iterable[Quad] = (), empty: tuple[str, ...] = ()) -> set[Quad]:
        """Return the quads after the update, begun without some of the named graphs', and with empty graphs."""
        store = Store()
        store.bulk_extend(with_union(before))
        for quad in without:
            store.remove(quad)
        for name in empty:
            store.add_graph(NamedNode(name))
        try:
            store.update(text, base_iri=base, prefixes=prefixes)
        except RuntimeError as error:  # empty graphs are not kept, so each may be cleared
            missing = _NO_GRAPH.search(str(error))
            if missing is None or missing[1] in empty:
                raise
            return done(without, (*empty, missing[1]))
        return set(store)

    result = done()
    union = {quad.triple for quad in result if quad.graph_name == DefaultGraph()}
    old = {quad.triple for quad in before}
    # What the default graph lost goes from every named graph, but for those that the update itself puts it into.
    lost = {quad for quad in before & result if quad.triple not in union}
    named = {quad for quad in result if quad.graph_name != DefaultGraph()} - lost
    named |= lost & done(lost) if lost else set()
    new = union - old - {quad.triple for quad in named}
    after = named | set(in_graph(new, GRAPH_ASSERTED))
    return before - after, after - before


def _operation(prologue: str, rest: str, base: str | None) -> tuple[dict[str, str], str | None]:
    """Return the groups after DELETE and INSERT of one operation, and what follows these: None of one of data.

    No groups where it is none of these.
    """
    if data := _DATA.match(rest):
        group = rest[data.end() :].rstrip(_END)
        # A group is one INSERT's template as well: what follows it would not be let through here.
        is_alone = is_update(f"{prologue}INSERT {group}\nWHERE {{ }}", base)
        return ({data[1].lower(): group} if is_alone else {}), None
    if short := _DELETE_WHERE.match(rest):
        return {"delete": ""}, rest[short.end() :].rstrip(_END)
    forms: dict[str, str] = {}
    while head := _TEMPLATE.match(rest):  # a group ends where it is whole
        ends = (brace.end() for brace in re.finditer("}", rest))
        end = next((end for end in ends if is_update(f"{prologue}{rest[:end]}\nWHERE {{ }}", base)), None)
        if end is None or head[1].lower() in forms:
            return {}, rest
        forms[head[1].lower()] = rest[head.end() - 1 : end]
        rest = rest[end:]
    return forms, rest.rstrip(_END)


def _in_place(text: str, base: str | None) -> SyntaxError | None:
    """Return what the parser says of a text as it was written, which is known to be no update."""
    try:
        with suppress(RuntimeError):
            Store().update(text, base_iri=base, prefixes=PREFIXES)
    except SyntaxError as error:
        return error
    return None


def _inserted(text: str, base: str | None, prefixes: dict[str, str]) -> tuple[set[Quad], set[Triple]]:
    """Return what an INSERT DATA puts into named graphs, and into the union."""
    store = Store()
    store.update(text, base_iri=base, prefixes=prefixes)
    union = set(store.quads_for_pattern(None, None, None, DefaultGraph()))
    return set(store) - union, {quad.triple for quad in union}

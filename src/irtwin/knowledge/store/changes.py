"""What changed since the graph was last reasoned over and validated, so that only that is looked at again.

The individuals that a change speaks of are noted in the same transaction, once for who infers and once for who
validates; each strikes out its own notes. Where a change cannot tell its individuals, what was inferred loses the name
of what it was made of, and everything is done anew.

`BEHIND` stands in the graph from before rows or graph begin to change until all that follows from them is in it.
"""

from __future__ import annotations

from collections.abc import Iterable

from pyoxigraph import BlankNode, Literal, NamedNode, Quad, Store

from irtwin.knowledge.vocabulary import (
    GRAPH,
    GRAPH_CHANGED,
    GRAPH_INFERRED,
    GRAPH_MAPPED,
    GRAPH_OWL_RL,
    GRAPH_REASONED,
    GRAPH_SOURCE,
    GRAPH_VALIDATION,
    INTO_PLACES,
    PLACES,
    PROV,
    TYPE,
)

DERIVED_FROM = NamedNode(PROV + "wasDerivedFrom")
NOT_ASSERTED = (GRAPH_INFERRED, GRAPH_REASONED, GRAPH_VALIDATION, GRAPH_CHANGED, GRAPH_MAPPED)

_CHANGED = NamedNode(GRAPH_CHANGED)
_REASONED = NamedNode(GRAPH_REASONED)
_INFLUENCED_BY = NamedNode(PROV + "wasInfluencedBy")
_READERS = (GRAPH_INFERRED, GRAPH_VALIDATION)

BEHIND = Quad(NamedNode(GRAPH), _INFLUENCED_BY, NamedNode(GRAPH_SOURCE), _CHANGED)


def notes(store: Store, quads: Iterable[Quad]) -> set[Quad]:
    """Return the notes of a change of quads; none where everything is to be done anew in any case."""
    asserted = [quad for quad in quads if is_asserted(quad)]
    if not asserted or not made_of(store):
        return set()
    leading = [quad for quad in asserted if quad.predicate != TYPE and not _into_place(store, quad)]
    ends = {quad.subject for quad in asserted} | {quad.object for quad in leading}
    return {_note(reader, node) for reader in _READERS for node in ends if not isinstance(node, Literal)}


def noted(store: Store, reader: str) -> set[Quad]:
    """Return the notes for GRAPH_INFERRED or GRAPH_VALIDATION; the objects are the individuals that changed."""
    return set(store.quads_for_pattern(NamedNode(reader), _INFLUENCED_BY, None, _CHANGED))


def nodes_of(noted: Iterable[Quad]) -> set[NamedNode | BlankNode]:
    """Return the individuals that notes tell of."""
    return {note.object for note in noted if isinstance(note.object, NamedNode | BlankNode)}


def made_of(store: Store) -> set[Quad]:
    """Return the quads that say of what the inferred graphs and the report of validation were made."""
    return {
        quad
        for name in (GRAPH_OWL_RL, GRAPH_VALIDATION)
        for quad in store.quads_for_pattern(NamedNode(name), DERIVED_FROM, None, _REASONED)
    }


def is_asserted(quad: Quad) -> bool:
    """Whether a quad stands in a named graph that nobody inferred."""
    return isinstance(quad.graph_name, NamedNode) and not quad.graph_name.value.startswith(NOT_ASSERTED)


def _into_place(store: Store, quad: Quad) -> bool:
    """Whether a quad leads to a place, which is one whoever stands in it."""
    if quad.predicate not in INTO_PLACES:
        return False
    types = store.quads_for_pattern(quad.object, TYPE, None, None)  # type: ignore[arg-type]
    return any(kind.object in PLACES and is_asserted(kind) for kind in types)


def _note(reader: str, node: object) -> Quad:
    return Quad(NamedNode(reader), _INFLUENCED_BY, node, _CHANGED)  # type: ignore[arg-type]

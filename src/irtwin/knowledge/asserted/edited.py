"""What was changed in an OWL file since it was exported, as in Protégé: the statements that went and that came."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from pyoxigraph import NamedNode, Quad, Store, Triple

from irtwin.errors import InputError
from irtwin.knowledge.owl_rl.closure import say
from irtwin.knowledge.store.blank_nodes import has_blank_node
from irtwin.knowledge.store.export import exported
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.knowledge.store.named_graphs import in_graph
from irtwin.knowledge.store.rdf_input import read_triples
from irtwin.knowledge.vocabulary import GRAPH_ASSERTED, ONTOLOGY, OWL, TYPE

_OF_BOTH_ENDS = {
    NamedNode(f"{OWL}{name}")
    for name in (
        *("disjointWith", "equivalentClass", "equivalentProperty", "inverseOf", "propertyDisjointWith"),
        *("sameAs", "differentFrom"),
    )
}


@dataclass(frozen=True)
class Edit:
    """Quads of named graphs that an edited file takes out, and that it puts in; `words` a line for each."""

    removed: frozenset[Quad]
    added: frozenset[Quad]
    words: tuple[str, ...]


def edit_of(graph: KnowledgeGraph, path: Path) -> Edit:
    """Return what was changed in a file since the graph was exported into it.

    Axioms of unnamed classes, rules and other statements without names are not compared: editors write them anew.
    Raises InputError where the file cannot be read, or is no export of this graph.
    """
    new, old = _named(read_triples(path)), _named(exported(graph))
    if not new & old:
        raise InputError(f"{path}: says nothing that this workspace says; give a file that `irtwin export --owl` wrote")
    gone = {triple for triple in old - new if _turned(triple) not in new}
    known = {triple.subject for triple in old}
    came = {
        triple
        for triple in new - old
        if _turned(triple) not in old and not (triple.subject in known and _is_declaration(triple))
    }
    removed = {
        quad for triple in gone for quad in graph.store.said(triple.subject, triple.predicate) if quad.triple == triple
    }
    words = [f"{sign} {say(triple, graph.base)}" for sign, triple in _in_order(gone, came)]
    return Edit(frozenset(removed), frozenset(in_graph(came, GRAPH_ASSERTED)), tuple(words))


def _named(triples: Iterable[Triple]) -> set[Triple]:
    """Return the triples of names and literals, these as the graph gives them back; not those about the file itself."""
    store = Store()
    store.extend(in_graph(triple for triple in triples if not has_blank_node([triple])))
    return {quad.triple for quad in store if quad.subject != NamedNode(ONTOLOGY)}


def _turned(triple: Triple) -> Triple:
    """Return an axiom that says the same of both its ends as editors may write it, from the other end."""
    if triple.predicate not in _OF_BOTH_ENDS or not isinstance(triple.object, NamedNode):
        return triple
    return Triple(triple.object, triple.predicate, triple.subject)


def _is_declaration(triple: Triple) -> bool:
    """Whether a triple says only what kind of term something is, which editors write of every term."""
    kind = triple.object
    return triple.predicate == TYPE and isinstance(kind, NamedNode) and kind.value.startswith(OWL)


def _in_order(gone: set[Triple], came: set[Triple]) -> list[tuple[str, Triple]]:
    both = [*(("-", triple) for triple in gone), *(("+", triple) for triple in came)]
    return sorted(
        both, key=lambda change: (str(change[1].subject), str(change[1].predicate), change[0] != "-", str(change[1]))
    )

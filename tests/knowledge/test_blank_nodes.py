"""Graphs that say the same are the same, whatever their blank nodes are called."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

from pyoxigraph import BlankNode, NamedNode, Triple

from irtwin.knowledge.store.blank_nodes import has_blank_node, same
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.knowledge.store.rdf_input import read_turtle

A, P = NamedNode("https://example.org/a"), NamedNode("https://example.org/p")


def chain(*names: str) -> set[Triple]:
    nodes = [A, *map(BlankNode, names)]
    return {Triple(one, P, other) for one, other in pairwise(nodes)}


def test_names_of_blank_nodes_do_not_count() -> None:
    assert same(chain("x", "y"), chain("y", "z"))
    assert not same(chain("x", "y"), chain("x", "y", "z"))
    assert not same(chain("x", "y"), {*chain("x"), Triple(A, P, BlankNode("y"))})
    assert not same({*chain("x"), Triple(A, P, A)}, {*chain("x"), Triple(P, P, A)})


def test_they_are_told_where_they_are() -> None:
    assert has_blank_node(chain("x"))
    assert not has_blank_node({Triple(A, P, A)})


def test_a_file_read_anew_is_the_same_and_another_is_not(tmp_path: Path) -> None:
    file, other = tmp_path / "one.ttl", tmp_path / "other.ttl"
    said = "PREFIX x: <https://example.org/> x:a x:p [ x:q [] ] , _:named . _:named x:p <<( [] x:p [] )>> ."
    file.write_text(said)
    other.write_text(f"{said} # another file")
    first = set(read_turtle(file))
    assert len(first) == 4 and first == set(read_turtle(file))
    assert same(first, set(read_turtle(other)))
    assert {node for one in first for node in one}.isdisjoint(
        node for one in read_turtle(other) for node in one if isinstance(node, BlankNode)
    )


def test_graphs_with_the_same_ontology_hold_equal_triples() -> None:
    graphs = KnowledgeGraph(), KnowledgeGraph()
    for graph in graphs:
        graph.load_ontology()
    one, other = (graph.triples() for graph in graphs)
    assert has_blank_node(one) and one == other

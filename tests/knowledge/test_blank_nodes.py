"""Graphs that say the same are the same, whatever their blank nodes are called."""

from __future__ import annotations

from itertools import pairwise

from pyoxigraph import BlankNode, NamedNode, Triple

from irtwin.knowledge.store.blank_nodes import has_blank_node, same

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

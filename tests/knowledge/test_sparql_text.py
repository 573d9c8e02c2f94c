"""What is written into a SPARQL text before it is parsed."""

from __future__ import annotations

import pytest
from pyoxigraph import DefaultGraph, Literal, NamedNode, Quad, Store

from irtwin.errors import InputError
from irtwin.knowledge.sparql_text import using

S, P = NamedNode("http://e/s"), NamedNode("http://e/p")


@pytest.mark.parametrize(
    "text",
    [
        "DELETE WHERE { ?s ?p ?o }",
        "delete { ?s ?p ?o } where { ?s ?p ?o }",
        'PREFIX where: <http://e/> DELETE { ?s where:p ?o } WHERE { ?s where:p ?o FILTER(?o != "WHERE {") }',
        "DELETE { ?s ?p ?o } WHERE { { SELECT * WHERE { ?s ?p ?o } } } # WHERE {",
        "INSERT DATA { <http://e/s> <http://e/p> 'in a' } ; DELETE WHERE { ?s ?p ?o }",
    ],
)
def test_patterns_are_asked_of_the_graph_alone(text: str) -> None:
    store = Store()
    store.extend([Quad(S, P, Literal(name)) for name in ("in a", "not in a")])
    store.add(Quad(S, P, Literal("in a"), NamedNode("http://e/a")))
    store.update(using(text, ["http://e/a"], []))
    assert {quad.object.value for quad in store.quads_for_pattern(None, None, None, DefaultGraph())} == {"not in a"}


def test_what_says_it_itself_is_refused() -> None:
    with pytest.raises(InputError, match="say it once"):
        using("DELETE { ?s ?p ?o } USING <http://e/a> WHERE { ?s ?p ?o }", ["http://e/a"], [])
    assert "USING <http://e/a> WHERE" in using("DELETE { ?s ?p 'USING' } WHERE { ?s ?p 'WITH' }", ["http://e/a"], [])

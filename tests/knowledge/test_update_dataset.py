"""The graphs of a request, written into an update."""

from __future__ import annotations

import pytest
from pyoxigraph import DefaultGraph, Literal, NamedNode, Quad, Store

from irtwin.errors import InputError
from irtwin.knowledge.store.update_dataset import using

S, P = NamedNode("http://e/s"), NamedNode("http://e/p")


@pytest.mark.parametrize(
    "text",
    [
        "DELETE WHERE { ?s ?p ?o }",
        "delete { ?s ?p ?o } where { ?s ?p ?o }",
        'PREFIX where: <http://e/> DELETE { ?s where:p ?o } WHERE { ?s where:p ?o FILTER(?o != "WHERE {") }',
        "DELETE { ?s ?p ?o } WHERE { { SELECT * WHERE { ?s ?p ?o } } } # WHERE {",
        "INSERT DATA { <http://e/s> <http://e/p> 'in a' } ; DELETE WHERE { ?s ?p ?o }",
        "DELETE#}\rWHERE#{\r{ ?s ?p ?o #}\r} ;",
        'DELETE { ?s ?p ?o } #WHERE\rWHERE { ?s ?p ?o FILTER(1<2)#>\r FILTER("""a\\\\""" != """ WHERE """) }',
    ],
)
def test_patterns_are_asked_of_the_graph_alone(text: str) -> None:
    store = Store()
    store.extend([Quad(S, P, Literal(name)) for name in ("in a", "not in a")])
    store.add(Quad(S, P, Literal("in a"), NamedNode("http://e/a")))
    store.update(using(text, ["http://e/a"], []))
    assert {quad.object.value for quad in store.quads_for_pattern(None, None, None, DefaultGraph())} == {"not in a"}


def test_what_says_it_itself_is_refused() -> None:
    with pytest.raises(InputError, match="use only one"):
        using("DELETE { ?s ?p ?o } USING <http://e/a> WHERE { ?s ?p ?o }", ["http://e/a"], [])
    assert "USING <http://e/a> WHERE" in using("DELETE { ?s ?p 'USING' } WHERE { ?s ?p 'WITH' }", ["http://e/a"], [])


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("WITH#\r<http://e/a> DELETE { ?s ?p ?o } WHERE { ?s ?p ?o }", "use only one"),
        (f"DELETE WHERE {{ ?s ?p ?o }} # {'where ' * 100}", "says WHERE at most 100 times"),
        (f"DELETE WHERE {{ ?s ?p '{'}' * 100}' }}", "too long to be given the graphs"),
    ],
)
def test_what_is_no_update_or_too_long_is_refused(text: str, message: str) -> None:
    with pytest.raises(InputError, match=message):
        using(text, ["http://e/a"], [])


def test_a_graph_has_an_iri() -> None:
    with pytest.raises(InputError, match="a graph's name is no IRI"):
        using("DELETE WHERE { ?s ?p ?o }", ["not an IRI"], [])

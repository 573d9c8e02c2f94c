"""Relative IRIs are resolved as RFC 3986 says, against the base that the text has or is given."""

from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.knowledge.vocabulary import ID

BASE = "http://a/b/c/d;p?q"
RESOLVED = {  # RFC 3986, 5.4: a reference, and what it stands for
    "g:h": "g:h", "g": "http://a/b/c/g", "./g": "http://a/b/c/g", "g/": "http://a/b/c/g/", "/g": "http://a/g",
    "//g": "http://g", "?y": "http://a/b/c/d;p?y", "g?y": "http://a/b/c/g?y", "#s": "http://a/b/c/d;p?q#s",
    "g#s": "http://a/b/c/g#s", "g?y#s": "http://a/b/c/g?y#s", ";x": "http://a/b/c/;x", "g;x": "http://a/b/c/g;x",
    "g;x?y#s": "http://a/b/c/g;x?y#s", "": "http://a/b/c/d;p?q", ".": "http://a/b/c/", "./": "http://a/b/c/",
    "..": "http://a/b/", "../": "http://a/b/", "../g": "http://a/b/g", "../..": "http://a/", "../../": "http://a/",
    "../../g": "http://a/g", "../../../g": "http://a/g", "/./g": "http://a/g", "/../g": "http://a/g",
    "g.": "http://a/b/c/g.", ".g": "http://a/b/c/.g", "g..": "http://a/b/c/g..", "..g": "http://a/b/c/..g",
    "./../g": "http://a/b/g", "./g/.": "http://a/b/c/g/", "g/./h": "http://a/b/c/g/h", "g/../h": "http://a/b/c/h",
    "g;x=1/./y": "http://a/b/c/g;x=1/y", "g;x=1/../y": "http://a/b/c/y", "g?y/./x": "http://a/b/c/g?y/./x",
    "g#s/../x": "http://a/b/c/g#s/../x",
}  # fmt: skip


def stands_for(graph: KnowledgeGraph, text: str, **given: str) -> str:
    (row,) = graph.answer(text, **given)
    return str(row["iri"].value)


def test_a_reference_is_resolved_against_the_base_of_the_text_or_of_the_request():
    graph = KnowledgeGraph()
    for reference, iri in RESOLVED.items():
        query = f"SELECT ?iri {{ BIND(<{reference}> AS ?iri) }}"
        assert stands_for(graph, f"BASE <{BASE}> {query}") == iri
        assert stands_for(graph, query, base=BASE) == iri


def test_an_update_resolves_alike():
    for reference, iri in RESOLVED.items():
        graph = KnowledgeGraph()
        graph.update(f"BASE <{BASE}> INSERT DATA {{ GRAPH <> {{ <{reference}> <p> 1 }} }}")
        graph.update(f"INSERT DATA {{ GRAPH <> {{ <{reference}> <p> 2 }} }}", base=BASE)
        told = graph.query(f"SELECT ?n {{ GRAPH <{BASE}> {{ <{iri}> <http://a/b/c/p> ?n }} }} ORDER BY ?n")
        assert [row["n"] for row in told.rows] == [1, 2], reference


def test_a_base_may_be_changed_and_be_relative_itself():
    text = "BASE <http://a/b/> BASE <c/> PREFIX x: <d#> SELECT ?iri { BIND(x:e AS ?iri) }"
    assert stands_for(KnowledgeGraph(), text) == "http://a/b/c/d#e"


def test_without_a_base_a_reference_names_an_individual():
    assert stands_for(KnowledgeGraph(), "SELECT ?iri { BIND(<robot/UR10> AS ?iri) }") == f"{ID}robot/UR10"

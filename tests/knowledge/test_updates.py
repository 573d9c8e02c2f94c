"""SPARQL updates: what they do, that the default graph stays the union, and what is refused."""

from collections.abc import Callable

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pyoxigraph import DefaultGraph, Literal, NamedNode, Quad, Triple

from irtwin.errors import InputError
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.knowledge.store.updates import by_asking, by_doing
from irtwin.knowledge.vocabulary import GRAPH_ASSERTED

A, B = "http://e/a", "http://e/b"


@pytest.fixture
def graph() -> KnowledgeGraph:
    """Two graphs that both hold (x, p, 1), and one of which holds (x, p, 2)."""
    graph = KnowledgeGraph()
    both, alone = (Triple(NamedNode("http://e/x"), NamedNode("http://e/p"), Literal(n)) for n in (1, 2))
    graph.replace(
        [Quad(*both, NamedNode(A)), Quad(*both, NamedNode(B)), Quad(*alone, NamedNode(B))],  # type: ignore[misc]
        "http://e/",
    )
    return graph


def values(graph: KnowledgeGraph) -> dict[str, list[int]]:
    """Return the numbers in each graph, the union under an empty name, after a check that it is one."""
    quads = list(graph.store.embedded.quads_for_pattern(None, None, None, None))
    named = [quad for quad in quads if not isinstance(quad.graph_name, DefaultGraph)]
    assert {quad.triple for quad in named} == graph.triples()
    found: dict[str, list[int]] = {"": sorted(int(triple.object.value) for triple in graph.triples())}
    for quad in named:
        found.setdefault(quad.graph_name.value, []).append(int(quad.object.value))
    return {name: sorted(numbers) for name, numbers in found.items()}


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("INSERT DATA { <x> <p> 3 }", {"": [1, 2, 3], A: [1], B: [1, 2], GRAPH_ASSERTED: [3]}),
        ("INSERT DATA { <x> <p> 2 }", {"": [1, 2], A: [1], B: [1, 2]}),
        ("INSERT DATA { GRAPH <a> { <x> <p> 3 } }", {"": [1, 2, 3], A: [1, 3], B: [1, 2]}),
        ("DELETE DATA { GRAPH <a> { <x> <p> 1 } }", {"": [1, 2], B: [1, 2]}),
        ("DELETE DATA { GRAPH <b> { <x> <p> 2 } }", {"": [1], A: [1], B: [1]}),
        ("DELETE DATA { <x> <p> 1 }", {"": [2], B: [2]}),
        ("DELETE WHERE { ?s <p> ?o }", {"": []}),
        (
            "DELETE { ?s <p> 2 } INSERT { ?s <p> 4 } WHERE { ?s <p> 2 }",
            {"": [1, 4], A: [1], B: [1], GRAPH_ASSERTED: [4]},
        ),
        ("DROP GRAPH <b>", {"": [1], A: [1]}),
        ("DROP GRAPH <nowhere>", {"": [1, 2], A: [1], B: [1, 2]}),
        ("DROP ALL", {"": []}),
        ("INSERT DATA { <x> <p> 3 } ; DELETE DATA { <x> <p> 3 } ; # and back\n", {"": [1, 2], A: [1], B: [1, 2]}),
        (
            'insert data { <x> <p> 3 } # DELETE DATA { <x> <p> 1 } "',
            {"": [1, 2, 3], A: [1], B: [1, 2], GRAPH_ASSERTED: [3]},
        ),
        ("INSERT DATA { <x> <p> 3 . GRAPH <a> { <x> <p> 3 } }", {"": [1, 2, 3], A: [1, 3], B: [1, 2]}),
        ("# nothing", {"": [1, 2], A: [1], B: [1, 2]}),
        ("#x\rINSERT#\rDATA#\r{ <x> <p> 3 } #;", {"": [1, 2, 3], A: [1], B: [1, 2], GRAPH_ASSERTED: [3]}),
        ("INSERT DATA { <x> <p> 3 } #\r; DELETE DATA { <x> <p> 1 } ;\r", {"": [2, 3], B: [2], GRAPH_ASSERTED: [3]}),
        ("INSERT DATA { <x> <p> 3 } ; DELETE WHERE { <x> <p> 1 }", {"": [2, 3], B: [2], GRAPH_ASSERTED: [3]}),
        ("INSERT { <x> <p> 3 } WHERE { FILTER(1<2)#>\r } ;", {"": [1, 2, 3], A: [1], B: [1, 2], GRAPH_ASSERTED: [3]}),
        ("DELETE DATA { <x> <p> 1 . GRAPH <b> { <x> <p> 2 } } ; #}", {"": []}),
    ],
)
def test_the_default_graph_stays_the_union(graph: KnowledgeGraph, text: str, expected: dict[str, list[int]]) -> None:
    graph.update(f"# PREFIX in a comment\nBASE <http://e/>\nPREFIX : <http://e/> {text}")
    assert values(graph) == expected


DATA = st.lists(
    st.tuples(st.sampled_from(["%s", f"GRAPH <{A}> {{ %s }}", f"GRAPH <{B}> {{ %s }}"]), st.integers(1, 4)), max_size=4
)


@settings(max_examples=60)
@given(updates=st.lists(st.tuples(st.sampled_from(["INSERT", "DELETE"]), DATA), max_size=4))
def test_data_by_itself_leaves_what_the_whole_comparison_leaves(updates: list[tuple[str, list]]) -> None:
    looked_up, compared = KnowledgeGraph(), KnowledgeGraph()
    for operation, data in updates:
        said = " ".join(where % f"<http://e/x> <http://e/p> {number} ." for where, number in data)
        text = f"{operation} DATA {{ {said} }}"
        looked_up.update(text)
        compared.change(*by_doing(text, compared.quads()))
        assert set(looked_up.store.embedded) == set(compared.store.embedded)


def asking(graph: KnowledgeGraph) -> Callable[[str], set[Triple]]:
    return lambda query: set(graph.store.embedded.query(query, base_iri="http://e/"))  # type: ignore[arg-type]


TERMS = st.sampled_from(["<x>", "<y>", "?s", "?o", "1", "2", "3"])
FORMS = st.lists(st.tuples(st.sampled_from(["<x>", "<y>", "?s"]), TERMS), max_size=2).map(
    lambda pairs: " . ".join(f"{subject} <p> {value}" for subject, value in pairs)
)


@settings(max_examples=60)
@given(
    gone=FORMS, come=FORMS, where=st.sampled_from(["?s <p> ?o", "?s <p> ?o FILTER(?o > 1)", "GRAPH ?s { <x> ?s ?o }"])
)
def test_a_pattern_that_is_asked_leaves_what_the_whole_comparison_leaves(gone: str, come: str, where: str) -> None:
    """Some end in } within a string, which is no end of a group."""
    graph = KnowledgeGraph()
    numbers = [Triple(NamedNode("http://e/x"), NamedNode("http://e/p"), Literal(n)) for n in (1, 2)]
    graph.replace([Quad(*one, NamedNode(place)) for place in (A, B) for one in numbers], "http://e/")  # type: ignore[misc]
    text = f'DELETE {{ {gone} }} INSERT {{ <y> <q> "}}" . {come} #}}\n }} WHERE {{ {where} }} ;'
    asked = by_asking(text, graph.store.holding, asking(graph), "http://e/")
    assert asked == by_doing(text, graph.quads(), "http://e/")


@pytest.mark.parametrize(
    "text",
    [
        "INSERT { GRAPH <a> { ?s <p> 3 } } WHERE { ?s <p> 1 }",
        "WITH <a> INSERT { ?s <p> 3 } WHERE { ?s <p> 1 }",
        "INSERT { ?s <p> 3 } USING <a> WHERE { ?s <p> 1 }",
        "INSERT { ?s <p> [] } WHERE { ?s <p> 1 }",
        "DELETE WHERE { ?s <p> 1 } ; INSERT DATA { <x> <p> 3 }",
        "DELETE { ?s <p> 1 } WHERE { ?s <p> 1 } ; INSERT { ?s <p> 3 } WHERE { ?s <p> 2 }",
        "DROP ALL",
    ],
)
def test_what_is_no_single_pattern_over_all_graphs_is_not_asked(graph: KnowledgeGraph, text: str) -> None:
    assert by_asking(text, graph.store.holding, asking(graph), "http://e/") is None


def test_data_with_blank_nodes_goes_the_long_way(graph: KnowledgeGraph) -> None:
    graph.update("INSERT DATA { _:b <http://e/p> 3 }")
    assert values(graph)[GRAPH_ASSERTED] == [3]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("INSERT DATA {\n <a b c> }", "not a SPARQL update: error at 2:"),
        ("SELECT * { ?s ?p ?o }", "not a SPARQL update: error at 1:"),
        ("INSERT DATA { } } ; DROP ALL ; INSERT { ", "not a SPARQL update"),
        ("LOAD <http://127.0.0.1:1/x>", "LOAD and SERVICE read from elsewhere"),
        ("load silent <file:///etc/passwd>", "LOAD and SERVICE read from elsewhere"),
        ("INSERT { ?s ?p ?o } WHERE { SERVICE <http://127.0.0.1:1/> { ?s ?p ?o } }", "LOAD and SERVICE read"),
        ("CREATE GRAPH <http://e/a>", "nothing changed: The graph <http://e/a> already exists"),
        ("INSERT DATA { <http://e/x> <http://e/p> 9 } ; CREATE GRAPH <http://e/a>", "nothing changed"),
    ],
)
def test_a_refused_update_changes_nothing(graph: KnowledgeGraph, text: str, message: str) -> None:
    before = values(graph)
    with pytest.raises(InputError, match=message):
        graph.update(text)
    assert values(graph) == before


@pytest.mark.parametrize("end", ["", ";", " ; # and nothing more", "\r#;", "#\n;"])
def test_strings_are_kept_as_they_are(graph: KnowledgeGraph, end: str) -> None:
    said = '"""a\\\\""", """; DELETE WHERE { ?s ?p ?o } #"""'
    graph.update(f"INSERT DATA {{ <http://e/x> <http://e/says> {said} }}{end}")
    graph.update(f"INSERT {{ <http://e/y> <http://e/says> {said} }} WHERE {{ }}{end}")
    rows = graph.query("SELECT ?said { [] <http://e/says> ?said }")
    assert sorted(row["said"] for row in rows) == ["; DELETE WHERE { ?s ?p ?o } #"] * 2 + ["a\\"] * 2


def test_relative_names_are_below_the_base(graph: KnowledgeGraph) -> None:
    graph.update("INSERT DATA { <x> <p> 3 }", base="http://e/")
    assert values(graph)[GRAPH_ASSERTED] == [3]


def test_payload_is_a_word_like_any_other(graph: KnowledgeGraph) -> None:
    graph.update("INSERT DATA { <http://e/x> irt:Payload 5 ; <http://e/load> 6 } # load")
    assert values(graph)[GRAPH_ASSERTED] == [5, 6]

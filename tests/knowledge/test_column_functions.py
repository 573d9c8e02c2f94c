"""Sums by columns, held to what SPARQL makes of the same triples."""

from __future__ import annotations

from typing import Any

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from pyoxigraph import Literal, NamedNode, Quad, RdfFormat, parse

from irtwin.knowledge.store.graph import KnowledgeGraph, in_graph
from irtwin.knowledge.vocabulary import GRAPH_SOURCE

GRAPH = GRAPH_SOURCE + "test"
PLAIN = {"sum": "SUM", "mean": "AVG", "min": "MIN", "max": "MAX", "count": "COUNT"}
XSD = "http://www.w3.org/2001/XMLSchema#"
NUMBERS = st.one_of(
    st.integers(-(10**6), 10**6).map(str),
    st.integers(-100, 100).map(lambda number: f'"{number}"^^<{XSD}int>'),
    st.decimals(-1000, 1000, places=3, allow_nan=False).map(lambda number: f'"{number:f}"^^<{XSD}decimal>'),
    st.floats(-1e6, 1e6).map(lambda number: f'"{number!r}"^^<{XSD}double>'),
)
NO_NUMBERS = st.sampled_from(['"seven"', '"7"', f'"much"^^<{XSD}double>', "true", "<urn:a>"])
ENDS = st.sampled_from(["<urn:a>", "<urn:b>", '"a"', '"a"@en', "1", '"1.0"^^<' + XSD + "double>", "_:b"])
MONTHS = st.sampled_from(["2026-01", "2026-02"]).map(lambda month: f'"{month}-03T04:05:06Z"^^<{XSD}dateTime>')
ENTRIES = st.sampled_from(["<urn:1>", "<urn:2>", "<urn:3>", "_:4"])
RUNS = st.sampled_from(["<urn:run1>", "<urn:run2>"])
TRIPLES = st.one_of(
    *(
        st.tuples(subjects, st.just(f"<urn:{name}>"), objects)
        for subjects, name, objects in [
            (ENTRIES, "energy", NUMBERS | NO_NUMBERS),
            (ENTRIES, "effect", ENDS),
            (ENTRIES, "run", RUNS),
            (RUNS, "robot", ENDS),
            (RUNS, "start", MONTHS),
        ]
    )
)
BY = {  # what a call may group by -> the triple patterns that lead there
    "<urn:effect>": "?one <urn:effect> {end}",
    "'<urn:run>/<urn:robot>'": "?one <urn:run>/<urn:robot> {end}",
    "'<urn:run>/<urn:start>/month'": "?one <urn:run>/<urn:start> ?at{end} BIND(SUBSTR(STR(?at{end}), 1, 7) AS {end})",
}
LEDGER = """
<urn:1> <urn:energy> 3.0e0 ; <urn:effect> <urn:a> . <urn:2> <urn:energy> 4.0e0 ; <urn:effect> <urn:a> .
<urn:3> <urn:energy> 5.0e0 ; <urn:effect> <urn:b> ."""
SUM = "column:sum(<urn:energy>, <urn:effect>, <urn:a>)"


def graph_of(turtle: str) -> KnowledgeGraph:
    graph = KnowledgeGraph()
    graph.replace(in_graph((quad.triple for quad in parse(turtle, RdfFormat.TURTLE)), GRAPH), GRAPH)
    return graph


def ask(graph: KnowledgeGraph, call: str) -> object:
    return graph.query(f"SELECT ({call} AS ?value) {{}}")[0]["value"]


def by_group(graph: KnowledgeGraph, query: str) -> dict[tuple[tuple[type, object], ...], Any]:
    """Each row's last value by the others; 1 and 1.0 are two groups, as in SPARQL, and so are "a" and "a"@en."""
    rows = [list(row.values()) for row in graph.query(query)]
    return {tuple((type(value), value) for value in row[:-1]): row[-1] for row in rows}


@settings(max_examples=25)
@given(
    triples=st.lists(TRIPLES, min_size=4, max_size=30),
    by=st.lists(st.sampled_from(sorted(BY)), min_size=1, max_size=2, unique=True),
    function=st.sampled_from(sorted(PLAIN)),
)
@example(
    triples=[
        ("<urn:1>", "<urn:run>", "<urn:run1>"),
        ("<urn:1>", "<urn:run>", "<urn:run2>"),
        ("<urn:1>", "<urn:energy>", "0"),
        ("<urn:run1>", "<urn:robot>", "1"),
        ("<urn:run1>", "<urn:robot>", f'"1.0"^^<{XSD}double>'),
        ("<urn:run2>", "<urn:robot>", "1"),
    ],
    by=["'<urn:run>/<urn:robot>'"],
    function="count",
)
@example(
    triples=[
        ("_:4", "<urn:energy>", "0"),
        ("_:4", "<urn:effect>", '"a"@en'),
        ("<urn:1>", "<urn:effect>", '"a"'),
        ("<urn:2>", "<urn:effect>", '"a"'),
    ],
    by=["<urn:effect>"],
    function="count",
)
def test_columns_answer_what_the_triples_do(triples: list[tuple[str, ...]], by: list[str], function: str) -> None:
    graph = graph_of(" .\n".join(map(" ".join, triples)) + " .")
    ends = [f"?end{number}" for number in range(len(by))]
    patterns = " . ".join(BY[path].format(end=end).replace("?at?", "?at_") for path, end in zip(by, ends, strict=True))
    arguments = ", ".join(f"{path}, {end}" for path, end in zip(by, ends, strict=True))
    group = " ".join(ends)
    numbers = "?one <urn:energy> ?number FILTER(isNumeric(?number))"
    keys = f"{group} " + " ".join(f"(LANG({end}) AS {end}_language)" for end in ends)
    plain = f"SELECT {keys} ({PLAIN[function]}(?number) AS ?value) {{ {numbers} {patterns} }} GROUP BY {group}"
    call = f"column:{function}(<urn:energy>, {arguments})"
    called = f"SELECT {keys} ({call} AS ?value) {{ SELECT DISTINCT {group} {{ {patterns} }} }}"
    expected, found = by_group(graph, plain), by_group(graph, called)
    assert {key for key, value in found.items() if value} <= expected.keys() <= found.keys()
    for key, value in expected.items():
        assert found[key] == pytest.approx(value, rel=1e-9, abs=1e-6)


def test_without_conditions_everything_is_summed() -> None:
    assert ask(graph_of(LEDGER), "column:sum(<urn:energy>)") == 12.0


def test_where_nothing_fits_there_is_no_sum_and_a_count_of_0() -> None:
    graph = graph_of(LEDGER)
    assert ask(graph, "column:sum(<urn:energy>, <urn:effect>, <urn:c>)") is None
    assert ask(graph, "column:count(<urn:energy>, <urn:effect>, <urn:c>)") == 0
    assert ask(graph, "column:count(<urn:absent>)") == 0


@pytest.mark.parametrize(
    ("call", "fault"),
    [
        ("column:sum()", "takes a property, and pairs of a property and the value that it must lead to"),
        ("column:sum(<urn:energy>, <urn:effect>)", "takes a property, and pairs"),
        ("column:sum('energy')", '"energy" is no property, nor properties in a string: "irt:share_of_Run/irt:run_of"'),
        ("column:sum(<urn:energy>, 'irt:a/', 1)", "is no property"),
        ("column:sum(<urn:energy>, 'irt:a/century', 1)", "is no property"),
        ("column:sum(<urn:energy>, 7, 1)", "is no property"),
        ("column:sum('my:energy')", "my: is no usual prefix; write the property's whole IRI: <https://...>"),
        ("column:sum('<energy>')", "No scheme found in an absolute IRI"),
    ],
)
def test_a_call_that_cannot_be_answered_says_why(call: str, fault: str) -> None:
    table = graph_of(LEDGER).query(f"SELECT ({call} AS ?value) {{}}")
    assert table[0]["value"] is None
    (said,) = table.faults
    assert said.startswith("column:sum: ")
    assert fault in said


def test_columns_follow_every_change() -> None:
    graph = graph_of(LEDGER)
    three, six = (Quad(NamedNode("urn:1"), NamedNode("urn:energy"), Literal(n), NamedNode(GRAPH)) for n in (3.0, 6.0))
    assert ask(graph, SUM) == 7.0
    graph.change([three], [six])
    assert ask(graph, SUM) == 10.0
    graph.change([], [three])
    assert ask(graph, SUM) == 13.0
    graph.update("DELETE DATA { <urn:2> <urn:energy> 4.0e0 }")
    assert ask(graph, SUM) == 9.0
    graph.update("DELETE { ?s <urn:energy> 6.0e0 } WHERE { ?s <urn:effect> <urn:a> }")
    assert ask(graph, SUM) == 3.0
    graph.replace([], GRAPH)
    assert ask(graph, SUM) is None
    graph.replace([six, Quad(six.subject, NamedNode("urn:effect"), NamedNode("urn:a"), NamedNode(GRAPH))], GRAPH)
    assert ask(graph, SUM) == 6.0


def test_every_function_is_described_in_the_ontology() -> None:
    graph = KnowledgeGraph()
    graph.load_ontology()
    told = graph.query("SELECT ?f { ?f a irt:Column_Function ; rdfs:label ?l ; skos:definition ?d ; skos:example ?e }")
    assert {row["f"] for row in told} == {name.value for name in graph._functions({})}
    for row in graph.query("SELECT ?e { ?f a irt:Column_Function ; skos:example ?e }"):
        assert not graph.query(row["e"]).faults

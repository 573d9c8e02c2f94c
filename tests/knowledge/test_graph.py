import random
from collections.abc import Iterator
from datetime import date
from pathlib import Path

import pytest
from pyoxigraph import BlankNode, Literal, NamedNode, Quad
from tests.individuals import individual

from irtwin.errors import InputError
from irtwin.knowledge.store import table, union_store
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.knowledge.store.rdf_input import read_turtle
from irtwin.knowledge.vocabulary import GRAPH_ACTIVITY, GRAPH_ONTOLOGY, GRAPH_SOURCE, term

A, B = "https://example.org/g/a", "https://example.org/g/b"


def quad(subject: str, value: float, graph: str) -> Quad:
    return Quad(
        NamedNode(f"https://example.org/{subject}"), NamedNode(term("Energy")), Literal(value), NamedNode(graph)
    )


def total(graph: KnowledgeGraph) -> float:
    return graph.query("SELECT (SUM(?energy) AS ?total) { ?s irt:Energy ?energy }")[0]["total"]


def broken_off(*quads: Quad) -> Iterator[Quad]:
    yield from quads
    raise RuntimeError("the database went away")


def test_triple_in_two_graphs_counts_once() -> None:
    graph = KnowledgeGraph()
    graph.replace([quad("x", 2.0, A), quad("x", 2.0, B), quad("y", 3.0, B)], A, B)
    assert total(graph) == 5.0
    graph.replace([], B)  # x is still said by A
    assert total(graph) == 2.0
    graph.replace([], A)
    assert total(graph) == 0


def test_what_comes_and_goes_in_two_graphs_stays_in_the_union_as_long_as_one_says_it() -> None:
    draw = random.Random(32)
    every = [quad(name, 1.0, place) for name in ("x", "y") for place in (A, B)]
    with KnowledgeGraph() as graph:
        for _ in range(300):
            graph.change(draw.sample(every, draw.randint(0, 3)), draw.sample(every, draw.randint(0, 3)))
            assert graph.triples() == graph.triples("")


def test_many_new_quads_go_into_files_of_their_own_and_count_once(tmp_path: Path) -> None:
    many = [quad(f"{number}", 1.0, A) for number in range(10_000)]
    with KnowledgeGraph(tmp_path / "graph") as graph:
        graph.replace([quad("0", 1.0, B)], B)  # the first of them, in another graph
        log = sum(file.stat().st_size for file in (tmp_path / "graph").glob("*.log"))
        graph.change([], many)
        assert sum(file.stat().st_size for file in (tmp_path / "graph").glob("*.log")) == log
        assert set(graph.quads()) == {*many, quad("0", 1.0, B)}
        assert total(graph) == 10_000.0


def test_files_of_several_loads_are_merged(tmp_path: Path) -> None:
    def files() -> int:
        return len(list((tmp_path / "graph").glob("*.sst")))

    with KnowledgeGraph(tmp_path / "graph") as graph:
        for name in (A, B):
            graph.change([], [quad(f"{number}", 1.0, name) for number in range(10_000)])
        before = files()
        graph.store.merge_loads()
        assert files() < before
        assert total(graph) == 10_000.0


def test_replace_drops_graphs_below_that_have_nothing_left(two_robots: list[Quad], graph: KnowledgeGraph) -> None:
    kept = [quad for quad in two_robots if "Arm_B" not in quad.graph_name.value]
    changed = graph.replace(kept, GRAPH_SOURCE, GRAPH_ACTIVITY)
    assert all("Arm_B" in name for name in changed)
    assert not any("Arm_B" in name for name in graph.graphs(GRAPH_ACTIVITY, GRAPH_SOURCE))
    assert GRAPH_ACTIVITY + "energy.Arm_A" in graph.graphs(GRAPH_ACTIVITY)


def test_a_name_in_a_slash_stands_for_the_graphs_below_it_and_any_other_for_itself(graph: KnowledgeGraph) -> None:
    assert graph.graphs(GRAPH_ACTIVITY + "energy", GRAPH_ACTIVITY) == graph.graphs(GRAPH_ACTIVITY)
    assert graph.graphs(GRAPH_ACTIVITY + "energy", GRAPH_ONTOLOGY) == [GRAPH_ONTOLOGY]
    assert graph.triples(GRAPH_ACTIVITY + "energy") == set()
    assert graph.triples(GRAPH_ACTIVITY + "energy.Arm_A")
    assert graph.graphs("") == graph.graphs()


def test_same_quads_change_nothing(two_robots: list[Quad], graph: KnowledgeGraph) -> None:
    assert graph.replace(two_robots, GRAPH_SOURCE, GRAPH_ACTIVITY) == []


def test_failed_replace_leaves_the_former_content(two_robots: list[Quad], graph: KnowledgeGraph) -> None:
    before = graph.triples()
    with pytest.raises(RuntimeError):
        graph.replace(broken_off(two_robots[0]), GRAPH_SOURCE)
    assert graph.triples() == before


def test_failed_first_load_leaves_nothing(tmp_path: Path) -> None:
    with KnowledgeGraph(tmp_path / "graph") as graph:
        with pytest.raises(RuntimeError):
            graph.replace(broken_off(quad("x", 1.0, A)), A)
        assert graph.graphs() == []
        assert graph.triples() == set()


def test_a_first_load_that_fails_after_its_first_piece_leaves_what_was_there(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(union_store, "_AT_ONCE", 2)
    with KnowledgeGraph(tmp_path / "graph") as graph:
        graph.replace([quad("x", 1.0, B), quad("w", 1.0, B)], B)
        before = graph.triples()
        with pytest.raises(RuntimeError):
            graph.replace(broken_off(*(quad(name, 1.0, A) for name in "xyz")), A)
        assert graph.graphs() == [B]
        assert graph.triples() == before
        graph.replace((quad(name, 1.0, A) for name in "vwxyz"), A)
        assert len(graph.triples(A)) == 5
        assert graph.triples() == before | graph.triples(A)


def test_blank_node_of_a_first_load_is_the_same_in_the_union() -> None:
    graph = KnowledgeGraph()
    name = NamedNode(A)
    graph.replace([Quad(BlankNode("b"), NamedNode(term("Energy")), Literal(1.0), name)], A)
    assert graph.query(f"ASK {{ ?b irt:Energy ?e GRAPH <{A}> {{ ?b irt:Energy ?e }} }}")[0]["answer"] is True


def test_quad_outside_the_named_graphs_is_a_bug() -> None:
    with pytest.raises(ValueError, match="does not belong"):
        KnowledgeGraph().replace([quad("x", 1.0, A)], B)


def test_graph_on_disk_outlives_its_process_object(tmp_path: Path, two_robots: list[Quad]) -> None:
    graph = KnowledgeGraph(tmp_path / "graph")
    graph.replace(two_robots, GRAPH_SOURCE, GRAPH_ACTIVITY)
    count = len(graph.triples())
    del graph
    assert len(KnowledgeGraph(tmp_path / "graph").triples()) == count > 600


def test_closed_graph_can_be_opened_again_while_somebody_holds_it(tmp_path: Path, two_robots: list[Quad]) -> None:
    with KnowledgeGraph(tmp_path / "graph") as held:
        held.replace(two_robots, GRAPH_SOURCE, GRAPH_ACTIVITY)
        count = len(held.triples())
    with KnowledgeGraph(tmp_path / "graph") as again:
        assert len(again.triples()) == count
    assert held.graphs() == []


def test_open_graph_cannot_be_opened_again(tmp_path: Path) -> None:
    first = KnowledgeGraph(tmp_path / "graph")
    with pytest.raises(InputError, match="cannot be opened"):
        KnowledgeGraph(tmp_path / "graph")
    assert first.graphs() == []


def test_rows_hold_python_values(graph: KnowledgeGraph) -> None:
    run = individual("run", "Arm_A.fit_1")
    table = graph.query(
        """SELECT ?run ?name ?time ?count ?start ?nothing WHERE {
             ?run irt:Run_Name ?name ; irt:Run_Time ?time ; irt:Sample_Count ?count ; irt:Start_Time ?start
             OPTIONAL { ?run irt:Note ?nothing } }""",
        {"run": run},
    )
    assert table.columns == ("run", "name", "time", "count", "start", "nothing")
    (row,) = table
    assert (row["run"], row["name"], row["time"], row["count"], row["nothing"]) == (run, "fit_1", 10.0, 1000, None)
    assert row["start"].isoformat() == "2026-03-02T08:00:00+00:00"
    assert graph.query("SELECT ('2026-03-02'^^xsd:date AS ?day) {}")[0] == {"day": date(2026, 3, 2)}


def test_ask_and_construct(graph: KnowledgeGraph) -> None:
    assert graph.query("ASK { ?s a irt:Industrial_Robot }").rows == ({"answer": True},)
    table = graph.query("CONSTRUCT { ?s irt:Run_Name ?n } WHERE { ?s irt:Run_Name ?n }")
    assert len(table) == 5
    assert set(table.columns) == {"subject", "predicate", "object"}


@pytest.mark.parametrize("text", ["", "SELECT", "SELECT * WHERE { ?s ?p }", "INSERT DATA { }", "DROP ALL"])
def test_what_is_no_query_is_refused(graph: KnowledgeGraph, text: str) -> None:
    before = graph.triples()
    with pytest.raises(InputError, match="not a SPARQL query"):
        graph.query(text)
    assert graph.triples() == before


def test_too_many_answers_are_refused(graph: KnowledgeGraph, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(table, "MOST_ROWS", 10)
    with pytest.raises(InputError, match="add a LIMIT"):
        graph.query("SELECT * { ?s ?p ?o }")
    assert len(graph.query("SELECT * { ?s ?p ?o } LIMIT 10")) == 10


def test_broken_turtle_names_file_and_line(tmp_path: Path) -> None:
    file = tmp_path / "broken.ttl"
    file.write_text("@prefix ex: <https://example.org/> .\nex:a ex:b .\n")
    with pytest.raises(InputError, match=r"broken\.ttl, line 2"):
        list(read_turtle(file))


@pytest.mark.parametrize(
    "text",
    [
        "SELECT ?run WHERE { ?run irt:run_of ?robot }",
        "SELECT ?run { ?run irt:run_of ?robot }",
        "SELECT ?robot ?run WHERE { OPTIONAL { ?run irt:run_of ?robot } }",
        "SELECT ?run # WHERE {\n WHERE { { SELECT ?run ?arm WHERE { ?run irt:run_of ?arm } } FILTER(?arm = ?robot) }",
        "CONSTRUCT { ?run a ?robot } WHERE { ?run irt:run_of ?robot }",
    ],
)
def test_binding_restricts_a_variable_that_need_not_be_asked_for(graph: KnowledgeGraph, text: str) -> None:
    assert len(graph.query(text, {"robot": individual("robot", "Arm_A")})) == 3
    assert len(graph.query(text, {"robot": individual("robot", "Arm_B")})) == 2


def test_binding_that_is_no_iri_is_a_bug(graph: KnowledgeGraph) -> None:
    with pytest.raises(ValueError, match="IRI"):
        graph.query("SELECT * { ?robot ?p ?o }", {"robot": "x> } INSERT"})


def test_a_graph_says_that_it_is_behind_from_the_first_change_until_the_last_was_made() -> None:
    graph = KnowledgeGraph()
    with graph.rewritten():
        assert not graph.is_behind
        graph.replace([quad("x", 2.0, A)], A)
        assert graph.is_behind
    assert not graph.is_behind
    with graph.rewritten():
        graph.replace([quad("x", 2.0, A)], A)  # as it was
        assert not graph.is_behind
        graph.rows_change()
        assert graph.is_behind
    assert not graph.is_behind and total(graph) == 2.0
    graph.change([], [quad("y", 2.0, A)])
    graph.rows_change()  # of a live run, which shows by itself what becomes of its rows
    assert not graph.is_behind


def test_it_goes_on_to_say_so_where_that_fails_until_a_later_one_ends_well() -> None:
    graph = KnowledgeGraph()
    with pytest.raises(KeyError), graph.rewritten():
        graph.replace([quad("x", 2.0, A)], A)
        raise KeyError
    assert graph.is_behind
    with graph.rewritten():
        assert graph.is_behind
    assert not graph.is_behind
    with pytest.raises(KeyError), graph.rewritten():
        raise KeyError
    assert not graph.is_behind

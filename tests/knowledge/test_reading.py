"""Answers that are kept, and forgotten when the graph changes, whoever changes it."""

from __future__ import annotations

import subprocess
import sys
import threading
from pathlib import Path

import pytest
from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, rule
from pyoxigraph import Literal, NamedNode, Quad

from irtwin.errors import InputError
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.knowledge.store.reading import KeptAnswers
from irtwin.knowledge.store.snapshot import Snapshot
from irtwin.knowledge.vocabulary import GRAPH_SOURCE

GRAPH = GRAPH_SOURCE + "test"
ASK = "SELECT ?s ?n { ?s <urn:p> ?n } ORDER BY ?s ?n"
SUM = "SELECT (SUM(?n) AS ?sum) { ?s <urn:p> ?n }"
WRITE = "from pyoxigraph import *; import sys; Store(sys.argv[1]).update(sys.argv[2])"


def quad(subject: str, number: int) -> Quad:
    return Quad(NamedNode(f"urn:{subject}"), NamedNode("urn:p"), Literal(number), NamedNode(GRAPH))


def holding(*quads: Quad) -> KnowledgeGraph:
    graph = KnowledgeGraph()
    graph.replace(quads, GRAPH)
    return graph


def test_an_answer_is_found_once(monkeypatch: pytest.MonkeyPatch) -> None:
    graph = holding(quad("a", 1))
    first = graph.query(ASK)
    monkeypatch.setattr(graph, "answer", None)
    assert graph.query(ASK) == first


def test_what_a_caller_does_to_rows_is_its_own() -> None:
    graph = holding(quad("a", 1))
    graph.query(ASK)[0]["n"] = 7
    assert graph.query(ASK)[0]["n"] == 1


def test_bindings_ask_another_question() -> None:
    graph = holding(quad("a", 1), quad("b", 2))
    assert [graph.query(ASK, {"s": f"urn:{name}"})[0]["n"] for name in "aba"] == [1, 2, 1]


SUBJECTS, NUMBERS = st.sampled_from("abc"), st.integers(0, 3)


class Writing(RuleBasedStateMachine):
    """All ways to write to a graph, one after the other; after each, answers are those of a graph that keeps none."""

    def __init__(self) -> None:
        super().__init__()
        self.graph = KnowledgeGraph()

    @rule(subject=SUBJECTS, number=NUMBERS)
    def add(self, subject: str, number: int) -> None:
        self.graph.change([], [quad(subject, number)])

    @rule(subject=SUBJECTS, before=NUMBERS, after=NUMBERS)
    def change(self, subject: str, before: int, after: int) -> None:
        self.graph.change([quad(subject, before)], [quad(subject, after)])

    @rule(numbers=st.lists(NUMBERS, max_size=2))
    def put_in_place(self, numbers: list[int]) -> None:
        self.graph.replace([quad("a", number) for number in numbers], GRAPH)

    @rule(subject=SUBJECTS, number=NUMBERS, verb=st.sampled_from(["INSERT", "DELETE"]))
    def update_data(self, subject: str, number: int, verb: str) -> None:
        self.graph.update(f"{verb} DATA {{ GRAPH <{GRAPH}> {{ <urn:{subject}> <urn:p> {number} ; <urn:q> <urn:a> }} }}")

    @rule(number=NUMBERS)
    def update_by_a_pattern(self, number: int) -> None:
        self.graph.update(
            f"DELETE {{ ?s <urn:p> {number} }} INSERT {{ ?s <urn:q> <urn:a> }} WHERE {{ ?s <urn:p> {number} }}"
        )

    @invariant()
    def answers_are_of_now(self) -> None:
        anew = KnowledgeGraph()
        anew.replace(self.graph.quads(), *self.graph.graphs())
        for text in (ASK, SUM):
            assert self.graph.query(text).rows == anew.query(text).rows


TestWriting = Writing.TestCase
TestWriting.settings = settings(max_examples=5, stateful_step_count=8)


def test_an_update_that_fails_leaves_what_is_true() -> None:
    graph = holding(quad("a", 1))
    before = graph.query(ASK)
    with pytest.raises(InputError, match="update"):
        graph.update("no update")
    assert graph.query(ASK) == before


def test_a_view_follows_what_another_process_writes(tmp_path: Path) -> None:
    with KnowledgeGraph(tmp_path / "graph") as graph:
        graph.replace([quad("a", 1)], GRAPH)
    with Snapshot(tmp_path / "graph") as snapshot:
        before = snapshot.current()
        assert [before.query(text)[0] for text in (ASK, SUM)] == [{"s": "urn:a", "n": 1}, {"sum": 1}]
        insert = "INSERT DATA { <urn:a> <urn:p> 10 ; <urn:q> <urn:a> } ; DELETE DATA { <urn:a> <urn:p> 1 }"
        subprocess.run([sys.executable, "-c", WRITE, tmp_path / "graph", insert], check=True)
        now = snapshot.current(at_once=True)
        assert [now.query(text)[0] for text in (ASK, SUM)] == [{"s": "urn:a", "n": 10}, {"sum": 10}]


def test_an_answer_that_was_begun_before_a_change_is_not_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    """Another thread writes while a question is answered."""
    graph = holding(quad("a", 1))
    answer = graph.answer

    def slowly(*arguments: object, **named: object) -> object:
        found = list(answer(ASK))
        writer = threading.Thread(target=graph.change, args=([quad("a", 1)], [quad("a", 2)]))
        writer.start()
        writer.join()
        monkeypatch.undo()
        assert found
        return before

    before = answer(ASK)  # Oxigraph answers from the state in which it was asked
    monkeypatch.setattr(graph, "answer", slowly)
    assert graph.query(ASK)[0]["n"] == 1
    assert graph.query(ASK)[0]["n"] == 2


@pytest.mark.parametrize(
    "call", ["RAND()", "rand()", "STR(UUID())", "STRUUID()", "STR(NOW())", "BNODE()", "series:mean(<urn:a>, 'x', 0, 1)"]
)
def test_what_the_text_alone_does_not_say_is_asked_anew(call: str) -> None:
    graph = KnowledgeGraph(workspace=Path())
    graph.query(text := f"SELECT ({call} AS ?v) {{}}")
    assert graph.answers.get(text) is None


def test_a_large_answer_is_not_kept() -> None:
    graph = KnowledgeGraph()
    graph.query(text := f"SELECT ?v {{ VALUES ?v {{ {' '.join(map(str, range(2001)))} }} }}")
    assert graph.answers.get(text) is None


def test_of_too_many_answers_the_oldest_goes() -> None:
    kept = KeptAnswers(2)
    for text in "ab":
        kept.keep(text.upper(), text)
    assert kept.get("a") == "A"
    kept.keep("C", "c")
    assert [kept.get(text) for text in "abc"] == ["A", None, "C"]


def test_a_server_is_asked_each_time() -> None:
    kept = KeptAnswers(0)
    kept.keep("A", "a")
    assert kept.get("a") is None

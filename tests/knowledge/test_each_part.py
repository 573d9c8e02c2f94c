"""What several processes make of robots' parts is what one makes of them, and so is what they refuse."""

import os
import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest
from pyoxigraph import Literal, NamedNode, Quad
from tests import small_fleet
from tests.individuals import individual
from tests.trusting import trust_all

from irtwin import rewriting
from irtwin.errors import InputError
from irtwin.knowledge import each_part
from irtwin.knowledge.part_worker import PartTask, PartWorker
from irtwin.knowledge.parts import Ontology
from irtwin.knowledge.reasoning import Inferences, reason
from irtwin.knowledge.shacl.validation import Violation, validate
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.knowledge.vocabulary import GRAPH_INFERRED, GRAPH_REASONED, GRAPH_SOURCE, OWL, term
from irtwin.storage.database import Workspace

ENDLESS = f"""
@prefix sh: <http://www.w3.org/ns/shacl#> .
@prefix rdfs: <http://www.w3.org/2000/01/rdf-schema#> .
<urn:endless> a sh:NodeShape ; rdfs:label "endless" ; sh:targetClass <{term("Industrial_Robot")}> ; sh:rule [
  a sh:SPARQLRule ; rdfs:label "endless" ; sh:construct '''
    CONSTRUCT {{ $this <{term("next")}> ?n }}
    WHERE {{ $this a <{term("Industrial_Robot")}> . {{ BIND(0 AS ?zero) }} UNION {{ $this <{term("next")}> ?m }}
      BIND(COALESCE(?m, ?zero) + 1 AS ?n) }}''' ] .
"""


def said(kind: str, name: str, predicate: str, value: NamedNode | Literal) -> Quad:
    return Quad(NamedNode(individual(kind, name)), NamedNode(predicate), value, NamedNode(GRAPH_SOURCE + "said"))


@pytest.fixture(scope="module")
def mapped(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Four robots, mapped: one contradicts itself, one breaks a constraint, the other two are one part."""
    place = tmp_path_factory.mktemp("mapped")
    with Workspace(place) as workspace, KnowledgeGraph.of_workspace(workspace) as graph:
        small_fleet.fill(workspace)
        graph.load_ontology()
        rewriting.map_rows(workspace, graph)
        run = NamedNode(individual("run", "Arm_C.press_1"))
        other = NamedNode(individual("robot", "Arm_D"))
        wrong = said("run", "Arm_C.press_1", OWL + "differentFrom", run)
        untyped = said("robot", "Arm_B", term("has_RunProcess"), NamedNode(individual("run", "Arm_B.untyped")))
        graph.change((), {wrong, untyped, said("robot", "Arm_A", term("beside"), other)})
    return place


@pytest.fixture
def workers(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Let two processes be worth it for anything; tell how many begin."""
    begun = list[int]()

    def counted(told: PartTask) -> PartWorker:
        begun.append(1)
        return PartWorker(told)

    monkeypatch.setattr(each_part, "LEAST_FOR_WORKERS", 0)
    monkeypatch.setattr(each_part, "MOST_TOGETHER", 1)
    monkeypatch.setattr(each_part, "_processors", lambda: 2)
    monkeypatch.setattr(each_part, "PartWorker", counted)
    return begun


def concluded(mapped: Path, place: Path) -> tuple[Inferences, tuple[Violation, ...], set[Quad]]:
    shutil.copytree(mapped, place)
    with Workspace.existing(place) as workspace, KnowledgeGraph.of_workspace(workspace) as graph:
        inferred, violations = reason(graph), validate(graph)
        names = graph.graphs(GRAPH_INFERRED, GRAPH_REASONED)
        return inferred, violations, {quad for name in names for quad in graph.quads_in(name)}


@pytest.mark.nightly
def test_what_several_processes_conclude_and_find_wrong_is_what_one_does(
    mapped: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, request: pytest.FixtureRequest
) -> None:
    by_one = concluded(mapped, tmp_path / "one")
    begun = request.getfixturevalue("workers")
    by_two = concluded(mapped, tmp_path / "two")
    assert begun == [1] * 4  # two to reason, two to validate
    assert by_two == by_one
    inferred, violations, _ = by_one
    assert [node for node, _ in inferred.set_aside] == [
        individual("robot", "Arm_C"),
        individual("run", "Arm_C.press_1"),
    ]
    assert inferred.joined_by is None
    assert any(one.robot == individual("robot", "Arm_B") for one in violations)


@pytest.mark.nightly
def test_rules_that_never_end_are_told_by_a_process_too(mapped: Path, tmp_path: Path, workers: list[int]) -> None:
    place = tmp_path / "place"
    shutil.copytree(mapped, place)
    (place / "rules").mkdir()
    (place / "rules" / "endless_rules.ttl").write_text(ENDLESS)
    trust_all(place)
    with Workspace.existing(place) as workspace, KnowledgeGraph.of_workspace(workspace) as graph:
        with pytest.raises(InputError, match="still find something new after 100 rounds"):
            reason(graph)
        assert graph.graphs(GRAPH_INFERRED) == []
    assert workers


class Ended:
    """Work that ends the process that is told of it."""

    def __call__(self, *_: object) -> Iterator[object]:
        return iter(())

    def __reduce__(self) -> tuple[object, ...]:
        return os._exit, (3,)


def test_a_process_that_ends_before_its_time_is_told(mapped: Path, tmp_path: Path, workers: list[int]) -> None:
    place = tmp_path / "place"
    shutil.copytree(mapped, place)
    with Workspace.existing(place) as workspace, KnowledgeGraph.of_workspace(workspace) as graph:
        with pytest.raises(ChildProcessError, match="ended with 3"):
            list(each_part.of_each(graph, Ontology(graph), Ended()))
        assert not list(place.glob(".view-*"))

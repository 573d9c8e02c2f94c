"""A contradiction is contained: what clashes is set aside, alarms and conclusions of all else stay, and it is told."""

from __future__ import annotations

import shutil
from pathlib import Path
from unittest import mock

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pyoxigraph import Literal, NamedNode, Quad, Triple
from tests.data_sets import irtwin
from tests.knowledge.graphs import turtle
from tests.small_robots import data_set

from irtwin.knowledge.conclusions import contain
from irtwin.knowledge.owl_rl.closure import Closure, Contradiction
from irtwin.knowledge.reasoning import reason
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.knowledge.vocabulary import GRAPH_INFERRED, term
from irtwin.rewriting import rewriting
from irtwin.storage.database import Workspace

ONTOLOGY = turtle(
    "ex:mass a owl:FunctionalProperty . ex:Press owl:disjointWith ex:Robot . ex:moves rdfs:domain ex:Robot ."
)
SAME = turtle("ex:a owl:sameAs ex:b .")
OF_EACH = " ".join(f"ex:{it} ex:mass 1, 2, 3 ; a ex:Press, ex:Robot ; ex:moves ex:x ." for it in "abc")
STATEMENTS = sorted(turtle(f"{OF_EACH} ex:a owl:differentFrom ex:b .") | SAME, key=str)


def is_sound(statements: set[Triple]) -> bool:
    try:
        Closure(ONTOLOGY | statements)
    except Contradiction:
        return False
    return True


@pytest.mark.slow
@settings(max_examples=25)
@given(st.sets(st.sampled_from(STATEMENTS)))
def test_what_is_left_is_sound_and_only_what_clashes_is_set_aside(premises: set[Triple]) -> None:
    if is_sound(premises):
        return
    aside, _ = contain(ONTOLOGY, premises, lambda out: Closure(ONTOLOGY | (premises - out)))
    assert aside.statements
    assert is_sound(premises - aside.statements)
    joined = premises >= SAME
    for each in aside.statements:  # each has part in a clash among statements about the same individual
        own = {it for it in premises if joined or it.subject == each.subject}
        assert not is_sound(own)


def test_an_individual_that_is_sound_keeps_all_that_is_said_of_it() -> None:
    clashing = turtle("ex:a ex:mass 1, 2 .")
    premises = clashing | turtle("ex:b ex:mass 1 .")
    aside, _ = contain(ONTOLOGY, premises, lambda out: Closure(ONTOLOGY | (premises - out)))
    assert aside.statements == clashing


@pytest.mark.slow
def test_many_clashes_of_a_kind_are_found_at_once() -> None:
    premises = turtle(" ".join(f"ex:run{n} ex:mass {n}, {n}.5 ." for n in range(50)))
    infer = mock.Mock(side_effect=lambda out: Closure(ONTOLOGY | (premises - out)))
    aside, _ = contain(ONTOLOGY, premises, infer)
    assert aside.statements == premises
    assert infer.call_count == 2


def test_an_ontology_of_itself_is_not_doubted() -> None:
    wrong = ONTOLOGY | turtle("ex:r a ex:Robot, ex:Press .")
    with pytest.raises(Contradiction, match="cax-dw"):
        contain(wrong, set(), lambda out: Closure(wrong - out))


# A workspace ------------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def made(small_run: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A workspace with two robots."""
    folder = tmp_path_factory.mktemp("made")
    shutil.copytree(small_run / "workspace", folder / "workspace")
    done = irtwin("run", data_set(folder / "Second", "Second", seed=2), "--workspace", folder / "workspace")
    assert done.status == 0, done.err
    return folder / "workspace"


@pytest.fixture
def workspace(made: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(made, tmp_path / "workspace"))


MINE = "https://plant.example/mine"  # written beside irtwin: what comes by it is tried before it is taken


def second_payload(workspace: Path) -> str:
    """Say a second payload of a run of the first robot; return the run."""
    with Workspace.existing(workspace) as place, rewriting(place) as graph:
        run = next(str(row["run"]) for row in graph.query("SELECT ?run { ?run irt:Payload ?kg } ORDER BY ?run"))
        payload = Quad(NamedNode(run), NamedNode(term("Payload")), Literal(5.5), NamedNode(MINE))
        graph.change((), {payload})
    return run


def concluded(workspace: Path) -> set[Quad]:
    with Workspace.existing(workspace) as place, KnowledgeGraph.of_workspace(place) as graph:
        return {quad for name in graph.graphs(GRAPH_INFERRED) for quad in graph.store.quads_in(name)}


@pytest.mark.nightly
def test_two_payloads_of_a_run_cost_no_other_conclusion_and_are_told_everywhere(workspace: Path) -> None:
    before = concluded(workspace)
    run = second_payload(workspace)
    done = irtwin("workspace", "reason", "--workspace", workspace)
    assert done.status == 3
    assert done.err.splitlines()[-1].startswith(f"irtwin: {workspace}: statements contradict each other (OWL 2 RL rule")
    lost = before - concluded(workspace)
    assert {str(quad.subject.value) for quad in lost} <= {run}  # type: ignore[union-attr]
    told = irtwin("alarms", "--workspace", workspace)
    assert told.status == 0
    assert "contradiction" in told.out and "Arm" in told.out
    status = irtwin("workspace", "status", "--workspace", workspace)
    assert status.status == 2
    assert "statements contradict each other" in status.out


@pytest.mark.nightly
@pytest.mark.slow
def test_a_contradiction_is_over_when_what_is_wrong_goes(workspace: Path) -> None:
    before = concluded(workspace)
    second_payload(workspace)
    assert irtwin("workspace", "reason", "--workspace", workspace).status == 3
    with Workspace.existing(workspace) as place, rewriting(place) as graph:
        graph.change(set(graph.store.quads_in(MINE)), ())
        assert reason(graph).set_aside == ()
    assert concluded(workspace) == before
    assert irtwin("workspace", "status", "--workspace", workspace).status == 0
    assert "contradiction" not in irtwin("alarms", "--workspace", workspace).out

"""Named questions about gaps, answered of hand-written diagnoses through database, mapping and rules."""

from __future__ import annotations

import pytest
from pyoxigraph import RdfFormat, parse
from tests import gap_cases, rows
from tests.mapped import map_into, ontology_graph

from irtwin.knowledge.owl_dl import classify
from irtwin.knowledge.questions.queries import ask
from irtwin.knowledge.reasoning import asserted, reason
from irtwin.knowledge.shacl.validation import validate
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.providers.gap import record
from irtwin.storage.database import Workspace
from irtwin.storage.schema import JointRow

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module", params=gap_cases.VERDICTS)
def diagnosed(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> tuple[str, KnowledgeGraph]:
    verdict = request.param
    with Workspace(tmp_path_factory.mktemp("w")) as workspace:
        joints = [
            JointRow(robot_id=rows.ROBOT, name=name, position=k, kind="revolute")
            for k, name in enumerate(gap_cases.JOINTS, 1)
        ]
        runs = [rows.run(name) for name in gap_cases.RUNS]
        workspace.ingest(rows.robot(), joints, runs, {run.run_id: rows.samples(1) for run in runs})
        record(workspace, rows.ROBOT, gap_cases.document(verdict), gap_cases.curves(verdict), "{}")
        graph = map_into(ontology_graph(), workspace)
    reason(graph)
    return verdict, graph


def answers(graph: KnowledgeGraph, name: str, columns: str) -> list[tuple[object, ...]]:
    return [tuple(row[column] for column in columns.split()) for row in ask(graph, name)]


EXPECTED = {
    "attributed": {
        "why_more_energy": [
            (8.4, "viscous friction", "joint_a3", "changed", 0.7, 0.93),
            (8.4, "Stribeck friction", "joint_a3", "changed", 0.96, 0.93),
        ],
        "where_is_the_gap": [("torque", "joint_a3", "low speed", "speed", 0.81), ("power", None, None, None, 0.12)],
        "what_to_do": {
            "adopt the twin with the causes added",
            "check the gear and its brake for wear",
            "check the gear oil and temperature",
            "identify the twin again",
        },
    },
    "ambiguous": {
        "why_more_energy": [
            (8.4, "Stribeck friction", "joint_a3", "missing", 0.52, 0.9),
            (8.4, "nonlinear viscous friction", "joint_a3", "missing", 0.44, 0.9),
        ],
        "where_is_the_gap": [("torque", "joint_a3", "low speed", "speed", 0.81), ("power", None, None, None, 0.12)],
        "what_to_do": {"measure what tells the rivals apart", "model the effect"},
    },
    "unexplained": {
        "why_more_energy": [(8.4, None, None, None, None, None)],
        "where_is_the_gap": [("torque", "joint_a3", "low speed", "speed", 0.81), ("power", None, None, None, 0.12)],
        "what_to_do": {"look for an effect outside the catalogue"},
    },
    "no_gap": {
        "why_more_energy": [(1.2, None, None, None, None, None)],
        "where_is_the_gap": [],
        "what_to_do": {"keep the twin as it is"},
    },
}


def test_why_and_where(diagnosed: tuple[str, KnowledgeGraph]) -> None:
    verdict, graph = diagnosed
    columns = "energy_error_percent effect joints scope confidence closed_fraction"
    assert answers(graph, "why_more_energy", columns) == EXPECTED[verdict]["why_more_energy"]
    assert (
        answers(graph, "where_is_the_gap", "channel joint regime follows share")
        == EXPECTED[verdict]["where_is_the_gap"]
    )


def test_what_to_do(diagnosed: tuple[str, KnowledgeGraph]) -> None:
    verdict, graph = diagnosed
    assert {action for (action,) in answers(graph, "what_to_do", "action")} == EXPECTED[verdict]["what_to_do"]


def test_what_shrinks_and_what_cannot_be_tested(diagnosed: tuple[str, KnowledgeGraph]) -> None:
    verdict, graph = diagnosed
    said = gap_cases.diagnosis(verdict)
    measures = {measure for (measure,) in answers(graph, "gap_shrinkage", "measure")}
    assert measures == {name for name in ("torque_rmse", "power_rmse", "energy_error_percent") if said["shrink"][name]}
    whys = {why for (why,) in answers(graph, "not_testable", "why")}
    assert whys == {item["why"] for item in said["not_testable"]}


def test_every_individual_says_who_made_it(diagnosed: tuple[str, KnowledgeGraph]) -> None:
    _, graph = diagnosed
    orphans = graph.query(
        """SELECT ?thing WHERE {
          VALUES ?kind { irt:Gap_Diagnosis irt:Gap_Size irt:Gap_Location irt:Gap_Disturbance
            irt:Gap_Disturbance_Quantity irt:Gap_Finding irt:Gap_Finding_Member
            irt:Gap_Cause irt:Gap_Cause_Parameter
            irt:Gap_Competitor irt:Gap_Change irt:Gap_Shrinkage irt:Untestable_Effect
            irt:Next_Experiment irt:Experiment_Instruction irt:Experiment_Run irt:Experiment_Setting
            irt:Experiment_Question irt:Considered_Experiment }
          ?thing a ?kind
          FILTER NOT EXISTS { ?thing prov:wasGeneratedBy / prov:wasAssociatedWith provider:diagnosis } }"""
    )
    assert list(orphans) == []


def test_a_diagnosis_that_cannot_be_is_told(diagnosed: tuple[str, KnowledgeGraph]) -> None:
    verdict, graph = diagnosed
    if verdict != "attributed":
        pytest.skip("one is enough")
    wrong = parse(
        """@prefix irt: <https://w3id.org/irtwin#> . <https://w3id.org/irtwin/graph/source/wrong> {
          <https://w3id.org/irtwin/id/gap_cause/x> a irt:Gap_Cause ; irt:Confidence 1.5e0 ;
            irt:caused_by_Effect <https://w3id.org/irtwin/effect/witchcraft> . }""",
        format=RdfFormat.TRIG,
    )
    graph.replace(wrong, "https://w3id.org/irtwin/graph/source/wrong")
    messages = {violation.message for violation in validate(graph)}
    graph.replace([], "https://w3id.org/irtwin/graph/source/wrong")
    assert "a cause is one effect of the catalogue" in messages
    assert "a cause's confidence is one number between 0 and 1" in messages
    assert "a cause has one id" in messages


def test_the_graph_is_sound(diagnosed: tuple[str, KnowledgeGraph]) -> None:
    assert validate(diagnosed[1]) == ()


@pytest.mark.nightly
def test_hermit_finds_it_consistent(diagnosed: tuple[str, KnowledgeGraph]) -> None:
    classify(asserted(diagnosed[1]))

"""What identifies an individual, and what it can have at most: concluded, or refused, by OWL 2 RL."""

from __future__ import annotations

import pytest
from pyoxigraph import Quad
from tests.knowledge.graphs import turtle

from irtwin.knowledge.conclusions import infer
from irtwin.knowledge.owl_rl.closure import Contradiction
from irtwin.knowledge.parts import Ontology
from irtwin.knowledge.reasoning import asserted, reason
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.knowledge.store.named_graphs import in_graph
from irtwin.knowledge.vocabulary import GRAPH_ASSERTED, ID

HERE = f"@prefix run: <{ID}run/> . @prefix robot: <{ID}robot/> . @base <{ID}> .\n"
AGAIN = 'run:again irt:run_of robot:Arm_A ; irt:Run_Name "fit_1" .'
JOINT = '<joint/other> a irt:Robot_Joint ; irt:joint_of robot:Arm_A ; irt:Joint_Name "j2" .'


def said(text: str) -> list[Quad]:
    """Return what a text in Turtle says, as quads that a user asserts."""
    return list(in_graph(turtle(HERE + text), GRAPH_ASSERTED))


@pytest.mark.parametrize(
    ("text", "same"),
    [
        (AGAIN, "run/Arm_A.fit_1"),
        (JOINT, "joint/Arm_A/j2"),
        (AGAIN.replace("Arm_A", "Arm_B").replace("fit_1", "fit_7"), None),
        (AGAIN.replace("Arm_A", "Arm_B"), None),  # each robot has names of its own
    ],
)
def test_a_key_says_what_is_the_same(graph: KnowledgeGraph, text: str, same: str | None) -> None:
    graph.change((), said(text))
    reason(graph)
    rows = graph.query(
        "SELECT ?other { ?one owl:sameAs ?other FILTER(?one != ?other) FILTER(REGEX(STR(?one), 'again|joint/other')) }"
    )
    assert [row["other"] for row in rows] == ([f"{ID}{same}"] if same else [])


@pytest.mark.parametrize(
    ("text", "why"),
    [
        (f"{AGAIN} run:again a irt:Measured_Run ; irt:Payload 7.5e0 .", "prp-fp, dt-diff"),
        ("run:Arm_A.fit_1 irt:run_of robot:Arm_B .", "prp-fp, dt-diff"),
        ("run:plan a irt:Planned_Run ; irt:run_of robot:Arm_A ; irt:Measured_Energy 5.0e0 .", "cls-maxc1"),
        ('run:Arm_A.fit_1 irt:Run_Role "simulated" .', "prp-fp"),
        ("run:Arm_A.fit_1 irt:Energy_Consumption 7.0e0 .", "prp-fp, dt-diff.*irt:Energy_Consumption"),
        ("run:Arm_A.fit_1 a irt:Industrial_Robot .", r"cax-adc.*id:run/Arm_A\.fit_1"),
        ("run:replay a irt:Replayed_Run ; irt:run_of robot:Arm_A ; irt:Energy_Consumption 5.0e0 .", "cls-maxc1"),
    ],
)
def test_two_where_one_is_meant_contradict(graph: KnowledgeGraph, text: str, why: str) -> None:
    graph.change((), said(text))
    with pytest.raises(Contradiction, match=f"OWL 2 RL rule {why}"):
        infer(Ontology.of(graph), asserted(graph))

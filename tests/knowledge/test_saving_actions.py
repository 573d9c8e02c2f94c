"""Saving actions: what rules propose, and what stays known of one that was done."""

from __future__ import annotations

from pathlib import Path

import pytest

from irtwin.knowledge.questions.queries import ask
from irtwin.knowledge.reasoning import reason
from irtwin.knowledge.shacl.validation import validate
from irtwin.knowledge.store.graph import KnowledgeGraph


@pytest.fixture(scope="module")
def graph(plant_place: Path) -> KnowledgeGraph:
    graph = KnowledgeGraph(workspace=plant_place)
    graph.replace(KnowledgeGraph(plant_place / "graph", read_only=True).quads(), "")
    before = set(map(str, validate(graph)))
    graph.update(
        "INSERT DATA { id:saving_action\\/Arm_C\\/check_gear_oil\\/j1 a irt:Saving_Action ; irt:Done_On '2026-03-02' ; "
        "irt:saves_at id:robot\\/Arm_C ; irt:applies_Remedy <https://w3id.org/irtwin/remedy/check_gear_oil> . "
        "<urn:ours> a irt:Saving_Action ; irt:Done_On '2026-03-03' ; irt:saves_at id:robot\\/Arm_A ; "
        "rdfs:label 'lighter gripper' }"
    )
    reason(graph)
    assert set(map(str, validate(graph))) == before
    return graph


def test_what_was_done_is_listed_where_nothing_calls_for_it(graph: KnowledgeGraph) -> None:
    done = [row for row in ask(graph, "saving_actions") if row["state"] == "done"]
    assert [(row["action"], row["place"], row["done_on"]) for row in done] == [
        ("lighter gripper", "", "2026-03-03"), ("check the gear oil and temperature", "j1", "2026-03-02")
    ]  # fmt: skip


WRONG = {
    "irt:Done_On 'yesterday' ; irt:saves_at id:robot\\/Arm_A": "was done on one day, written as 2026-03-02",
    "irt:Done_On '2026-03-02' ; irt:saves_at id:robot\\/Arm_Q": "saves at one robot",
    "irt:Done_On '2026-03-02'": "saves at one robot",
}


def test_what_is_no_day_or_of_no_robot_breaks_a_constraint(graph: KnowledgeGraph) -> None:
    copy = KnowledgeGraph()
    copy.replace(graph.quads(), "")
    for number, said in enumerate(WRONG):
        copy.update(f"INSERT DATA {{ <urn:mine{number}> a irt:Saving_Action ; {said} }}")
    reason(copy)
    found = validate(copy)
    for number, why in enumerate(WRONG.values()):
        assert [one for one in found if one.node == f"urn:mine{number}" and why in str(one)] != [], why

"""Rules by SPARQL, as pySHACL runs them, and the graph before HermiT."""

import pytest
import rdflib
from pyoxigraph import Literal, NamedNode, Triple
from tests.individuals import individual
from tests.knowledge.graphs import by_pyshacl

from irtwin.errors import InputError
from irtwin.knowledge import owl_dl
from irtwin.knowledge.reasoning import asserted, reason
from irtwin.knowledge.rules.files import read_rules
from irtwin.knowledge.rules.running import conclusions
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.knowledge.store.rdf_input import read_turtle
from irtwin.knowledge.vocabulary import (
    GRAPH_ONTOLOGY,
    GRAPH_OWL_RL,
    GRAPH_SHACL,
    RDF,
    shorten,
    term,
)
from irtwin.resources import folder

pytestmark = pytest.mark.slow

TYPE = RDF + "type"
RUN = "Arm_A.idle_1"
CONCLUSIONS = {
    ("id:twin/Arm_A.t1", "irt:fails_on", "id:run/Arm_A.check_1"),
    ("id:twin/Arm_B.t1", "irt:fails_on", "id:run/Arm_B.work_1"),  # that it was fitted to
    *(
        (f"id:{thing}", "irt:exceeds", f"limit:{limit}")
        for limit, things in {
            "energy_error": ("run/Arm_A.check_1", "run/Arm_B.work_1"),
            "excess_energy": ("run/Arm_A.check_1", "run/Arm_B.work_1"),
            "idle_share": ("run/Arm_A.idle_1",),
            "standby_share": ("run/Arm_A.fit_1", "run/Arm_A.check_1", "run/Arm_A.idle_1"),
            "returned_share": ("run/Arm_B.work_2",),
            "interval_share": ("parameter/Arm_A.t1.coulomb_friction.j2.Fc", "parameter/Arm_B.t1.standby_power.P0"),
        }.items()
        for thing in things
    ),
}
DOMINANT = {
    ("id:run/Arm_A.fit_1", "irt:dominant_Joint", "id:joint/Arm_A/j1"),
    ("id:run/Arm_A.check_1", "irt:dominant_Joint", "id:joint/Arm_A/j2"),
    ("id:run/Arm_A.idle_1", "irt:dominant_Joint", "id:joint/Arm_A/j1"),
    ("id:run/Arm_B.work_1", "irt:dominant_Joint", "id:joint/Arm_B/j1"),
    ("id:run/Arm_B.work_2", "irt:dominant_Joint", "id:joint/Arm_B/j2"),
}
ALARMS = {
    (f"id:twin_alarm/{run}", name, value)
    for run in ("Arm_A.check_1", "Arm_B.work_1")
    for name, value in (
        ("rdf:type", "irt:Twin_Alarm"),
        ("irt:alarm_of_Run", f"id:run/{run}"),
        ("irt:raised_by_Rule", "https://w3id.org/irtwin/rules/twin_alarm"),
    )
}
ACTIONS = {
    (f"id:saving_action/{robot}/switch_off_while_waiting", name, value)
    for robot in ("Arm_A", "Arm_B")
    for name, value in (
        ("rdf:type", "irt:Saving_Action"),
        ("irt:saves_at", f"id:robot/{robot}"),
        ("irt:called_for_by", f"id:robot/{robot}"),
        ("irt:applies_Remedy", "https://w3id.org/irtwin/remedy/switch_off_while_waiting"),
        ("irt:waits_for", "provider:verification"),  # until somebody says when it was done
        ("irt:lacks", "irt:Done_On"),
    )
}
REASON = "the twin misses the energy of this run by 12 %, more than 10 %; identify it again"


def short(triples: set[Triple]) -> set[tuple[str, ...]]:
    return {
        tuple(shorten(one.value) for one in (triple.subject, triple.predicate, triple.object)) for triple in triples
    }


def test_rules_conclude_what_is_known_of_two_robots(reasoned: KnowledgeGraph) -> None:
    links = short({one for one in reasoned.triples(GRAPH_SHACL) if not isinstance(one.object, Literal)})
    assert links == CONCLUSIONS | DOMINANT | ALARMS | ACTIONS
    said = {one for one in short(reasoned.triples(GRAPH_SHACL)) - links if "twin_alarm/Arm_A" in one[0]}
    assert said == {
        ("id:twin_alarm/Arm_A.check_1", "irt:Alarm_Since", "2026-03-02T09:00:00Z"),
        ("id:twin_alarm/Arm_A.check_1", "irt:Alarm_State", "active"),
        ("id:twin_alarm/Arm_A.check_1", "irt:Alarm_Reason", REASON),
    }


def test_closure_types_what_rules_concluded(reasoned: KnowledgeGraph) -> None:
    closed = short(reasoned.triples(GRAPH_OWL_RL))
    assert ("id:joint/Arm_A/j1", "irt:joint_of", "id:robot/Arm_A") not in closed  # asserted
    assert {
        ("id:run/Arm_A.fit_1", "rdf:type", "prov:Activity"),
        ("id:robot/Arm_A", "irt:has_Joint", "id:joint/Arm_A/j1"),
        ("id:run/Arm_A.idle_1", "rdf:type", "irt:Wasteful_Run"),  # of what a rule said of a limit
        ("id:robot/Arm_A", "rdf:type", "irt:Robot_To_Identify_Anew"),
    } <= closed


def test_changed_limit_changes_the_conclusions(graph: KnowledgeGraph) -> None:
    of_limit = f"GRAPH <{GRAPH_ONTOLOGY}> {{ limit:idle_share irt:Limit_Value"
    graph.update(f"DELETE {{ {of_limit} ?v }} }} INSERT {{ {of_limit} 0.15e0 }} }} WHERE {{ {of_limit} ?v }} }}")
    reason(graph)
    idle = {subject for subject, _, kind in short(graph.triples(GRAPH_OWL_RL)) if kind == "irt:Idle_Heavy_Run"}
    assert idle == {"id:run/Arm_A.idle_1", "id:run/Arm_A.check_1"}


def test_set_wise_rules_give_what_pyshacl_gives(graph: KnowledgeGraph) -> None:
    before = graph.triples()
    rules = folder("rules") / "rules.ttl"
    expected = by_pyshacl(before, rdflib.Graph().parse(rules)) - before
    ours = set().union(*conclusions(before, read_rules(rules)).values()) - before
    of_rules, of_pyshacl = (
        short({one for one in found if not isinstance(one.object, Literal)}) for found in (ours, expected)
    )
    assert of_rules == of_pyshacl == CONCLUSIONS | DOMINANT | ALARMS


@pytest.mark.nightly
def test_hermit_finds_two_robots_consistent(graph: KnowledgeGraph) -> None:
    owl_dl.classify(asserted(graph))


@pytest.mark.nightly
def test_hermit_finds_the_kr6_sheet_consistent(graph: KnowledgeGraph) -> None:
    sheet = set(read_turtle(folder("ontology") / "robots" / "kuka_kr6_r700.ttl"))
    owl_dl.classify(graph.triples(GRAPH_ONTOLOGY) | sheet)


@pytest.mark.parametrize(
    ("subject", "predicate", "value"),
    [
        # test_keys and test_owl_rl hold such by OWL 2 RL
        pytest.param(individual("run", RUN), TYPE, NamedNode(term("Industrial_Robot")), marks=pytest.mark.nightly),
        pytest.param(individual("run", RUN), term("Energy_Consumption"), Literal(7.0), marks=pytest.mark.nightly),
        pytest.param(individual("run", RUN), term("Run_Time"), Literal("long"), marks=pytest.mark.nightly),
        (
            "https://w3id.org/irtwin/effect/copper_loss",
            term("has_Channel"),
            NamedNode("https://w3id.org/irtwin/channel/torque"),
        ),
    ],
)
def test_hermit_finds_a_contradiction(
    graph: KnowledgeGraph, subject: str, predicate: str, value, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(owl_dl, "_clash", lambda world: "")  # the search takes seconds, and has a test of its own
    wrong = Triple(NamedNode(subject), NamedNode(predicate), value)
    with pytest.raises(InputError, match="contradict each other"):
        owl_dl.classify(graph.triples() | {wrong})


@pytest.mark.nightly
def test_hermit_names_a_class_that_nothing_can_belong_to(graph: KnowledgeGraph) -> None:
    subclass = NamedNode("http://www.w3.org/2000/01/rdf-schema#subClassOf")
    wrong = Triple(NamedNode(term("Idle_Heavy_Run")), subclass, NamedNode(term("Series")))
    with pytest.raises(InputError, match="irtwin#Idle_Heavy_Run"):
        owl_dl.classify(graph.triples(GRAPH_ONTOLOGY) | {wrong})

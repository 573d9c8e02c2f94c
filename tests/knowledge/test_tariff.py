"""What energy costs and emits, and what waiting takes: concluded by rules, explained down to `plant.toml`."""

from __future__ import annotations

import random
from hashlib import sha256
from pathlib import Path

import pytest
from tests import plants
from tests.knowledge.graphs import turtle

from irtwin.errors import InputError
from irtwin.knowledge.explain import rules
from irtwin.knowledge.explain.explain import explain
from irtwin.knowledge.explain.explanation import LEFT_OUT
from irtwin.knowledge.explain.verify import WHOLE, verify
from irtwin.knowledge.questions.queries import named_questions
from irtwin.knowledge.reasoning import reason
from irtwin.knowledge.rules.files import read_rules
from irtwin.knowledge.rules.running import conclusions
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.knowledge.store.named_graphs import in_graph
from irtwin.knowledge.vocabulary import GRAPH_SOURCE, term
from irtwin.resources import shipped

KWH = 3.6e6


@pytest.fixture(scope="module")
def graph(plant_place: Path) -> KnowledgeGraph:
    return KnowledgeGraph(plant_place / "graph", read_only=True)


def of(graph: KnowledgeGraph, subject: str, name: str) -> object:
    """Return the value of a property, None where it has none."""
    found = graph.query(f"SELECT ?value {{ <{graph.iri(subject)}> <{term(name)}> ?value }}")
    return next((row["value"] for row in found), None)


def test_a_run_and_a_robot_cost_and_emit(graph: KnowledgeGraph) -> None:
    assert of(graph, "run/Arm_A.fit_1", "Energy_Cost") == pytest.approx(1000 / KWH * 0.2)
    assert of(graph, "run/Arm_A.fit_1", "Currency") == "EUR"
    assert of(graph, "run/Arm_A.fit_1", "Carbon_Emission") == pytest.approx(1000 / KWH * 0.4)
    assert of(graph, "robot_total/Arm_A", "Energy_Cost") == pytest.approx(4600 / KWH * 0.2)
    assert of(graph, "run/Arm_C.press_1", "Energy_Cost") is None  # mechanical
    assert of(graph, "run/Arm_A.pick", "Energy_Cost") is None  # planned


def test_what_a_robot_takes_while_it_waits(graph: KnowledgeGraph) -> None:
    waiting = 10 * 0.1 + 20 * 0.2 + 30 * 0.8  # s of 60, at 50 W, 1 W up or down
    expected = {
        "Waiting_Time": waiting,
        "Waiting_Share": waiting / 60,
        "Waiting_Energy": 50 * waiting,
        "Waiting_Energy_Lower": 49 * waiting,
        "Waiting_Energy_Upper": 51 * waiting,
        "Waiting_Energy_Share": 50 * waiting / 4600,
        "Yearly_Saving": 50 * waiting / 60 * 1000 * 3600,
        "Yearly_Saving_Lower": 49 * waiting / 60 * 1000 * 3600,
    }
    assert {name: of(graph, "robot/Arm_A", name) for name in expected} == pytest.approx(expected)
    assert of(graph, "robot/Arm_D", "Waiting_Energy") is None  # no twin


@pytest.mark.slow
def test_without_an_interval_of_standby_there_is_none_of_the_saving(graph: KnowledgeGraph) -> None:
    with_one = [name for name in ("Arm_A", "Arm_B") if of(graph, f"robot/{name}", "Yearly_Saving_Lower") is not None]
    assert with_one == ["Arm_A", "Arm_B"]
    parameter = graph.iri("parameter/Arm_B.t1.standby_power.robot.P0")
    bare = KnowledgeGraph()
    bare.replace(graph.quads(), "")
    bare.update(f"DELETE WHERE {{ GRAPH ?g {{ <{parameter}> <{term('Interval_Lower')}> ?low }} }}")
    plants.reason(bare)
    assert of(bare, "robot/Arm_B", "Yearly_Saving") is not None
    assert of(bare, "robot/Arm_B", "Yearly_Saving_Lower") is None


def test_a_cost_is_explained_down_to_the_tariff(graph: KnowledgeGraph) -> None:
    (found,) = explain(graph, "id:run/Arm_A.fit_1 irt:Energy_Cost ?")
    said = str(found)
    assert 'by the rule "cost of energy", in SHACL' in said
    assert 'tariff:electricity irt:Energy_Price "0.2"^^xsd:double' in said and "file plant.toml" in said
    assert 'irt:Energy_Consumption "1000"^^xsd:double' in said
    (found,) = explain(graph, "id:robot/Arm_A irt:Yearly_Saving ?")
    assert "tariff:electricity irt:Operating_Hours" in str(found)


def test_robots_and_joints_are_parts_of_the_plant_that_the_workspace_names(graph: KnowledgeGraph) -> None:
    parts = graph.query("SELECT ?part { ?part irt:part_of ?plant . ?plant a irt:Plant ; rdfs:label 'Werk 1' }")
    assert {graph.iri(f"robot/Arm_{letter}") for letter in "ABCD"} < {row["part"] for row in parts}
    places = graph.query(named_questions()["energy_per_place"].text)
    assert [(row["plant"], row["robots"]) for row in places if row["plant"]] == [("Werk 1", 2)]  # two have a meter
    found = str(explain(graph, "id:robot/Arm_A irt:part_of id:plant/Werk%201")[0])
    assert 'the rule "part of the plant"' in found and "file plant.toml" in found


def logged(place: Path, runs: int) -> KnowledgeGraph:
    """Return a graph of a robot that waited in runs with logs in `place`, and takes 50 W, with what rules conclude."""
    robot = """<robot> a irt:Industrial_Robot . <standby> irt:parameter_of <twin> ; irt:of_Effect <effect> ;
        qudt:hasUnit unit:W ; irt:Parameter_Value 50.0e0 .
        <effect> irt:has_Channel <https://w3id.org/irtwin/channel/power> ; irt:Acts_Per "robot" ; irt:Baseline true ."""
    for run in range(runs):
        (place / f"{run}.csv").write_bytes(b"")
        robot += f"""<run{run}> irt:run_of <robot> ; irt:modelled_by <twin> ; irt:Energy_Consumption {1000 + run}.0e0 ;
            irt:Run_Time 10.0e0 ; irt:Idle_Share 0.5e0 ; irt:Standby_Energy 500.0e0 ; irt:File "{run}.csv" ;
            irt:Checksum "{sha256(b"").hexdigest()}" ; irt:Data_Folder "{place}" ."""
    graph = KnowledgeGraph()
    graph.replace(in_graph(turtle(f"@base <http://x/> . {robot}"), f"{GRAPH_SOURCE}run"), f"{GRAPH_SOURCE}run")
    reason(graph)
    return graph


def test_the_energy_of_waiting_is_explained_and_verified_by_each_run_and_the_standby_power(tmp_path: Path) -> None:
    found = explain(logged(tmp_path, 3), "<http://x/robot> irt:Waiting_Energy ?")
    said = {each.what.removeprefix("http://x/") for each in found[0].because}
    assert 'standby irt:Parameter_Value "50"^^xsd:double' in said
    assert {f'run{run} irt:Energy_Consumption "{1000 + run}"^^xsd:double' for run in range(3)} <= said
    assert [one.state for one in verify(found, tmp_path)] == [WHOLE] * 3
    (tmp_path / "1.csv").write_bytes(b"other")
    assert [Path(one.file).name for one in verify(found, tmp_path) if one.is_wrong] == ["1.csv"]


def test_runs_that_an_explanation_leaves_out_are_not_verified(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(rules, "MOST_TAKEN", 2)
    found = explain(logged(tmp_path, 3), "<http://x/robot> irt:Waiting_Energy ?")
    assert [one.state for one in verify(found, tmp_path) if one.is_wrong] == [LEFT_OUT]
    assert "left out" in str(found[0])


def test_a_tariff_at_fault_is_said(tmp_path: Path) -> None:
    (tmp_path / "plant.toml").write_text("price_per_kwh = -1\n", encoding="utf-8")
    with pytest.raises(InputError, match="price_per_kwh should be a number of at least 0, not -1"):
        KnowledgeGraph(workspace=tmp_path).load_ontology()


def test_what_a_robot_takes_while_it_waits_has_one_last_digit_in_whatever_order_its_runs_come() -> None:
    rng, numbers = random.Random(0), ("Energy_Consumption", "Run_Time", "Idle_Share", "Standby_Energy")
    said = """<robot> a irt:Industrial_Robot . <parameter> irt:parameter_of <twin> ; irt:of_Effect <effect> ;
        qudt:hasUnit unit:W ; irt:Parameter_Value 50.3e0 .
        <effect> irt:has_Channel <https://w3id.org/irtwin/channel/power> ; irt:Acts_Per "robot" ; irt:Baseline true ."""
    for run in range(40):
        drawn = " ; ".join(f"irt:{name} {rng.random():.16f}e0" for name in numbers)
        said += f"<run{run}> irt:run_of <robot> ; irt:modelled_by <twin> ; {drawn} .\n"
    triples = sorted(turtle(f"@base <http://x/> . {said}"), key=str)
    of_tariff = read_rules(shipped().path("rules", "tariff_rules.ttl"))
    found = set()
    for _ in range(5):
        rng.shuffle(triples)
        found.add(frozenset(one for some in conclusions(triples, of_tariff).values() for one in some))
    assert len(found) == 1 and len(next(iter(found))) >= 4

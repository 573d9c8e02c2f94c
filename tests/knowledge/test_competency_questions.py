"""Every named question has its answer of four robots: tests/knowledge/questions/NAME.csv, worked out by hand."""

from __future__ import annotations

import csv
import io
from collections.abc import Callable, Iterable
from pathlib import Path

import pytest
from pyoxigraph import NamedNode, Triple
from sqlalchemy import select
from sqlalchemy.orm import Session
from tests import small_fleet
from tests.mapped import map_into, ontology_graph
from tests.plants import TARIFF

from irtwin.errors import InputError
from irtwin.knowledge.questions.queries import THEMES, ask, named_questions, to_csv
from irtwin.knowledge.reasoning import reason
from irtwin.knowledge.shacl.validation import validate
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.knowledge.store.named_graphs import in_graph
from irtwin.knowledge.store.table import Row
from irtwin.knowledge.vocabulary import GRAPH_INFERRED, RDF, shorten
from irtwin.resources import folder
from irtwin.storage import schema
from irtwin.storage.database import Workspace

ANSWERS = Path(__file__).parent / "questions"
QUESTIONS = named_questions()


@pytest.fixture(scope="module")
def graph(tmp_path_factory: pytest.TempPathFactory) -> KnowledgeGraph:
    place = tmp_path_factory.mktemp("fleet")
    (place / "plant.toml").write_text(TARIFF, encoding="utf-8")
    with Workspace(place) as workspace:
        small_fleet.fill(workspace)
        graph = map_into(ontology_graph(place), workspace)
    reason(graph)
    return graph


def cells(text: str) -> list[list[float | str]]:
    return [[number(cell) for cell in row] for row in csv.reader(io.StringIO(text))]


def number(cell: str) -> float | str:
    try:
        return float(cell)
    except ValueError:
        return cell


@pytest.mark.parametrize("name", QUESTIONS)
def test_the_question_has_its_answer(graph: KnowledgeGraph, name: str) -> None:
    expected = cells((ANSWERS / f"{name}.csv").read_text(encoding="utf-8"))
    near = [[pytest.approx(cell) if isinstance(cell, float) else cell for cell in row] for row in expected]
    assert cells(to_csv(ask(graph, name))) == near


PEOPLE_ASK = {"robot", "run", "joint", "energy", "ledger", "twin", "gap", "fleet"}


def test_forty_questions_that_people_ask_need_what_is_concluded() -> None:
    needy = [question for question in QUESTIONS.values() if question.concluded]
    assert len([question for question in needy if question.theme in PEOPLE_ASK]) >= 40


@pytest.mark.slow
def test_a_question_needs_the_conclusions_that_it_names_and_no_others(graph: KnowledgeGraph) -> None:
    """Its header names them: without any one of these it answers otherwise; one that names none answers the same."""
    answers = {name: list(ask(graph, name)) for name in QUESTIONS}
    concluded = {name: graph.triples(name) for name in graph.graphs(GRAPH_INFERRED)}
    users: dict[str, list[str]] = {}
    for question in QUESTIONS.values():
        for term in question.concluded:
            users.setdefault(term, []).append(question.name)

    def answered_without(left_out: Callable[[Triple], bool], names: Iterable[str]) -> set[str]:
        kept = (
            quad for graph_name, triples in concluded.items() for quad in in_graph(triples, graph_name)
            if not left_out(quad.triple)
        )  # fmt: skip
        graph.replace(kept, GRAPH_INFERRED)
        return {name for name in names if list(ask(graph, name)) == answers[name]}

    try:
        for term, names in users.items():
            assert answered_without(lambda triple, term=term: _concludes(triple, term), names) == set(), term
        needless = {name for name, question in QUESTIONS.items() if not question.concluded}
        assert answered_without(lambda triple: True, QUESTIONS) == needless
    finally:
        answered_without(lambda triple: False, ())


def _concludes(triple: Triple, term: str) -> bool:
    """Whether a triple says that something is of a class, or has a property, of that name."""
    said = triple.object if triple.predicate.value == RDF + "type" else triple.predicate
    return isinstance(said, NamedNode) and shorten(said.value) == term


@pytest.mark.parametrize("name", [name for name, question in QUESTIONS.items() if question.of_robot])
def test_asked_of_one_robot_it_gives_that_robots_rows(graph: KnowledgeGraph, name: str) -> None:
    everything = ask(graph, name)
    assert everything
    for robot in ("Arm_A", "Arm_C"):
        assert list(ask(graph, name, robot)) == [row for row in everything if row["robot"] == robot]


def test_there_are_fifty_questions_and_more_and_each_theme_has_some() -> None:
    assert len(QUESTIONS) >= 50
    assert {question.theme for question in QUESTIONS.values()} == set(THEMES)
    assert all("?" in question.question and question.title for question in QUESTIONS.values())
    assert {file.stem for file in ANSWERS.glob("*.csv")} == set(QUESTIONS)


def test_a_robot_that_is_not_there_is_told(graph: KnowledgeGraph) -> None:
    with pytest.raises(InputError, match=r"there is no robot 'Arm_Q': did you mean Arm_"):
        ask(graph, "energy_per_run", "Arm_Q")
    with pytest.raises(InputError, match="known are Arm_A, Arm_B, Arm_C, Arm_D"):
        ask(graph, "energy_per_run", "xyzzy")


@pytest.mark.parametrize("question", ["fleet_totals", "SELECT * { ?s ?p ?o }", "nothing"])
def test_what_is_not_asked_of_one_robot_is_told(graph: KnowledgeGraph, question: str) -> None:
    with pytest.raises(InputError, match="does not ask about one robot; leave --robot out"):
        ask(graph, question, "Arm_A")


RAW = {  # what a total says, and the same added up over the runs
    "irt:Run_Count": "COUNT(?run)",
    "irt:Total_Run_Time": "SUM(?time)",
    "irt:Total_Idle_Time": "SUM(?idle * ?time)",
    "irt:Metered_Run_Count": "COUNT(?energy)",
    "irt:Metered_Run_Time": "SUM(IF(BOUND(?energy), ?time, 0.0e0))",
    "irt:Total_Energy": "SUM(?energy)",
    "irt:Total_Modelled_Energy": "SUM(?modelled)",
    "irt:Total_Standby_Energy": "SUM(?standby)",
    "irt:Total_Idle_Energy": "SUM(?idle * ?standby)",
    "irt:Total_Returned_Energy": "SUM(?returned)",
    "irt:Least_Payload": "MIN(?payload)",
    "irt:Greatest_Payload": "MAX(?payload)",
}


@pytest.mark.parametrize("total", RAW)
def test_a_total_is_what_the_runs_come_to(graph: KnowledgeGraph, total: str) -> None:
    added_up = graph.query(
        f"""SELECT ?arm ({RAW[total]} AS ?value) {{
          ?run irt:run_of ?arm ; irt:Run_Time ?time ; irt:Payload ?payload .
          FILTER NOT EXISTS {{ ?run a irt:Planned_Run }}
          OPTIONAL {{ ?run irt:Idle_Share ?idle }}
          OPTIONAL {{ ?run irt:Energy_Consumption ?energy ; irt:Modelled_Energy ?modelled ;
                       irt:Standby_Energy ?standby ; irt:Returned_Energy ?returned }}
          {"FILTER(BOUND(?idle))" if total == "irt:Total_Idle_Time" else ""}
          {"FILTER(BOUND(?energy))" if "Total" in total and "Time" not in total else ""}
        }} GROUP BY ?arm"""
    )
    kept = graph.query(f"SELECT ?arm ?value {{ ?total a irt:Robot_Total ; irt:total_of ?arm ; {total} ?value }}")
    values = {row["arm"]: row["value"] for row in kept}
    assert values == pytest.approx({row["arm"]: row["value"] for row in added_up if row["arm"] in values})
    assert len(values) >= 3


def test_a_robots_energies_are_sums_over_the_same_runs(tmp_path: Path) -> None:
    """Shares of the total energy would be of other runs, were a run in one sum that only mechanics is known of."""
    mechanical = "Arm_A.check_1"
    with Workspace(tmp_path) as workspace:
        small_fleet.fill(workspace)
        with Session(workspace.engine) as session, session.begin():
            one = session.get_one(schema.RunEnergy, mechanical)
            one.energy_from = "mechanical"
            of_robot = schema.RunEnergy.run_id.like("Arm_A.%")
            rows = list(
                session.scalars(select(schema.RunEnergy).where(of_robot, schema.RunEnergy.run_id != mechanical))
            )
            sums = {
                "Total_Energy": sum(row.energy_consumption_j for row in rows),
                "Total_Standby_Energy": sum(row.standby_energy_j for row in rows),
                "Total_Returned_Energy": sum(row.returned_energy_j for row in rows),
                "Total_Modelled_Energy": sum(row.modelled_energy_j for row in [*rows, one]),
            }
        graph = map_into(KnowledgeGraph(), workspace, [folder("mappings") / "totals.r2rml.ttl"])
    for name, value in sums.items():
        asked = f"SELECT ?value {{ <https://w3id.org/irtwin/id/robot_total/Arm_A> irt:{name} ?value }}"
        assert graph.query(asked).rows[0]["value"] == pytest.approx(value)


def per_robot(rows: Iterable[Row], column: str) -> dict[str, float]:
    found: dict[str, float] = {}
    for row in rows:
        found[row["robot"]] = found.get(row["robot"], 0.0) + row[column]
    return found


def joules(rows: Iterable[Row]) -> dict[str, float]:
    """Return the energies that a question answers, added up for each robot, J."""
    units = {"energy_kWh": 3.6e6, "energy_Wh": 3600.0}
    return per_robot(
        [{**row, "value": row[name] * unit} for row in rows for name, unit in units.items() if name in row], "value"
    )


def of_runs(graph: KnowledgeGraph, property: str) -> dict[str, float]:
    """Return what a property comes to over each robot's runs."""
    name = "?run irt:run_of / irt:has_Information / irt:IR_Name ?robot"
    return per_robot(graph.query(f"SELECT ?robot ?value {{ ?run irt:{property} ?value . {name} }}"), "value")


@pytest.mark.parametrize("question", ["energy_per_day", "energy_per_month", "energy_per_robot", "energy_per_run"])
def test_parts_add_up_to_the_energy_of_all_runs(graph: KnowledgeGraph, question: str) -> None:
    whole = of_runs(graph, "Energy_Consumption")
    assert joules(ask(graph, question)) == pytest.approx(whole)
    (fleet,) = ask(graph, "fleet_totals")
    assert 3.6e6 * fleet["energy_kWh"] == pytest.approx(sum(whole.values()))


def test_effects_and_joints_add_up_to_the_modelled_energy(graph: KnowledgeGraph) -> None:
    whole = of_runs(graph, "Modelled_Energy")
    assert joules(ask(graph, "energy_per_effect")) == pytest.approx(whole)
    of_joints = [row for row in ask(graph, "energy_per_joint_and_effect") if row["joint"] is not None]
    assert joules(ask(graph, "energy_per_joint")) == pytest.approx(joules(of_joints))


@pytest.mark.slow
def test_a_ledger_that_is_not_whole_is_told(graph: KnowledgeGraph) -> None:
    assert [str(one) for one in validate(graph)] == []
    lost = {
        one for one in graph.quads() if "/ledger_total/Arm_A/" in str(one.subject) and "standby" in str(one.subject)
    }
    assert lost
    graph.change(lost, ())
    try:
        told = [str(one) for one in validate(graph)]
    finally:
        graph.change((), lost)
    assert told == [
        "id:robot/Arm_A: id:robot_total/Arm_A: the entries of a robot's ledger add up to its modelled energy"
    ]

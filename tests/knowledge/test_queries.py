import csv
import io
import json
from datetime import UTC, datetime

import pytest

from irtwin.errors import InputError
from irtwin.knowledge import shacl_rules
from irtwin.knowledge.graph import KnowledgeGraph
from irtwin.knowledge.queries import ask, named_questions, to_csv, to_json
from irtwin.knowledge.table import Table

TWIN_A = "https://w3id.org/irtwin/id/twin/Arm_A.t1"

EXPECTED = {  # columns that are looked at, and their rows
    "dominant_joint": (
        "robot run joint energy_J",
        [
            ("Arm_A", "check_1", "j2", 560.0),
            ("Arm_A", "fit_1", "j1", 300.0),
            ("Arm_A", "idle_1", "j1", 40.0),
            ("Arm_B", "work_1", "j1", 200.0),
            ("Arm_B", "work_2", "j2", 316.0),
        ],
    ),
    "energy_per_day": (
        "robot day runs energy_J",
        [
            ("Arm_A", "2026-03-02", 2, 3000.0),
            ("Arm_A", "2026-03-03", 1, 1600.0),
            ("Arm_B", "2026-03-02", 1, 500.0),
            ("Arm_B", "2026-03-04", 1, 800.0),
        ],
    ),
    "energy_per_effect": (
        "robot effect energy_J",
        [
            ("Arm_A", "standby power", 3000.0),
            ("Arm_A", "rigid-body dynamics", 1050.0),
            ("Arm_A", "Coulomb friction", 258.0),
            ("Arm_B", "rigid-body dynamics", 916.0),
            ("Arm_B", "standby power", 260.0),
        ],
    ),
    "energy_per_joint": (
        "robot joint energy_J share",
        [
            ("Arm_A", "j1", 540.0, 540 / 1308),
            ("Arm_A", "j2", 768.0, 768 / 1308),
            ("Arm_B", "j1", 500.0, 500 / 916),
            ("Arm_B", "j2", 416.0, 416 / 916),
        ],
    ),
    "energy_per_robot": (
        "robot runs time_s energy_J mean_power_W",
        [("Arm_A", 3, 60.0, 4600.0, 4600 / 60), ("Arm_B", 2, 13.0, 1300.0, 100.0)],
    ),
    "energy_per_run": (
        "robot run time_s payload_kg energy_J mean_power_W peak_power_W",
        [
            ("Arm_A", "check_1", 20.0, 3.0, 2000.0, 100.0, 300.0),
            ("Arm_A", "fit_1", 10.0, 0.0, 1000.0, 100.0, 250.0),
            ("Arm_A", "idle_1", 30.0, 0.0, 1600.0, 1600 / 30, 120.0),
            ("Arm_B", "work_1", 5.0, 0.0, 500.0, 100.0, 200.0),
            ("Arm_B", "work_2", 8.0, 1.0, 800.0, 100.0, 260.0),
        ],
    ),
    "idle_runs": ("robot run idle_share time_s standby_J", [("Arm_A", "idle_1", 0.8, 30.0, 1500.0)]),
    "measured_against_modelled": (
        "robot run part measured_J modelled_J error_percent",
        [
            ("Arm_A", "fit_1", "fit", 1000.0, 980.0, 2.0),
            ("Arm_A", "check_1", "held_out", 2000.0, 1760.0, 12.0),
            ("Arm_A", "idle_1", "held_out", 1600.0, 1568.0, 2.0),
            ("Arm_B", "work_1", "fit", 500.0, 400.0, 20.0),
            ("Arm_B", "work_2", "held_out", 800.0, 776.0, 3.0),
        ],
    ),
    "base_parameters": (
        "robot combination value unit lower upper",
        [("Arm_A", "Ia j1 + Izz l1", 1.5, "kg m^2", 1.0, 2.0)],
    ),
    "parameters": (
        "robot effect joint parameter value unit lower upper",
        [
            ("Arm_A", "Coulomb friction", "j1", "Fc", 4.0, "N m", 3.9, 4.1),
            ("Arm_A", "Coulomb friction", "j2", "Fc", 2.5, "N m", 2.3, 2.7),
            ("Arm_A", "standby power", None, "P0", 50.0, "W", 49.0, 51.0),
            ("Arm_B", "standby power", None, "P0", 20.0, "W", 18.0, 22.0),
        ],
    ),
    "providers": (
        "provider applies_to",
        [("energy", "IR_RunProcess"), ("identification", "Industrial_Robot"), ("run state", "IR_RunProcess")],
    ),
    "regenerating_runs": (
        "robot run returned_J energy_J returned_share",
        [("Arm_B", "work_2", 200.0, 800.0, 0.25)],
    ),
    "robots": (
        "robot manufacturer type axes weight_kg runs twins",
        [("Arm_A", "Acme", "articulated", 2, 30.0, 3, 1), ("Arm_B", "Bolt", "articulated", 2, 20.0, 2, 1)],
    ),
    "series": (
        "robot run kind rows file",
        [
            ("Arm_A", "check_1", "measured", 2000, "series/aacheck_1.parquet"),
            ("Arm_A", "fit_1", "measured", 1000, "series/aafit_1.parquet"),
            ("Arm_A", "idle_1", "measured", 3000, "series/aaidle_1.parquet"),
            ("Arm_B", "work_1", "measured", 500, "series/aawork_1.parquet"),
            ("Arm_B", "work_2", "measured", 800, "series/aawork_2.parquet"),
        ],
    ),
    "standby_share": (
        "run standby_J standby_share",
        [
            ("idle_1", 1500.0, 0.956633),
            ("check_1", 1000.0, 0.568182),
            ("fit_1", 500.0, 0.510204),
            ("work_1", 100.0, 0.25),
            ("work_2", 160.0, 0.206186),
        ],
    ),
    "to_reidentify": (
        "robot twin run error_percent limit_percent",
        [("Arm_A", TWIN_A, "check_1", 12.0, 10.0)],
    ),
    "torque_fit": (
        "robot joint part runs rmse_Nm worst_r_squared",
        [
            ("Arm_A", "j1", "fit", 1, 0.5, 0.99),
            ("Arm_A", "j1", "held_out", 1, 0.9, 0.95),
            ("Arm_A", "j2", "fit", 1, 0.4, 0.98),
            ("Arm_A", "j2", "held_out", 1, 1.2, 0.9),
            ("Arm_B", "j1", "held_out", 1, 0.3, 0.97),
        ],
    ),
    "twin": (
        "robot effect channel equation parameters",
        [
            ("Arm_A", "standby power", "power", "P0", 1),
            ("Arm_A", "Coulomb friction", "torque", "Fc s", 2),
            ("Arm_A", "rigid-body dynamics", "torque", "M(q) ddq + C(q, dq) dq + G(q)", 0),
            ("Arm_B", "standby power", "power", "P0", 1),
            ("Arm_B", "rigid-body dynamics", "torque", "M(q) ddq + C(q, dq) dq + G(q)", 0),
        ],
    ),
    # of diagnoses this graph has none: tests/knowledge/test_gap_questions.py
    "gap_shrinkage": ("robot", []),
    "not_testable": ("robot", []),
    "what_to_do": ("robot", []),
    "where_is_the_gap": ("robot", []),
    "why_more_energy": ("robot", []),
    "worst_run": (
        "robot run error_percent part",
        [("Arm_A", "check_1", 12.0, "held_out"), ("Arm_B", "work_1", 20.0, "fit")],
    ),
}


@pytest.mark.parametrize("name", EXPECTED)
def test_named_question_has_its_answer(graph: KnowledgeGraph, name: str) -> None:
    shacl_rules.infer(graph)
    columns, rows = EXPECTED[name]
    found = [tuple(row[column] for column in columns.split()) for row in ask(graph, name)]
    assert [[pytest.approx(value) if isinstance(value, float) else value for value in row] for row in rows] == [
        list(row) for row in found
    ]


def test_provenance_names_provider_and_what_it_made(graph: KnowledgeGraph) -> None:
    table = ask(graph, "provenance")
    made = {(row["made"], row["count"]) for row in table if row["activity"].endswith("identification.Arm_A")}
    assert made == {("energy twin", 1), ("twin parameter", 3), ("base parameter", 1), ("torque fit", 4)}
    assert {row["provider"] for row in table} == {"run state", "identification", "energy"}
    assert {row["software"] for row in table} == {"irtwin 0.1.0"}


def test_every_question_is_tested_and_says_what_it_answers() -> None:
    assert set(named_questions()) == {*EXPECTED, "provenance"}
    for question in named_questions().values():
        assert question.title
        assert "?" in question.question


def test_sparql_is_asked_as_it_is(graph: KnowledgeGraph) -> None:
    assert ask(graph, "ASK { ?robot irt:has_Twin ?twin }")[0] == {"answer": True}


def test_unknown_name_is_met_with_the_nearest(graph: KnowledgeGraph) -> None:
    with pytest.raises(InputError, match=r"'energy_per_runs'.*did you mean energy_per_run\?"):
        ask(graph, "energy_per_runs")
    with pytest.raises(InputError, match="known are base_parameters, dominant_joint, "):
        ask(graph, "xyzzy")


TABLE = Table(
    ("name", "value", "time", "nothing"),
    (
        {"name": 'a "b",c', "value": 1.5, "time": datetime(2026, 3, 2, tzinfo=UTC), "nothing": None},
        {"name": "ü", "value": float("nan"), "time": None, "nothing": None},
    ),
)


def test_json_has_null_for_what_is_not_there() -> None:
    assert json.loads(to_json(TABLE)) == [
        {"name": 'a "b",c', "value": 1.5, "time": "2026-03-02T00:00:00+00:00", "nothing": None},
        {"name": "ü", "value": None, "time": None, "nothing": None},
    ]


def test_csv_reads_back() -> None:
    rows = list(csv.reader(io.StringIO(to_csv(TABLE))))
    assert rows[0] == ["name", "value", "time", "nothing"]
    assert rows[1] == ['a "b",c', "1.5", "2026-03-02T00:00:00+00:00", ""]

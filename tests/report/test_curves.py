"""Which curves pages draw of runs."""

from __future__ import annotations

from typing import Any

from irtwin.report.plant.curves import Drawn, curves

JOINTS = [{"joint_name": "a", "kind": "revolute"}, {"joint_name": "b", "kind": "prismatic"}]


def run(name: str, **columns: str) -> Drawn:
    return Drawn(f"id:{name}", name, [{"kind": kind, "columns": of} for kind, of in columns.items()], [(2.0, "why")])


def names(found: dict[str, Any]) -> dict[tuple[str, str], list[str]]:
    return {(panel["title"], panel["unit"]): [line["name"] for line in panel["lines"]] for panel in found["panels"]}


def test_a_panel_for_each_quantity_and_unit_what_was_measured_beside_the_twin() -> None:
    modelled = "time,held_out,standing,q_a,dq_a,dq_b,tau_a_model,tau_b_model,power_model,energy"
    found = curves([run("one", measured="time,q_a,q_b,cmd_a,tau_a,power,odd", modelled=modelled)], JOINTS)
    assert names(found) == {
        ("electrical power", "W"): ["measured", "by the twin"],
        ("torque", "N m"): ["a", "a, by the twin"],
        ("torque", "N"): ["b, by the twin"],
        ("position", "°"): ["a", "a"],
        ("position", "mm"): ["b"],
        ("speed", "°/s"): ["a"],
        ("speed", "mm/s"): ["b"],
    }
    assert found["spans"] == [{"run": 0, "channel": "standing"}, {"run": 0, "channel": "held_out"}]
    assert found["runs"] == [{"iri": "id:one", "name": "one", "marks": [(2.0, "why")]}]
    (commanded,) = (line for panel in found["panels"] for line in panel["lines"] if line["channel"] == "cmd_a")
    assert (commanded["kind"], commanded["modelled"]) == ("measured", True)


def test_two_runs_are_drawn_over_each_other_without_their_twins() -> None:
    first = run("one", measured="time,q_a,power", modelled="standing,power_model")
    found = curves([first, run("two", measured="time,q_a,power")], JOINTS)
    assert names(found) == {("electrical power", "W"): ["one", "two"], ("position", "°"): ["a", "a"]}
    assert found["spans"] == []


def test_a_run_without_samples_draws_nothing() -> None:
    assert curves([run("one")], JOINTS) is None
    assert curves([Drawn("id:x", "x", [{"kind": "measured", "columns": None}])], []) is None

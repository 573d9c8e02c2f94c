"""Before and after: what is held against what, and what is not."""

from __future__ import annotations

import pytest

from irtwin.errors import InputError
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.knowledge.vocabulary import ID
from irtwin.report.plant import page
from irtwin.report.plant.comparison import Comparison, Side, comparison, side, to_sheet
from irtwin.report.questions import Answer


def compared(plant: KnowledgeGraph, *sides: tuple[str, Side | None]) -> Comparison:
    """Hold one side, of a robot's name, against another."""
    asked = {name: one for name, one in page.questions("comparison").items() if "first" in one.bind}
    found = []
    for robot, one in sides:
        bindings = {"robot": f"{ID}robot/{robot}", **one.bindings()}
        found.append({name: Answer(of, tuple(plant.query(of.text, bindings))) for name, of in asked.items()})
    return comparison(*found)


def test_two_times(plant: KnowledgeGraph) -> None:
    asked = {"a_to": "2026-03-02", "b_from": "2026-03-03", "b_to": "2026-03-03"}
    found = compared(plant, ("Arm_A", side(asked, "a")), ("Arm_A", side(asked, "b")))
    pairs = {one.name: (one.before, one.after, one.percent) for one in (*found.pairs, *found.kinds[0][1])}
    assert pairs["runs"] == (2, 1, -50.0)
    assert pairs["energy"] == (3000.0, 1600.0, pytest.approx(-46.6667))
    assert pairs["mean power"] == (100.0, pytest.approx(53.3333), pytest.approx(-46.6667))
    assert pairs["peak power"] == (300.0, 120.0, -60.0)
    assert pairs["standby, of what the twin models"][:2] == (pytest.approx(100 * 1500 / 2740), pytest.approx(95.66327))
    assert [(one.name, one.before, one.after) for one in found.joints] == [
        ("j1", pytest.approx(500 / 30), pytest.approx(40 / 30)), ("j2", pytest.approx(740 / 30), pytest.approx(28 / 30))
    ]  # fmt: skip
    assert not found.apart
    assert len(to_sheet(found).rows) == len(found.pairs) + len(found.kinds[0][1]) + 2


def test_two_runs(plant: KnowledgeGraph) -> None:
    asked = {"by": "run", "a_run": "Arm_C.press_1", "b_run": "Arm_C.press_2"}
    found = compared(plant, ("Arm_C", side(asked, "a")), ("Arm_C", side(asked, "b")))
    ((of, pairs),) = found.kinds
    assert (of.name, pairs[1].before, pairs[1].after) == ("mechanical", 400.0, 440.0)
    assert not any("standby" in one.name for one in pairs)


def test_measured_and_mechanical_energy_are_not_held_against_each_other(plant: KnowledgeGraph) -> None:
    runs = ("Arm_A.fit_1", "Arm_C.press_1")
    found = compared(plant, *((name[:5], Side(f"{ID}run/{name}", "0001-01-01", "9999-12-31")) for name in runs))
    assert found.apart
    assert all(pair.difference is None for _, pairs in found.kinds for pair in pairs)


def test_a_side_that_is_not_said() -> None:
    assert side({}, "a") is None and side({"by": "run"}, "a") is None


@pytest.mark.parametrize("text", ["yesterday", "2026-13-01", '2026-03-02" }'])
def test_what_is_no_day(text: str) -> None:
    with pytest.raises(InputError, match="is not a day: write it as 2026-03-02"):
        side({"a_from": text}, "a")


def test_a_time_without_runs(plant: KnowledgeGraph) -> None:
    asked = {"a_to": "2020-01-01", "b_from": "2026-03-03"}
    found = compared(plant, ("Arm_A", side(asked, "a")), ("Arm_A", side(asked, "b")))
    assert all(pair.difference is None for _, pairs in found.kinds for pair in pairs)
    assert found.pairs[0].before == 0

"""What of a plant is looked at: days, a text, groups and an order; and what robots would save in a year."""

from __future__ import annotations

from dataclasses import replace

import pytest

from irtwin.errors import InputError
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.report.plant import overview, page
from irtwin.report.plant.choice import ALL, Choice, choice
from irtwin.report.plant.tariff import Tariff
from irtwin.report.questions import Answers, ask

YEAR = Tariff(price=0.2, currency="EUR", hours=1000.0)


@pytest.fixture(scope="module")
def answers(plant: KnowledgeGraph) -> Answers:
    return ask(plant, page.questions(), {})


def test_a_form_is_read() -> None:
    said = {"from": "2026-03-02", "to": "", "find": " Arm ", "group": "cell", "sort": "saving", "page": "2"}
    assert choice(said) == Choice("2026-03-02", "", "Arm", "cell", "saving")
    assert choice(said).query == "from=2026-03-02&find=Arm&group=cell&sort=saving"
    assert choice({"group": "moon", "sort": "?"}) == ALL and ALL.query == ""
    with pytest.raises(InputError, match="'yesterday' is not a day: write it as 2026-03-02"):
        choice({"to": "yesterday"})


def test_days_narrow_energies(plant: KnowledgeGraph) -> None:
    asked = Choice(first="2026-03-03", last="2026-03-04")
    found = overview.overview(ask(plant, asked.of_days(page.questions()), {}), YEAR, asked)
    energies = {line.name: line.energy_j for group in found.groups for line in group.lines if group.kind}
    assert energies == {"Arm_A": 1600.0, "Arm_B": 800.0, "Arm_C": 400.0}
    assert found.robots == 4


def test_robots_are_found_grouped_and_sorted(answers: Answers) -> None:
    rows = [{**row, "cell": "7" if row["name"] == "Arm_B" else None} for row in answers["robots"].rows]
    said = {**answers, "robots": replace(answers["robots"], rows=tuple(rows))}

    def names(asked: Choice) -> list[str]:
        return [line.name for line in overview.overview(said, YEAR, asked).groups[0].lines]

    assert names(Choice(find="arm_b")) == names(Choice(find="7")) == ["Arm_B"]
    assert names(Choice(group="cell")) == ["Arm_B", "Arm_A"]
    assert names(Choice(sort="alarms")) == ["Arm_B", "Arm_A"]
    parts = overview.overview(said, YEAR, Choice(group="cell")).groups[0].parts
    assert [(name, part.total("energy_j")) for name, part in parts] == [("7", 1300.0), ("not said", 4600.0)]
    assert overview.overview(said, YEAR).groups[0].parts == ()


def test_what_saves_most_comes_first(answers: Answers) -> None:
    robots = {row["name"]: row["robot"] for row in answers["robots"].rows}
    half = {"standby_w": 100.0, "lower_w": None, "upper_w": None, "time_s": 10.0, "waiting_s": 5.0}
    tenth = half | {"lower_w": 90.0, "upper_w": 110.0, "waiting_s": 1.0}
    waiting = [{"robot": robots["Arm_A"], **tenth}, {"robot": robots["Arm_B"], **half}]
    said = {**answers, "waiting": replace(answers["waiting"], rows=tuple(waiting))}
    (first, second) = overview.overview(said, YEAR).groups[0].lines
    assert (first.name, second.name) == ("Arm_B", "Arm_A")
    assert first.saving == overview.Saving(50.0 * 3.6e6, None, None)  # 100 W, half of 1000 h
    assert second.saving is not None
    assert (second.saving.lower_j, second.saving.upper_j) == (pytest.approx(9 * 3.6e6), pytest.approx(11 * 3.6e6))
    found = overview.overview(said, YEAR)
    assert found.saving_j == pytest.approx(60 * 3.6e6)
    html = page.render(
        "page.html.jinja", said, {}, found=found, tariff=YEAR, trouble="", file="", excel=True, reports=[]
    )
    assert "could save a year, EUR" in html and "1.80 to 2.20" in html
    assert "saving_a_year_kWh" in overview.sheet(found, YEAR).columns
    assert overview.overview(said, Tariff()).groups[0].lines[0].saving is None

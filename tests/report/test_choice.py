"""What of a plant is looked at: days, a text, groups and an order; and what robots would save in a year."""

from __future__ import annotations

import pytest
from tests.report.robots import instead

from irtwin.errors import InputError
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.report.plant import overview, page
from irtwin.report.plant.choice import ALL, Selection, choice
from irtwin.report.questions import Answers, ask


@pytest.fixture(scope="module")
def answers(plant: KnowledgeGraph) -> Answers:
    return ask(plant, page.questions(), {})


def test_a_form_is_read() -> None:
    said = {"from": "2026-03-02", "to": "", "find": " Arm ", "group": "cell", "sort": "saving", "page": "2"}
    assert choice(said) == Selection("2026-03-02", "", "Arm", "cell", "saving")
    assert choice(said).query == "from=2026-03-02&find=Arm&group=cell&sort=saving"
    assert choice({"group": "moon", "sort": "?"}) == ALL and ALL.query == ""
    with pytest.raises(InputError, match="'yesterday' is not a day: write it as 2026-03-02"):
        choice({"to": "yesterday"})


def test_days_narrow_energies(plant: KnowledgeGraph) -> None:
    asked = Selection(first="2026-03-03", last="2026-03-04")
    found = overview.overview(ask(plant, asked.of_days(page.questions()), {}), asked)
    energies = {line["name"]: line["energy_j"] for group in found.groups for line in group.lines if group.kind}
    assert energies == {"Arm_A": 1600.0, "Arm_B": 800.0, "Arm_C": 400.0}
    assert found.robots == 4


def test_robots_are_found_grouped_and_sorted(answers: Answers) -> None:
    rows = [{**row, "cell": "7" if row["name"] == "Arm_B" else None} for row in answers["robots"].rows]
    said = instead(answers, robots=rows)

    def names(asked: Selection) -> list[str]:
        return [line["name"] for line in overview.overview(said, asked).groups[0].lines]

    assert names(Selection(find="arm_b")) == names(Selection(find="7")) == ["Arm_B"]
    assert names(Selection(group="cell")) == ["Arm_B", "Arm_A"]
    assert names(Selection(sort="alarms")) == ["Arm_B", "Arm_A"]
    parts = overview.overview(said, Selection(group="cell")).groups[0].parts
    assert [(name, part.total("energy_j")) for name, part in parts] == [("7", 1300.0), ("not said", 4600.0)]
    assert overview.overview(said).groups[0].parts == ()


def test_what_saves_most_comes_first(answers: Answers) -> None:
    robots = {row["name"]: row["robot"] for row in answers["robots"].rows}
    kwh = 3.6e6
    ten = {"robot": robots["Arm_A"], "energy_j": 10 * kwh, "lower_j": 9 * kwh, "upper_j": 11 * kwh}
    fifty = {"robot": robots["Arm_B"], "energy_j": 50 * kwh, "lower_j": None, "upper_j": None}
    said = instead(answers, waiting=(ten, fifty))
    found = overview.overview(said)
    assert [line["name"] for line in found.groups[0].lines] == ["Arm_B", "Arm_A"]
    assert found.electrical.total("saving_j") == pytest.approx(60 * kwh)
    html = page.render("page.html.jinja", said, {}, found=found, trouble="", file="", excel=True, reports=[])
    assert "could save a year, EUR" in html and "1.80 to 2.20" in html
    assert "saving_a_year_kWh" in overview.sheet(found).columns

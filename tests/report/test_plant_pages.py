"""The pages of a plant: what they say of four robots, of none and of a hundred, worked out by hand."""

from __future__ import annotations

import re
from collections.abc import Mapping
from datetime import datetime
from zoneinfo import ZoneInfo

import pytest
from tests import plants
from tests.report.robots import instead

from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.knowledge.vocabulary import ID, IRT
from irtwin.report.plant import individual, overview, page, robot
from irtwin.report.plant.energies import KINDS, days, kind
from irtwin.report.questions import Answer, Answers, ask

UTC = ZoneInfo("UTC")
FRIDAY = datetime(2026, 3, 6, 22, tzinfo=UTC)


@pytest.fixture(scope="module")
def answers(plant: KnowledgeGraph) -> Answers:
    return ask(plant, page.questions(), {})


def drawn(answers: Answers) -> str:
    found = overview.overview(answers)
    return page.render("page.html.jinja", answers, {}, found=found, trouble="", file="", excel=True, reports=[])


def text(html: str) -> str:
    return " ".join(re.sub(r"<details.*?</details>|<[^>]*>", " ", html, flags=re.DOTALL).split())


def test_mechanical_energy_stands_apart_and_has_no_price(answers: Answers) -> None:
    found = overview.overview(answers)
    groups = {group.kind.name if group.kind else None: [line["name"] for line in group.lines] for group in found.groups}
    assert groups == {"measured": ["Arm_A", "Arm_B"], "mechanical": ["Arm_C"], None: [plants.HOSTILE]}
    (mechanical,) = (group.lines[0] for group in found.groups if group.kind is KINDS["mechanical"])
    assert mechanical["energy_j"] == 840.0
    assert {mechanical[name] for name in ("cost", "co2_kg", "standby")} == {None}
    assert found.electrical.total("energy_j") == 5900.0
    assert found.electrical.total("cost") == pytest.approx(5900 / 3.6e6 * 0.2)
    assert found.electrical.total("co2_kg") == pytest.approx(5900 / 3.6e6 * 0.4)
    assert [(of.name, [bar.energy_j for bar in trend]) for of, trend in found.trends] == [
        ("measured", [3500.0, 1600.0, 800.0]), ("mechanical", [400.0, 440.0])
    ]  # fmt: skip


def test_shares_of_time_and_of_energy(answers: Answers) -> None:
    line = overview.overview(answers).groups[0].lines[0]
    assert line["standing"] == pytest.approx((0.1 * 10 + 0.2 * 20 + 0.8 * 30) / 60)
    assert line["standby"] == pytest.approx((500 + 1000 + 1500) / (980 + 1760 + 1568))
    assert (line["state"]["words"], line["state"]["live"]) == ("standing still", None)
    assert (line["alarms"], line["reidentify"]) == (0, True)
    assert (line["gap"]["verdict"], line["gap"]["closed"]) == ("attributed", 0.8)


def test_a_robot_that_is_watched(answers: Answers) -> None:
    line = overview.overview(answers).groups[0].lines[1]
    assert (line["name"], line["state"]["words"], line["state"]["live"], line["alarms"]) == (
        "Arm_B", "no news: no state came for 2.0 s", "stale", 1
    )  # fmt: skip
    assert "/live/Arm_B" in drawn(answers)


def test_energies_of_two_kinds_of_one_robot_are_two_lines(answers: Answers) -> None:
    rows = answers["energy"].rows
    other = {**next(row for row in rows if row["robot"].endswith("Arm_A")), "energy_from": "modelled", "energy_j": 9e9}
    found = overview.overview(instead(answers, energy=(*rows, other)))
    lines = [(group.kind.name, line["energy_j"]) for group in found.groups if group.kind for line in group.lines
             if line["name"] == "Arm_A"]  # fmt: skip
    assert lines == [("measured", 4600.0), ("modelled", 9e9)]


def test_what_nobody_said_is_not_shown(answers: Answers) -> None:
    nothing = dict.fromkeys(answers["tariff"].rows[0])
    unsaid = instead(answers, tariff=(nothing,), waiting=())
    priced, without = drawn(answers), drawn(unsaid)
    assert "cost, EUR" in priced and "CO₂, kg" in priced and "could save a year, EUR" in priced
    assert "Plant Werk 1" in text(priced) and "Werk 1" not in without
    assert "cost, " not in without and "CO₂, kg" not in without and "Cost and CO₂ are not shown" in without
    assert overview.sheet(overview.overview(unsaid)).columns == tuple(
        name for name in overview.sheet(overview.overview(answers)).columns
        if name not in ("cost_EUR", "CO2_kg") and not name.startswith("saving")
    )  # fmt: skip


def test_a_plant_without_robots() -> None:
    graph = KnowledgeGraph()
    graph.load_ontology()
    answers = ask(graph, page.questions(), {})
    assert "No robots The graph knows no robot yet." in text(drawn(answers))
    assert not overview.sheet(overview.overview(answers)).rows


def test_alarms_are_not_counted_as_none_beside_a_contradiction(answers: Answers) -> None:
    said = text(drawn(instead(answers, contradictions=[{"contradiction": "two payloads of one run"}])))
    assert "of what is not contradicted, see above" in said
    assert "of what is not contradicted" not in text(drawn(answers))


def test_a_piece_and_a_cycle(answers: Answers) -> None:
    said = text(drawn(answers))
    assert "bracket Arm_A electrical, measured 40 0.0208 Wh 15 0.0370 Wh" in said
    assert "not named Arm_C mechanical, by the twin – – 4 0.0278 Wh" in said
    rows = {row[0]: row[2:] for row in overview.made_sheet(answers).rows}
    assert rows["Arm_A"] == ("bracket", "measured", 40, 75.0, 15, pytest.approx(2000 / 15))
    assert rows["Arm_C"] == (None, "mechanical", None, None, 4, 100.0)


def test_more_than_a_hundred_robots(answers: Answers) -> None:
    answers = plants.many(answers, 30)
    found = overview.overview(answers)
    assert found.robots == sum(len(group.lines) for group in found.groups) == 120
    assert found.electrical.total("energy_j") == 30 * 5900.0
    html = drawn(answers)
    assert html.count('class="state"') == 50 + 30 + 30  # the 60 that are measured take two pages
    assert "Page 1 of 2; 60 robots." in html and '<a href="?page=2#measured">Next</a>' in html
    assert len(overview.sheet(found).rows) == 120


def test_a_hundred_robots_at_a_glance(answers: Answers) -> None:
    few, many = overview.overview(answers), overview.overview(plants.many(answers, 30))
    assert few.glance == () and "glance" not in drawn(answers)
    names = [line["name"] for line in many.glance]
    assert len(names) == 120 and names[:2] == ["Arm_0_A", "Arm_10_A"] and names[60:61] == ["Arm_0_C"]
    html = drawn(plants.many(answers, 30))
    _, *parts = html.split('id="glance"')[1].split("</section>")[0].split("<table>")
    assert [part.count('<th scope="row">') for part in parts] == [34, 34, 34]
    assert [re.findall('colspan="6">(.*?)</th>', part) for part in parts] == [
        ["Electrical energy, measured"], ["Electrical energy, measured", "Mechanical energy by the twin"],
        ["Mechanical energy by the twin", "No energy yet"],
    ]  # fmt: skip
    assert "Arm_0_A: 3 runs; cost 0.000256 EUR; CO₂ 0.000511 kg; stands still 48" in html
    assert 'href="?page=2#glance"' in html


@pytest.mark.parametrize("name", ["Arm_A", "Arm_C", "Arm_D"])
def test_a_robots_page(plant: KnowledgeGraph, name: str) -> None:
    bindings = {"robot": f"{ID}robot/{name}"}
    html = of_robot(plant, bindings)
    assert "<script" not in html
    said = text(html)
    assert {
        "Arm_A": "Electrical energy, measured, at mains From logged power. Runs 3 Time 60.0 s Energy 1.28 Wh",
        "Arm_C": "Runs 2 Time 20.0 s Energy 0.233 Wh Mean power 42.0 W 2026-03-04: 0.111 Wh",
        "Arm_D": "No energy yet: neither was power logged, nor has the robot a twin.",
    }[name] in said
    assert ("Cost" in said) is (name == "Arm_A")


def of_robot(graph: KnowledgeGraph, bindings: Mapping[str, str]) -> str:
    answers = ask(graph, robot.questions(), bindings)
    said = {"zone": UTC, "trouble": "", "excel": False, "report": None, "gap_report": None}
    return page.render("robot/page.html.jinja", answers, bindings, **robot.of_robot(answers, UTC), **said)


def test_a_robots_runs_as_a_table(plant: KnowledgeGraph) -> None:
    sheet = robot.runs_sheet(ask(plant, robot.questions(), {"robot": f"{ID}robot/Arm_A"}))
    assert "energy_J" in sheet.columns and "mean_power_W" in sheet.columns
    assert [row[0] for row in sheet.rows] == ["idle_1", "check_1", "fit_1", "pick"]


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("Arm_A.fit_1", "Energy 0.278 Wh Cost"),
        ("Arm_A.fit_1", "Drives on at rest, the log says 55.0 W and the twin 50.0 W: they differ by more than"),
        ("Arm_C.press_1", "which is mechanical energy alone"),
        ("Arm_B.live_1", "power is up to 80 W from the twin"),
        ("Arm_A.pick", "It is planned and did not take place: the twin says that it will take 0.528 Wh"),
        ("Arm_D.first", "No energy: neither was power logged"),
    ],
)
def test_a_runs_page(plant: KnowledgeGraph, name: str, words: str) -> None:
    bindings = {"run": f"{ID}run/{name}"}
    answers = ask(plant, page.questions("run"), bindings)
    said = {"trouble": "", "excel": False, "report": "Arm.html"}
    html = page.render("run/page.html.jinja", answers, bindings, **robot.of_run(answers), **said)
    assert words in text(html) and "<script" not in html


def test_an_individual_says_units_and_who_says_so(plant: KnowledgeGraph) -> None:
    found = individual_of(plant, f"{ID}run/Arm_A.fit_1")
    said = {one.iri.removeprefix(IRT): one.values for one in found.said}
    assert [value.text for value in said["Energy_Consumption"]] == ["1000\N{NO-BREAK SPACE}J"]
    assert said["Energy_Consumption"][0].by == (
        ("activity energy.Arm_A.fit_1", f"{ID}activity/energy.Arm_A.fit_1"),
    )  # fmt: skip
    assert said["dominant_Joint"][0].by == (("concluded by shacl/dominant_joint", None),)
    assert [value.text for value in said["run_of"]] == ["Arm_A"]
    assert {one.label for one in found.incoming} >= {"share of run", "series of"}
    assert (found.name, found.whole) == ("fit_1", True)


def test_a_unit_that_another_property_gives(plant: KnowledgeGraph) -> None:
    found = individual_of(plant, f"{ID}gap_excursion/Arm_B.live_1/j2/1")
    (peak,) = (one.values[0].text for one in found.said if one.iri == f"{IRT}Peak_Residual")
    assert peak == "7.125\N{NO-BREAK SPACE}N m"


@pytest.mark.parametrize(("joint", "limits"), [("Arm_A/j1", {"3 rad", "4 rad/s"}), ("Arm_D/j1", {"3 m", "4 m/s"})])
def test_a_joint_that_slides_has_units_of_its_own(plant: KnowledgeGraph, joint: str, limits: set[str]) -> None:
    said = {value.text for one in individual_of(plant, f"{ID}joint/{joint}").said for value in one.values}
    assert limits <= {text.replace("\N{NO-BREAK SPACE}", " ") for text in said}


def individual_of(graph: KnowledgeGraph, iri: str) -> individual.ShownIndividual:
    return individual.individual(iri, ask(graph, page.questions("individual"), {"individual": iri}))


def test_of_many_values_some_are_shown(plant: KnowledgeGraph) -> None:
    answers = ask(plant, page.questions("individual"), {"individual": f"{ID}robot/Arm_A"})
    row = answers["said"].rows[0]
    many = Answer(answers["said"].question, tuple({**row, "value": f"v{number}"} for number in range(5000)))
    found = individual.individual(f"{ID}robot/Arm_A", {**answers, "said": many})
    assert not found.whole and len(found.said[0].values) == 5000
    html = page.render("individual/page.html.jinja", answers, {}, found=found, most=individual.MOST_VALUES)
    assert "and 4950 more" in html and html.count("v1") < 60


def test_a_kind_of_energy_that_nobody_knows_has_no_price() -> None:
    assert not kind("guessed").electrical


def test_one_day_is_no_trend_and_negative_energy_no_bar() -> None:
    assert days({"2026-03-02": 5.0}, 30) is None
    trend = days({"2026-03-02": -5.0, "2026-03-03": 10.0, "2026-03-01": 5.0}, 2)
    assert [(bar.day, bar.height) for bar in trend] == [("2026-03-02", 0.0), ("2026-03-03", 1.0)]
    assert {bar.height for bar in days({"2026-03-02": 0.0, "2026-03-03": 0.0}, 2)} == {0.0}


def test_what_data_do_not_part_is_one_entry_with_a_range_of_each_part(plant: KnowledgeGraph) -> None:
    answers = ask(plant, page.questions("run"), {"run": f"{ID}run/Arm_A.fit_1"})
    entries = robot.of_run(answers)["entries"]
    (friction,) = (entry for entry in entries if len(entry) > 1)
    assert [(row["effect_name"], row["lower_j"], row["upper_j"]) for row in friction] == [
        ("Coulomb friction", 25.0, 75.0),
        ("Coulomb friction", 15.0, 45.0),
    ]
    assert {(row["entry_j"], row["entry_lower_j"], row["entry_upper_j"]) for row in friction} == {(80.0, 77.0, 83.0)}
    sizes = [entry[0]["entry_j"] for entry in entries]
    assert sum(sizes) == sum(row["energy_j"] for row in answers["ledger"].rows)
    assert sizes == sorted(sizes, key=abs, reverse=True)


def test_what_is_next_to_nothing_is_counted_alone(plant: KnowledgeGraph) -> None:
    answers = ask(plant, page.questions("run"), {"run": f"{ID}run/Arm_A.fit_1"})
    rows = answers["ledger"].rows
    tiny = {**rows[0], "entry": "tiny", "entry_j": 1e-9}
    found = robot.of_run(instead(answers, ledger=(*rows, tiny)))
    assert [entry for entry in found["entries"] if entry not in found["told"]] == [[tiny]]


def test_each_line_is_on_one_page() -> None:
    lines = list(range(2 * page.PAGE + 1))
    assert page.pages(lines) == 3
    assert [line for number in (1, 2, 3) for line in page.on_page(lines, number)] == lines
    assert list(page.on_page(lines, 99)) == [2 * page.PAGE]
    assert page.pages([]) == 1
    assert not page.on_page([], 4)


@pytest.mark.parametrize(
    ("said", "number"), [(None, 1), ("", 1), ("7", 7), ("0", 1), ("-3", 1), ("x", 1), ("²", 1), ("9" * 40, 1)]
)
def test_an_address_says_its_page_or_nonsense(said: str | None, number: int) -> None:
    assert page.page_number(said) == number


def test_hours_are_those_of_the_plants_clock() -> None:
    rows = [{"first_hour": FRIDAY, "by_hour": "10,20,40"}]
    found = robot.load(rows, UTC)
    taken = {(cell["weekday"], cell["hour"]): cell["energy_j"] for row in found["week"] for cell in row}
    assert {at: energy for at, energy in taken.items() if energy} == {
        ("Friday", 22): 10.0, ("Friday", 23): 20.0, ("Saturday", 0): 40.0
    }  # fmt: skip
    assert [(shift["name"], shift["hours"], shift["energy_j"]) for shift in found["shifts"]] == [
        (robot.NIGHT, 2, 30.0),
        (robot.WEEKEND, 1, 40.0),
    ]
    assert found["greatest"] == {"weekday": "Saturday", "hour": 0, "energy_j": 40.0, "height": 1.0}
    tokyo = robot.load(rows, ZoneInfo("Asia/Tokyo"))
    assert [shift["name"] for shift in tokyo["shifts"]] == [robot.WEEKEND]


def test_the_same_hour_of_several_weeks_is_its_mean() -> None:
    mondays = [datetime(2026, 3, day, 6, tzinfo=UTC) for day in (2, 9)]
    rows = [{"first_hour": day, "by_hour": energy} for day, energy in zip(mondays, ("10", "30"), strict=True)]
    found = robot.load(rows, UTC)
    assert found["week"][0][6]["energy_j"] == 20.0
    assert [(shift["name"], shift["hours"], shift["energy_j"]) for shift in found["shifts"]] == [(robot.EARLY, 2, 40.0)]


def test_nothing_and_nothing_taken() -> None:
    assert robot.load([], UTC) is None
    found = robot.load([{"first_hour": FRIDAY, "by_hour": "0"}], UTC)
    assert found["greatest"]["height"] == 0.0

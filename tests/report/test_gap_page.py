"""The gap report of hand-written diagnoses: its words, and the page in a real browser without network."""

from __future__ import annotations

import math
import re
from pathlib import Path
from typing import Any

import pytest
from tests import gap_cases, rows
from tests.gap_pages import figures_of, graph_of, page_of, six_axis
from tests.html_elements import plain
from tests.screens import complaints_of

from irtwin.errors import InputError
from irtwin.providers.names import robot_iri
from irtwin.report.gap.page import render_gap
from irtwin.report.gap.summary import line
from irtwin.storage.database import Workspace

pytestmark = pytest.mark.slow

ORDER = ["summary", "where", "which", "friction", "shrink", "next", "untestable", "provenance"]


@pytest.fixture(scope="module")
def pages(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    base = tmp_path_factory.mktemp("gap")
    for verdict in gap_cases.VERDICTS:
        page_of(base / verdict, gap_cases.diagnosis(verdict), gap_cases.evidence(verdict), twin="{}")
    return {verdict: base / verdict / "p.html" for verdict in gap_cases.VERDICTS}


@pytest.fixture(scope="module")
def texts(pages: dict[str, Path]) -> dict[str, str]:
    return {verdict: plain(file.read_text(encoding="utf-8")) for verdict, file in pages.items()}


def verdict_of(page: str) -> str:
    return re.search(r'class="verdict">(.*?)</p>', page)[1]


@pytest.mark.parametrize("verdict", gap_cases.VERDICTS)
def test_the_verdict_is_what_the_terminal_says(texts: dict[str, str], verdict: str) -> None:
    said = line(gap_cases.document(verdict), None if verdict == "no_gap" else "reference")
    assert f"{verdict}: {verdict_of(texts[verdict])}".lower() == said.lower()  # names of effects begin alike or not


def test_where_there_is_no_gap_the_map_is_not_contradicted(texts: dict[str, str]) -> None:
    assert "There is no gap that matters, so no place of it is named." in texts["no_gap"]
    assert "No joint or regime has a gap above the noise floor." not in texts["no_gap"]


@pytest.mark.parametrize("verdict", gap_cases.VERDICTS)
def test_sections_stand_in_order(texts: dict[str, str], verdict: str) -> None:
    known = [one for one in ORDER if verdict == "attributed" or one != "friction"]
    assert re.findall(r'<(?:section|header) id="(\w+)"', texts[verdict]) == known


@pytest.mark.parametrize(
    ("verdict", "action"),
    [
        ("no_gap", "Keep the twin as it is"),
        ("attributed", "Adopt the twin with the causes added"),
        ("attributed", "Check the gear oil and temperature: joint_a3"),
        ("ambiguous", "Measure what tells the rivals apart"),
        ("ambiguous", "Model the effect: joint_a3"),
        ("unexplained", "Look for an effect outside the catalogue"),
    ],
)
def test_rules_say_what_to_do(texts: dict[str, str], verdict: str, action: str) -> None:
    assert action in texts[verdict]


def test_nothing_is_drawn_of_nothing(pages: dict[str, Path]) -> None:
    assert set(figures_of(pages["no_gap"])) == {"heat_map"}


def test_causes_stand_in_the_order_of_their_shares(texts: dict[str, str]) -> None:
    headings = re.findall(r"<h3>(\d\. [^<]*) on joint_a3</h3>", texts["attributed"])
    assert headings == ["1. Viscous friction", "2. Stribeck friction"]
    assert "70 % of the closed gap" in texts["attributed"]


def test_rivals_stand_with_their_probabilities(texts: dict[str, str]) -> None:
    page = texts["ambiguous"]
    assert "These data cannot tell it from:</strong> nonlinear viscous friction (47 %)." in page
    assert "<dt>probability of rivals</dt><dd>nonlinear viscous friction 47 %; backlash 1.2 %</dd>" in page
    assert "<dt>log odds</dt><dd>6.40</dd>" in page
    assert "No other effect that was tried is likely in its place." in texts["attributed"]


def test_rivals_of_a_diagnosis_that_says_no_probability_are_named_alone(tmp_path: Path) -> None:
    said = gap_cases.diagnosis("ambiguous")
    for cause in said["causes"]:
        cause["evidence"]["probability_of_rivals"] = {}
    page = page_of(tmp_path, said)
    assert "These data cannot tell it from:</strong> nonlinear viscous friction." in page
    assert "probability of rivals" not in page


def test_a_floor_that_no_channel_has_takes_no_column(tmp_path: Path, texts: dict[str, str]) -> None:
    said = gap_cases.diagnosis("attributed")
    for size in said["gap"]["torque"].values():
        size |= {"noise_floor": None, "excess": None, "sensor_noise": None}
    size_of_gap = re.compile(r"<caption>Size of the gap before.*?</table>", re.DOTALL)
    (without,) = size_of_gap.findall(page_of(tmp_path, said))
    (with_floor,) = size_of_gap.findall(texts["attributed"])
    assert "RMSE" in without and "Noise floor" not in without and "Excess" not in without
    assert "Noise floor" in with_floor and "Excess" in with_floor


def test_the_next_experiment_is_said_and_drawn(pages: dict[str, Path], texts: dict[str, str]) -> None:
    page = texts["ambiguous"]
    assert "The next experiment, to tell Stribeck friction from nonlinear viscous friction" in page
    assert "Joint_a3: a ladder of 8 constant speeds, each both ways." in page
    assert re.search(r"nonlinear viscous friction\?</th><td class=.number.>1.1</td><td class=.number.>7.2</td>", page)
    assert "0.005, 0.05, 0.5 rad/s" in page
    assert re.search(r"a ladder of constant speeds \(chosen\)</th><td class=.number.>0.9 min", page)
    assert ">over 100<" in page
    assert figures_of(pages["ambiguous"])["experiment"]["data"][0]["name"] == "joint_a3"


def test_small_and_large_excesses_are_told_apart_by_their_shade(pages: dict[str, Path]) -> None:
    (cells,) = figures_of(pages["attributed"])["heat_map"]["data"]
    shades = sorted(value for row in cells["z"] for value in row)
    assert shades[-1] == pytest.approx(math.log10(4)) and cells["zmax"] >= shades[-1]


def test_places_carry_their_intervals(texts: dict[str, str]) -> None:
    assert "<small>10 % … 90 %</small>" in texts["attributed"] and "<small>8.0 … 15</small>" in texts["attributed"]


def test_what_differs_between_repeats_is_described(texts: dict[str, str]) -> None:
    row = next(part for part in texts["attributed"].split("<tr>") if "<td>an oscillation</td>" in part)
    assert "joint_a3" in row and "f 2.9" in row and "Hz (2.88 … 2.92), A 1.09" in row and "viscous friction" in row
    assert "What differs between repeats" not in texts["no_gap"]


def test_a_gap_whose_causes_are_unsure_is_nowhere_called_explained(tmp_path: Path) -> None:
    said = gap_cases.diagnosis("attributed") | {"verdict": "unexplained", "unexplained_because": "unsure"}
    for cause in said["causes"]:
        cause["confidence"] = 0.3
    page = plain(page_of(tmp_path, gap_cases.with_findings(said)))
    assert verdict_of(page).startswith(
        "There is a gap in the torque of joint_a3, mostly in the regime “low speed”, and no cause that was found is "
        "sure: perhaps friction of joint_a3 (30 % sure). Adding this to the twin closes 93 % of the gap"
    )
    assert "Causes were found, but none of them is more likely than not and sure to close some of the gap." in page
    assert "differs from the twin" not in page and "changed since the reference runs (" not in page
    assert re.findall(r"<h3>(\d\. [^<]*) on joint_a3</h3>", page) == [
        "1. Perhaps viscous friction", "2. Perhaps Stribeck friction",
    ]  # fmt: skip
    assert "confidence 30 %: a guess" in page
    assert "Log more before acting" in page
    for action in ("Check the gear oil", "Identify the twin again", "Adopt the twin", "Look for an effect outside"):
        assert action not in page


def test_a_place_that_chance_may_make_is_marked(tmp_path: Path) -> None:
    said = gap_cases.diagnosis("attributed")
    assert "perhaps low speed" not in page_of(tmp_path / "sure", said)
    said["locations"][0]["false_discovery_rate"] = 0.3
    page = page_of(tmp_path / "unsure", said)
    assert "<td>perhaps low speed</td>" in page and "chance may make such a place too" in page


def test_classes_of_several_causes_are_kept_apart(tmp_path: Path) -> None:
    said = gap_cases.diagnosis("ambiguous")
    said["causes"][1] |= {"effect": "payload", "joints": [], "indistinguishable_from": ["base_tilt"]}
    said["causes"][1]["confidence"] = 0.61
    verdict = verdict_of(plain(page_of(tmp_path, gap_cases.with_findings(said))))
    assert "(52 % sure): Stribeck friction (52 %) or nonlinear viscous friction (16 %); " in verdict
    assert "load differs from the twin’s (61 % sure): payload (61 %) or base tilt (18 %)." in verdict


def test_findings_stand_in_a_table_and_what_closes_little_is_folded(tmp_path: Path) -> None:
    said = gap_cases.diagnosis("attributed")
    said["causes"][1] |= {"effect": "payload", "joints": []}
    said = gap_cases.with_findings(said)
    said["findings"][1] |= {"matters": False, "share": 0.0004}
    page = plain(page_of(tmp_path, said))
    assert "Friction of joint_a3 changed since the reference runs</th>" in page
    assert "Load changed" not in page
    assert '<p class="hint">Not listed: 1 finding closes less than 0.1 % of the gap in torque.</p>' in page
    few, little = page.split('id="which"')[1].split("<summary>Causes that close little</summary>")
    assert "1. Viscous friction on joint_a3</h3>" in few and "2. Payload</h3>" in little.split('id="shrink"')[0]


def test_without_a_floor_it_is_said_what_the_first_finding_closes(tmp_path: Path) -> None:
    said = gap_cases.diagnosis("attributed")
    said["shrink"]["closed_fraction"] = None
    said["findings"][0]["share_of"] = "the mean square, as no floor is known"
    page = plain(page_of(tmp_path, said))
    assert "<b>93 %</b><span>closed by friction</span>" in page
    assert "<small>of the mean square, as no floor is known, in torque</small>" in page


def test_stretches_of_one_run_have_bars_of_their_own(tmp_path: Path) -> None:
    drawn = gap_cases.evidence("attributed")
    drawn["runs"] = [line | {"run": "work_1"} for line in drawn["runs"]]
    page_of(tmp_path, gap_cases.diagnosis("attributed"), drawn)
    bars = figures_of(tmp_path / "p.html")["runs_torque"]["data"][0]["x"]
    assert bars == ["work_1, part 1", "work_1, part 2", "work_1, part 3", "work_1, part 4"]


def test_of_many_joints_the_foremost_curves_are_shown(tmp_path: Path) -> None:
    drawn = gap_cases.evidence("attributed")
    drawn["follows"] = [drawn["follows"][0] | {"joint": joint} for joint in gap_cases.JOINTS]
    page = page_of(tmp_path, gap_cases.diagnosis("attributed"), drawn)
    assert re.findall(r"<h3>Torque of (\w+) against speed", page) == ["joint_a1", "joint_a2", "joint_a3"]
    assert "has 3 more curves" in page


def test_what_no_file_of_the_simulator_holds_is_said_with_what_that_leaves(tmp_path: Path) -> None:
    said = gap_cases.diagnosis("attributed")
    said["shrink"]["by_cause"][0] |= {"channel": "position", "rmse_when_left_out": [2.1e-3, 2.1e-3]}
    page = plain(page_of(tmp_path, said))
    assert page.count("No number of the simulator’s file holds it") == 1
    assert "0.00210 rad of the tracking error are left" in page
    said["causes"][0]["parameters"][0] |= {"simulator": 1.0, "robot": 2.82}
    assert "No number of the simulator’s file" not in page_of(tmp_path / "held", said)


def test_a_robot_without_diagnosis_is_an_error(tmp_path: Path) -> None:
    with Workspace(tmp_path / "w") as workspace:
        six_axis(workspace)
        with pytest.raises(InputError, match="no diagnosis"):
            render_gap(graph_of(workspace), robot_iri(rows.ROBOT), workspace.read_document, tmp_path / "p.html")


def test_what_cannot_be_true_and_the_scale_of_torque_are_said(texts: dict[str, str]) -> None:
    page = texts["attributed"]
    for row in (
        "torque constant error</th><td>joint_a2</td><td>g = 2.1 (2.05 to 2.16); 0.7 to 1.4 is possible",
        "payload</th><td>–</td><td>m = -9 kg",
    ):
        assert row in page
    assert page.count("The scale of torque is uncertain by 10 %: torque of drives") == 2  # of each cause's parameters
    assert "The scale of torque" not in texts["ambiguous"]


def test_the_filter_is_said(texts: dict[str, str]) -> None:
    said = "Signals were low-pass filtered at 9.79 Hz (found: 10 times the bandwidth of the motion)."
    assert said in texts["attributed"]
    assert "low-pass filtered" not in texts["ambiguous"]


def test_text_from_the_data_is_no_markup(tmp_path: Path) -> None:
    said = gap_cases.diagnosis("attributed")
    said["not_testable"] = [{"effect": "payload", "why": "<script>alert(1)</script>"}]
    assert "<script>alert" not in page_of(tmp_path, said)


@pytest.mark.system
def test_every_figure_is_drawn_without_network(browser: Any, pages: dict[str, Path]) -> None:
    for verdict in set(pages) - {"ambiguous"}:  # which tests/report/test_pages_in_browser.py opens
        file = pages[verdict]
        page = browser.new_context(viewport={"width": 1440, "height": 900}, offline=True).new_page()
        complaints = complaints_of(page)
        page.goto(file.as_uri())
        page.wait_for_selector("#figure-heat_map .heatmaplayer image, #figure-heat_map .hm")
        for plot in page.locator(".plot").all():
            assert plot.locator(".plot-container").count() == 1
        assert page.evaluate("document.documentElement.scrollWidth") == 1440
        assert complaints == [], verdict
        page.context.close()


def test_the_residual_of_a_joint_that_slides_is_a_force(tmp_path: Path):
    page_of(tmp_path, gap_cases.diagnosis("attributed"), kind="prismatic")
    titles = [
        figure["layout"]["yaxis"]["title"]["text"]
        for name, figure in figures_of(tmp_path / "p.html").items()
        if name.startswith(("follows", "runs_torque"))
    ]
    assert "N m" not in " ".join(titles)
    assert any(title.endswith(", N") for title in titles)


def test_a_number_of_a_link_has_its_meaning_beside_it(tmp_path: Path) -> None:
    told = gap_cases.diagnosis("attributed")
    cause = next(one for one in told["causes"] if one["parameters"])
    cause["effect"] = "rigid_body"
    cause["parameters"] = [cause["parameters"][0] | {"name": "centre_x (upper_arm)"}]
    assert "Coordinate of a link’s centre of mass" in plain(page_of(tmp_path, told)).replace("'", "’")

"""The case study: one command from logs to a page that says what the graph says."""

from __future__ import annotations

import re
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import irtwin as irtwin_package
from irtwin import case_study
from irtwin.asking import ask
from irtwin.errors import InputError
from irtwin.location import Location
from irtwin.planning.plan import Plan
from irtwin.report.case_study.page import individuals
from irtwin.report.wording import percent
from irtwin.resources import folder
from irtwin.signals.log import read_data_set
from irtwin.signals.motion import Motion
from tests.data_sets import Said, irtwin, refused
from tests.screens import complaints_of, faults, narrow_and_dark

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not all(map(find_spec, ("ompl", "toppra", "mujoco"))), reason="needs irtwin[plan,mujoco]"),
]

Done = tuple[Said, Path]


@pytest.fixture(scope="module")
def done(tmp_path_factory: pytest.TempPathFactory) -> Done:
    workspace = tmp_path_factory.mktemp("case") / "study"
    return irtwin("demo", "--case-study", "--workspace", workspace), workspace


@pytest.fixture(scope="module")
def text(done: Done) -> str:
    page = (done[1] / "reports" / "case_study.html").read_text(encoding="utf-8")
    page = re.sub(r"<(script|style)[^>]*>.*?</\1>", "", page, flags=re.DOTALL)
    return re.sub(r"\s+", " ", re.sub(r"<[^>]+>", " ", page).replace("\N{NO-BREAK SPACE}", " ").replace("\u202f", " "))


@pytest.mark.nightly
def test_the_command_says_each_step_and_where_the_page_is(done: Done) -> None:
    said, workspace = done
    assert said.status == 0
    assert [line[:2] for line in said.err.splitlines() if line[:1].isdigit()] == ["1.", "2.", "3.", "4."]
    assert str(workspace / "reports" / "case_study.html") in said.out


@pytest.mark.nightly
def test_the_plan_comes_nearer_than_the_seed_and_is_judged_on_a_run_that_was_not_fitted(done: Done, text: str) -> None:
    assert re.search(r"\n +0\.3 s +\d+ W +\d+ J\n", done[0].err)  # as it moves
    (row,) = ask("planned_against_measured", done[1]).rows
    assert (row["plan"], row["run"]) == (case_study.PLANNED, case_study.MEASURED)
    assert abs(row["difference_percent"]) < 6.54
    part = "PREFIX irt: <https://w3id.org/irtwin#> SELECT ?part { ?run irt:performs ?plan ; irt:Part_In_Twin ?part }"
    assert [found["part"] for found in ask(part, done[1]).rows] == ["held_out"]
    assert f"planned to take {row['planned_Wh'] * 3600:.1f} J and took {row['measured_Wh'] * 3600:.1f} J" in text
    assert f"off by {' '.join(percent(abs(row['difference_percent'])).split())}" in text and "off by 6.54 %" in text


@pytest.mark.nightly
@pytest.mark.parametrize(
    "figure",
    ["figures 7 and 8", "figure 9 and equations 13 to 15", "figure 10", "figure 11", "figure 12", "figure 13"],
)
def test_each_figure_of_the_seed_has_its_counterpart(text: str, figure: str) -> None:
    assert f"Seed, {figure}" in text


@pytest.mark.nightly
def test_the_page_shows_the_individual_and_both_configurations(text: str) -> None:
    for property_ in ("irt:IR_Name KUKA_KR6_R700", "irt:Controlled_Axes 6", "irt:Run_Time 1.2 s", "irt:Planned_Energy"):
        assert property_ in text
    assert "joint_a2 −90.0° −45.0°" in text and "joint_a6 0.0° 90.0°" in text
    assert "The measurement is simulated." in text


def test_individuals_are_named_below_the_workspaces_base() -> None:
    base = "https://plant.example/energy/"
    rows = [{"individual": f"{base}run/{name}", "class": "run", "property": "x"} for name in ("a", "a", "b")]
    assert [(name, len(its)) for name, _, its in individuals(rows, base)] == [("run/a", 2), ("run/b", 1)]


@pytest.mark.nightly
def test_a_folder_that_is_not_empty_is_left_alone(done: Done) -> None:
    again = refused("demo", "--case-study", "--workspace", done[1])
    assert "is not empty; remove it, or name a new folder by --workspace" in again


def test_a_task_that_fails_leaves_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(case_study, "identify", lambda *given: None)  # so there is no robot to plan with
    with pytest.raises(InputError):
        case_study.case_study(Location(tmp_path / "new"))
    assert not (tmp_path / "new").exists()


def test_without_the_planners_it_says_what_to_install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(case_study, "find_spec", lambda name: None)
    with pytest.raises(InputError, match=r'pip install "irtwin\[plan,mujoco\]"'):
        case_study.case_study(Location(tmp_path / "new"))
    assert not (tmp_path / "new").exists()


def test_the_task_may_be_given_and_must_be_one() -> None:
    task = case_study.task_of(goal="1,-1,1.2,0,0.5,0", seconds=2.0)
    assert np.degrees(task.start).tolist() == pytest.approx([0, -90, 90, 0, 0, 0])
    assert list(task.goal) == [1, -1, 1.2, 0, 0.5, 0] and task.seconds == 2.0
    with pytest.raises(InputError, match="--from"):
        case_study.task_of(start="1,2")
    assert "give --case-study, too" in refused("demo", "--seconds", "2")


def test_what_the_plant_cannot_follow_is_said(tmp_path: Path) -> None:
    data_set = case_study.unpack(tmp_path)
    time, still = np.linspace(0, 1.2, 121), np.zeros((121, 6))
    far = Motion(time, still + 9 * time[:, None], still, still, run="far")
    with pytest.raises(InputError, match=r"cannot carry process_measured out: joint 2 passes its position limit"):
        case_study.measure(data_set, Plan(read_data_set(data_set).robot, far, None, 0.0, True, (), 1.2), print)


@pytest.mark.nightly
def test_each_equation_of_the_seed_has_its_number_in_source_ontology_and_page(text: str) -> None:
    source = " ".join(file.read_text(encoding="utf-8") for file in Path(irtwin_package.__file__).parent.rglob("*.py"))
    said = [re.findall(r"\d+", each) for each in re.findall(r"Yan 2018,\s+eqs?\.\s+([\d, ]*(?:to \d+)?)", source)]
    spans = [range(int(one[0]), int(one[-1]) + 1) for one in said]
    assert {number for span in spans for number in span} == set(range(1, 16))
    ontology = " ".join(file.read_text(encoding="utf-8") for file in folder("ontology").glob("*.ttl"))
    for number in range(1, 16):
        assert f'"Yan et al. (2018), equation ({number})"' in ontology
        assert f" ({number}) " in text


@pytest.mark.nightly
@pytest.mark.system
def test_the_page_draws_its_figures_and_moves_the_robot(done: Done, browser: Any) -> None:
    file = done[1] / "reports" / "case_study.html"
    assert file.stat().st_size < 3_000_000
    page = browser.new_page(viewport={"width": 1440, "height": 900})
    page.set_default_timeout(90_000)  # ms; without a graphics card the scene's pictures take their time
    complaints = complaints_of(page)
    page.goto(file.as_uri())
    page.wait_for_selector("#figure-energy .scatterlayer .trace")
    page.wait_for_function("document.querySelector('.pose[data-at=last] img').src")
    first, last = (page.get_attribute(f".pose[data-at={at}] img", "src") for at in ("first", "last"))
    assert first and last and first != last
    assert page.locator("#figure-power .scatterlayer .trace").count() == 4
    assert page.locator(".is-run option").all_inner_texts() == [case_study.PLANNED, case_study.MEASURED]
    page.evaluate("document.dispatchEvent(new CustomEvent('irtwin:time', {detail: {time: 1e9}}))")
    (row,) = ask("planned_against_measured", done[1]).rows
    assert float(page.inner_text(".is-energy")) == pytest.approx(row["planned_Wh"], abs=2e-4)
    assert page.evaluate("document.documentElement.scrollWidth") == 1440
    assert faults(page) == []
    assert narrow_and_dark(page) == []
    assert complaints == []

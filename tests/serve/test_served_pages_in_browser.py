"""What is served, in headless Chromium: wide and narrow, light and dark, by keyboard, and nothing fetched elsewhere."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Any

import pytest
from tests.endpoint import Server
from tests.screens import complaints_of, faults, is_dark, narrow_and_dark
from tests.waiting import wait_for

from irtwin.report.wording import heading

pytestmark = pytest.mark.system

PAGES = (
    "/", "/robot/Arm_A", "/robot/Arm_D", "/run/Arm_A.fit_1", "/compare?robot=Arm_A&a_to=2026-03-02&b_from=2026-03-03",
    "/irtwin/id/run/Arm_A.fit_1", "/query", "/live",
)  # fmt: skip
READY = {"/query": "#questions button", "/live": "#robots tr, #none:visible"}


@pytest.fixture(scope="module")
def opened(browser: Any, plant: Server) -> Iterator[tuple[Any, list[str]]]:
    """One page for all tests: a window of its own for each takes as long again. And whatever it complains of."""
    page = browser.new_page()
    page.set_default_timeout(60_000)
    yield page, complaints_of(page, (plant.url, "data:"))
    page.close()


@pytest.fixture
def complaints(opened: tuple[Any, list[str]]) -> list[str]:
    """What the page of a test complains of: one that is to complain looks at it, and clears it."""
    return opened[1]


@pytest.fixture
def page(opened: tuple[Any, list[str]], complaints: list[str]) -> Iterator[Any]:
    """The page as if it were new: wide, light and empty. It complains of nothing until the test ends."""
    page, _ = opened
    page.goto("about:blank")
    page.set_viewport_size({"width": 1440, "height": 900})
    page.emulate_media(color_scheme="light")
    complaints.clear()
    yield page
    assert complaints == []


@pytest.mark.parametrize("path", PAGES)
def test_each_page_wide_and_narrow_light_and_dark(page: Any, plant: Server, path: str) -> None:
    page.goto(plant.url + path)
    page.wait_for_selector(READY.get(path, "main h1"))
    assert not is_dark(page)
    assert page.evaluate("document.documentElement.scrollWidth") == 1440
    assert faults(page) == []
    assert narrow_and_dark(page) == []


def test_a_question_is_answered_under_headings_with_units_and_plotted(page: Any, plant: Server) -> None:
    page.goto(f"{plant.url}/query")
    page.wait_for_selector("#questions button")
    said = plant.get("/questions.json").json()
    assert page.locator("#questions button").count() == len(said["questions"])
    page.fill("#filter", "how much energy did each run take")
    assert page.locator("#questions li:visible").count() == 1
    page.click("#questions li:visible button")
    page.wait_for_selector("#answer table td")
    assert "PREFIX irt: <https://w3id.org/irtwin#>" in page.inner_text(".CodeMirror-code")
    assert page.inner_text("#said").startswith("7 rows, in ")
    assert page.locator("#answer thead th").all_text_contents()[4:6] == ["Energy, Wh", "Mean power, W"]
    page.click("#answer summary >> text=Plot")
    page.wait_for_selector("#answer .plot .barlayer .point")
    assert page.locator("#answer .legendtext").all_text_contents() == ["Arm_A", "Arm_B", "Arm_C"]
    assert page.locator("#answer .xtitle, #answer .ytitle").all_text_contents() == ["Run", "Energy, Wh"]
    page.locator("#answer label", has_text="over").locator("select").select_option("payload_kg")
    page.wait_for_selector("#answer .plot .scatterlayer .point")
    assert page.locator("#answer .modebar-btn").first.get_attribute("data-title") == "Download plot as a PNG"
    assert faults(page) == []
    assert narrow_and_dark(page) == []
    with page.expect_download() as file:
        page.click("#answer button >> text=CSV")
    assert file.value.path().read_text().startswith("robot,run,time_s,")
    names = sorted({name for one in said["questions"] for name in re.findall(r"\?(\w+)", one["text"])})
    here = page.evaluate(
        "([names, tables]) => names.map((name) => irtwinAnswer.headingOf(name, tables))", [names, said["headings"]]
    )
    assert here == [heading(name) for name in names]


ASKED = {
    "ASK {}": "Yes, in ",
    "SELECT ?x { ?x a irt:Nothing }": "No row fits, in ",
    "CONSTRUCT { irt:a irt:b irt:c } {}": "Triples, in ",
    "SELECT nothing": "not a SPARQL query: error at 1:",
    "SELECT ?x ?who_J { VALUES (?x ?who_J) { (1 'a<b>') (irt:Robot true) } }": "2 rows, in ",
}


def test_whatever_is_asked(page: Any, complaints: list[str], plant: Server) -> None:
    page.goto(f"{plant.url}/query")
    page.wait_for_selector("#questions button")
    for query, said in ASKED.items():
        page.evaluate("text => document.querySelector('.CodeMirror').CodeMirror.setValue(text)", query)
        page.focus(".CodeMirror textarea")
        page.keyboard.press("Control+Enter")
        page.wait_for_selector(f"#said >> text={said}")
    assert all("400 (Bad Request)" in complaint for complaint in complaints)
    complaints.clear()
    page.focus(".CodeMirror textarea")
    page.keyboard.press("Tab")
    assert page.evaluate("document.activeElement.id") == "run"


def test_a_long_name_of_a_file_is_broken(page: Any, plant: Server) -> None:
    page.set_viewport_size({"width": 400, "height": 900})
    page.goto(plant.url + next(path for path in PAGES if path.startswith("/run/")))
    page.evaluate("document.querySelector('#files code').textContent = `series/${'a'.repeat(64)}.parquet`")
    assert page.evaluate("document.documentElement.scrollWidth") == 400


def until(page: Any, what: str) -> None:
    """Wait until something holds, which the page's policy lets no script of Playwright's do."""
    wait_for(lambda: page.evaluate(what), 30.0)


def test_curves_zoom_and_mark_a_moment(page: Any, plant: Server) -> None:
    page.goto(f"{plant.url}/run/Arm_A.fit_1#t=7.3")
    until(page, "document.getElementById('moment').value === '7.3'")
    lines = "document.getElementById('curves').data.map((line) => [line.name, line.x.length, Math.max(...line.y)])"
    names, counts, peaks = zip(*page.evaluate(lines), strict=True)
    assert names == ("measured", "by the twin", "j1")
    assert all(600 < count <= 2000 for count in counts)
    assert peaks[:2] == (900, 880)
    page.evaluate("Plotly.relayout('curves', { 'xaxis.range': [7, 8] })")
    until(page, "document.getElementById('curves').data[0].x.length === 1001")
    page.fill("#moment", "2.5")
    until(page, "location.hash === '#t=2.5'")
    assert page.evaluate("document.getElementById('curves').layout.shapes.at(-1).x0") == 2.5
    until(page, "document.querySelector('#stands figcaption').textContent === 'at 2.50 s'")
    page.goto(f"{plant.url}/compare?robot=Arm_A&by=run&a_run=Arm_A.fit_1&b_run=Arm_A.check_1")
    page.wait_for_selector("#curves .scatterlayer .trace", state="attached")
    assert [line[0] for line in page.evaluate(lines)] == ["fit_1", "check_1", "j1", "j1"]
    assert faults(page) == []
    assert narrow_and_dark(page) == []


def test_from_the_plant_to_a_run_and_a_comparison(page: Any, plant: Server) -> None:
    page.goto(plant.url)
    page.click("#measured tbody th >> text=Arm_A")
    page.wait_for_selector("h1 >> text=Arm_A")
    page.click("text=Before and after a change")
    page.fill("[name=a_to]", "2026-03-02")
    page.fill("[name=b_from]", "2026-03-03")
    page.click("button >> text=Compare")
    page.wait_for_selector("h2 >> text=Mean power by joint")
    assert "−46.7" in page.inner_text("main")
    page.click("text=Two runs instead")
    page.select_option("[name=a_run]", "Arm_A.fit_1")
    page.select_option("[name=b_run]", "Arm_A.check_1")
    page.click("button >> text=Compare")
    page.wait_for_selector("h2 >> text=Mean power by joint")
    page.go_back()
    page.go_back()
    page.goto(f"{plant.url}/robot/Arm_A")
    page.click("#runs th >> text=check_1")
    page.wait_for_selector("h1 >> text=check_1")
    page.click("text=All that the graph says")
    page.wait_for_selector("text=https://w3id.org/irtwin/id/run/Arm_A.check_1")


def test_by_keyboard(page: Any, plant: Server) -> None:
    page.goto(plant.url)
    page.keyboard.press("Tab")
    assert page.evaluate("document.activeElement.className") == "skip"
    page.keyboard.press("Enter")
    page.keyboard.press("Tab")
    assert page.evaluate("document.activeElement.closest('main') !== null")


def test_a_report_cannot_ask_the_server(page: Any, complaints: list[str], plant: Server) -> None:
    page.goto(f"{plant.url}/reports/Arm_A.html")
    page.wait_for_selector("text=kept out")
    complaints.clear()  # that it was

"""The page in a real browser, without network."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from markupsafe import Markup
from tests.report.robots import power_only, six_axis
from tests.screens import complaints_of
from tests.waiting import wait_for

from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.packing import Fragment, packed_scripts
from irtwin.report.energy.page import render

playwright = pytest.importorskip("playwright.sync_api")
pytestmark = pytest.mark.system

Page = playwright.Page
SCRIPTS = packed_scripts(['document.getElementById("stub").dataset.ran = "yes";'])
SCENE = Fragment(Markup('<div id="stub" style="height: 200px"></div>') + SCRIPTS.html, SCRIPTS.scripts)


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    graph = KnowledgeGraph()
    graph.load_ontology()
    six = six_axis(graph, runs=6)
    out = tmp_path_factory.mktemp("page") / "robot.html"
    render(graph, six.iri, six.read_series, out, draw_scene=lambda runs, opens: SCENE)
    return out


@pytest.fixture(scope="module")
def page(browser: playwright.Browser, file: Path) -> Iterator[Page]:
    """Open the page once, for it takes seconds, and let no complaint of the browser pass.

    Tests leave it as wide as it was; what chooses another run or zooms comes last.
    """
    context = browser.new_context(viewport={"width": 1440, "height": 900}, offline=True)
    page = context.new_page()
    complaints = complaints_of(page, mine=(file.as_uri(), "data:", "blob:"))
    page.goto(file.as_uri())
    page.wait_for_selector("#figure-energy_per_joint .bars path")
    yield page
    context.close()
    assert complaints == []


def time_range(page: Page, figure: str) -> list[float]:
    found: list[float] = page.evaluate(f"document.getElementById('{figure}')._fullLayout.xaxis.range")
    return found


def test_every_figure_is_drawn(page: Page):
    for plot in page.locator(".plot").all():
        assert plot.locator(".plot-container").count() == 1
    assert page.locator("#figure-torque .scatterlayer .trace").count() == 18
    assert page.locator("#figure-power .scatterlayer .trace").count() == 6


def test_the_scenes_script_may_run(page: Page):
    assert page.locator("#stub").get_attribute("data-ran") == "yes"


@pytest.mark.parametrize("width", [1024, 1440])
def test_nothing_sticks_out(page: Page, width: int):
    page.set_viewport_size({"width": width, "height": 900})
    wait_for(lambda: page.evaluate("document.documentElement.scrollWidth") == width, 20.0)  # charts follow in time


def test_on_paper_no_chart_is_wider_than_the_page(page: Page, tmp_path: Path):
    page.evaluate("window.dispatchEvent(new Event('beforeprint'))")
    page.wait_for_timeout(500)
    widths = page.evaluate("[...document.querySelectorAll('.main-svg')].map((svg) => svg.clientWidth)")
    assert widths and max(widths) <= 680
    assert page.evaluate("[...document.querySelectorAll('details.long')].every((table) => table.open)")
    page.evaluate("window.dispatchEvent(new Event('afterprint'))")
    page.wait_for_timeout(500)
    assert page.evaluate("document.querySelector('.main-svg').clientWidth") > 680
    page.pdf(path=tmp_path / "page.pdf", prefer_css_page_size=True)
    assert (tmp_path / "page.pdf").stat().st_size > 50_000


def test_the_scene_and_the_charts_show_the_same_moment(page: Page):
    page.locator("#figure-torque").scroll_into_view_if_needed()
    page.evaluate("document.dispatchEvent(new CustomEvent('irtwin:time', {detail: {time: 5, source: null}}))")
    cursors = page.locator("#figure-torque .cursor")
    assert cursors.count() == 6
    left = cursors.first.bounding_box()
    panel = page.locator("#figure-torque .nsewdrag").first.bounding_box()
    assert left["x"] == pytest.approx(panel["x"] + panel["width"] / 4, abs=2)
    page.evaluate("document.addEventListener('irtwin:time', (event) => { window.told = event.detail.time; })")
    page.mouse.move(panel["x"] + panel["width"] / 2 - 3, panel["y"] + panel["height"] / 2)
    page.mouse.click(panel["x"] + panel["width"] / 2, panel["y"] + panel["height"] / 2)
    assert page.evaluate("window.told") == pytest.approx(10.0, abs=0.3)


def test_another_run_can_be_chosen(page: Page):
    assert page.locator("#run-part").inner_text() == "held out: no sample of it was fitted"
    before = page.evaluate("document.getElementById('figure-torque').data[0].y.slice(0, 50)")
    page.select_option("#run-choice", label="exciting_1")
    page.wait_for_timeout(300)
    assert page.locator("#run-part").inner_text() == "took part in the fit"
    assert page.evaluate("document.getElementById('figure-torque').data[0].y.slice(0, 50)") != before


def test_a_run_chosen_here_is_told_and_one_chosen_in_the_scene_is_drawn(page: Page):
    page.evaluate("document.addEventListener('irtwin:run', (event) => { window.told = event.detail.run; })")
    page.select_option("#run-choice", label="exciting_1")
    first = page.evaluate("document.getElementById('run-choice').selectedIndex")
    assert page.evaluate("window.told") == first
    drawn = page.evaluate("document.getElementById('figure-torque').data[0].y.slice(0, 50)")
    page.evaluate(f"document.dispatchEvent(new CustomEvent('irtwin:run', {{detail: {{run: {first + 1}}}}}))")
    assert page.evaluate("document.getElementById('run-choice').selectedIndex") == first + 1
    assert page.evaluate("document.getElementById('figure-torque').data[0].y.slice(0, 50)") != drawn


def test_dragging_zooms_all_charts_of_the_run(page: Page):
    page.locator("#figure-torque").scroll_into_view_if_needed()
    box = page.locator("#figure-torque .nsewdrag").first.bounding_box()
    middle = box["y"] + box["height"] / 2
    page.mouse.move(box["x"] + 0.25 * box["width"], middle)
    page.mouse.down()
    page.mouse.move(box["x"] + 0.5 * box["width"], middle, steps=8)
    page.mouse.up()
    page.wait_for_timeout(500)
    start, end = time_range(page, "figure-torque")
    assert start == pytest.approx(5.0, abs=0.3) and end == pytest.approx(10.0, abs=0.3)
    assert time_range(page, "figure-power") == pytest.approx([start, end])


def test_a_robot_without_torque(browser: playwright.Browser, tmp_path: Path):
    graph = KnowledgeGraph()
    graph.load_ontology()
    ur3 = power_only(graph)
    render(graph, ur3.iri, ur3.read_series, tmp_path / "robot.html")
    page = browser.new_page()
    complaints = complaints_of(page)
    page.goto((tmp_path / "robot.html").as_uri())
    page.wait_for_selector("#figure-power .scatterlayer .trace")
    assert complaints == []
    page.close()

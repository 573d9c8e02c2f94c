"""Reports in headless Chromium, light and dark, wide and narrow: read by axe-core, and as a person uses them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from pyoxigraph import Literal, NamedNode, Quad
from tests import gap_cases, plants, synthetic
from tests.gap_pages import page_of as gap_page
from tests.report.robots import PageOf, six_axis
from tests.screens import faults, is_dark, narrow_and_dark, on_screen

from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.knowledge.vocabulary import GRAPH_REASONED, term
from irtwin.planning.plan import nominal_twin
from irtwin.report import motion
from irtwin.report.ontology.page import write_page
from irtwin.report.plant import overview
from irtwin.report.plant import page as plant_page
from irtwin.report.questions import ask
from irtwin.report.templates import style
from irtwin.resources import shipped

pytestmark = pytest.mark.system
LARGEST = 3_000_000  # bytes of a report


def opened(browser: Any, file: Path, width: int, scheme: str) -> Any:
    page = browser.new_context(
        viewport={"width": width, "height": 900}, color_scheme=scheme, offline=True, bypass_csp=True
    ).new_page()
    page.goto(file.as_uri())
    return page


@pytest.fixture
def energy(graph: KnowledgeGraph, page_of: PageOf, tmp_path: Path) -> Path:
    robot = six_axis(graph)
    why = "prp-fp: two values of irt:IR_Weight, <50> and <60>"
    said = Quad(NamedNode(robot.iri), NamedNode(term("Contradiction")), Literal(why), NamedNode(GRAPH_REASONED))
    graph.replace([said], GRAPH_REASONED)
    page_of(robot)
    return tmp_path / "reports" / f"{robot.robot_id}.html"


def test_the_energy_page(browser: Any, energy: Path) -> None:
    assert energy.stat().st_size < LARGEST
    page = opened(browser, energy, 1440, "light")
    page.wait_for_selector("#figure-torque .scatterlayer .trace")
    assert not is_dark(page)
    assert page.evaluate("document.documentElement.scrollWidth") == 1440
    assert faults(page) == []
    buttons = page.eval_on_selector_all(".modebar-btn", "all => all.map(one => one.dataset.title)")
    assert set(buttons) == {"Download plot as a PNG", "Zoom", "Pan", "Zoom in", "Zoom out", "Reset axes"}
    names = page.locator("#figure-torque .legendtext").all_text_contents()
    assert names == ["measured", "modelled", "measured less modelled"]
    captions_and_banner_are_seen(page)
    assert narrow_and_dark(page) == []
    captions_and_banner_are_seen(page)
    page.emulate_media(media="print", color_scheme="dark")
    page.evaluate("dispatchEvent(new Event('beforeprint'))")
    assert not page.locator(".modebar").first.is_visible() and not is_dark(page)
    paper = page.locator("#figure-torque .main-svg").first.evaluate("one => one.style.background")
    assert "255, 255, 255" in paper
    page.context.close()


@pytest.mark.parametrize(("width", "scheme", "screens"), [(1440, "light", 1.0), (400, "dark", 4.0)])
def test_a_hundred_robots_fit_a_screen(
    browser: Any, plant: KnowledgeGraph, width: int, scheme: str, screens: float
) -> None:
    answers = plants.many(ask(plant, plant_page.questions(), {}), 25)
    beside = {"trouble": "", "file": "", "excel": False, "reports": []}
    found = overview.overview(answers)
    html = plant_page.render("page.html.jinja", answers, {}, found=found, **beside)
    page = browser.new_context(viewport={"width": width, "height": 900}, color_scheme=scheme).new_page()
    looks = style(shipped(), "layout/style.css", "plant/style.css")
    page.set_content(html.replace("</head>", f"<style>{looks}</style></head>"))
    assert page.locator("#glance").bounding_box()["height"] < screens * 900
    assert page.evaluate("document.documentElement.scrollWidth") == width
    assert faults(page, "#glance") == []
    page.context.close()


def captions_and_banner_are_seen(page: Any) -> None:
    cut = "all => all.filter(it => it.offsetWidth > it.closest('.table').clientWidth).map(it => it.innerText)"
    assert page.eval_on_selector_all(".table caption", cut) == []
    banner = page.locator("#contradiction")
    banner.scroll_into_view_if_needed()
    assert banner.is_visible()
    assert banner.inner_text().startswith(
        "What is said of this robot contradicts itself: prp-fp: two values of irt:IR_Weight, <50>"
    )


def test_the_gap_page(browser: Any, tmp_path: Path) -> None:
    gap_page(tmp_path, gap_cases.diagnosis("ambiguous"))
    file = tmp_path / "p.html"
    assert file.stat().st_size < LARGEST
    page = opened(browser, file, 400, "dark")
    page.wait_for_selector("#figure-heat_map .heatmaplayer image, #figure-heat_map .hm")
    assert is_dark(page)
    assert page.evaluate("document.documentElement.scrollWidth") == 400
    assert faults(page) == []
    assert on_screen(page, 1440, "light") == []
    page.context.close()


def test_the_page_of_a_motion(browser: Any, tmp_path: Path) -> None:
    twin = nominal_twin(synthetic.arm(2))
    motion.write_page(twin, synthetic.swing(twin.robot, 1, seconds=2.0), "swing", [], tmp_path / "swing.html")
    page = opened(browser, tmp_path / "swing.html", 1440, "light")
    page.wait_for_selector("#figure-power .scatterlayer .trace")
    assert page.evaluate("document.documentElement.scrollWidth") == 1440
    assert page.locator(".irtwin-scene canvas").is_visible()
    assert faults(page) == []
    assert narrow_and_dark(page) == []
    page.context.close()


@pytest.mark.nightly
def test_the_page_of_the_ontology(browser: Any, tmp_path: Path) -> None:
    write_page(tmp_path / "ontology.html")
    page = opened(browser, tmp_path / "ontology.html", 1440, "light")
    assert not is_dark(page)
    assert page.evaluate("document.documentElement.scrollWidth") == 1440
    page.evaluate(
        "document.querySelectorAll('article:nth-of-type(n+6)').forEach((one) => one.remove())"
    )  # of a thousand
    assert faults(page) == []
    assert narrow_and_dark(page) == []
    page.context.close()

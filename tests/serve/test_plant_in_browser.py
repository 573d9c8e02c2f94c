"""The plant's pages in headless Chromium: wide and narrow, by keyboard, and fetching nothing from elsewhere."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from typing import Any

import pytest
from tests.endpoint import Server

pytestmark = pytest.mark.system

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")
ARGUMENTS = [
    "--no-sandbox", "--disable-quic", "--no-first-run", "--disable-background-networking",
    "--disable-component-update", "--disable-sync",
]  # fmt: skip
PAGES = (
    "/", "/robot/Arm_A", "/robot/Arm_D", "/run/Arm_A.fit_1", "/compare?robot=Arm_A&a_to=2026-03-02&b_from=2026-03-03",
    "/irtwin/id/run/Arm_A.fit_1",
)  # fmt: skip


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    if CHROMIUM is None:
        pytest.skip("Chromium is not installed")
    playwright = pytest.importorskip("playwright.sync_api")
    with playwright.sync_playwright() as session:
        chromium = session.chromium.launch(executable_path=CHROMIUM, args=ARGUMENTS)
        yield chromium
        chromium.close()


@pytest.fixture
def page(browser: Any, plant: Server) -> Iterator[tuple[Any, list[str]]]:
    """A page, and whatever it complains of or asks of others."""
    page = browser.new_page(viewport={"width": 1440, "height": 900})
    page.set_default_timeout(60_000)
    complaints: list[str] = []
    page.on("console", lambda message: complaints.append(f"{message.type}: {message.text}"))
    page.on("pageerror", lambda error: complaints.append(str(error)))
    page.on("dialog", lambda dialog: complaints.append(dialog.message))
    page.on("request", lambda it: None if it.url.startswith((plant.url, "data:")) else complaints.append(it.url))
    yield page, complaints
    page.close()


@pytest.mark.parametrize("width", [1440, 400])
def test_no_page_is_wider_than_its_window(page: tuple[Any, list[str]], plant: Server, width: int) -> None:
    page, complaints = page
    page.set_viewport_size({"width": width, "height": 900})
    for path in PAGES:
        page.goto(plant.url + path)
        assert page.evaluate("document.documentElement.scrollWidth") == width, path
        assert page.locator("main h1").bounding_box()["x"] >= 0
    assert complaints == []


def test_a_long_name_of_a_file_is_broken(page: tuple[Any, list[str]], plant: Server) -> None:
    page, complaints = page
    page.set_viewport_size({"width": 400, "height": 900})
    page.goto(plant.url + next(path for path in PAGES if path.startswith("/run/")))
    page.evaluate("document.querySelector('#files code').textContent = `series/${'a'.repeat(64)}.parquet`")
    assert page.evaluate("document.documentElement.scrollWidth") == 400
    assert complaints == []


def test_from_the_plant_to_a_run_and_a_comparison(page: tuple[Any, list[str]], plant: Server) -> None:
    page, complaints = page
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
    assert complaints == []


def test_by_keyboard(page: tuple[Any, list[str]], plant: Server) -> None:
    page, _ = page
    page.goto(plant.url)
    page.keyboard.press("Tab")
    assert page.evaluate("document.activeElement.className") == "skip"
    page.keyboard.press("Enter")
    page.keyboard.press("Tab")
    assert page.evaluate("document.activeElement.closest('main') !== null")


def test_in_the_dark(browser: Any, plant: Server) -> None:
    page = browser.new_page(color_scheme="dark")
    page.goto(plant.url)
    ink, paper = page.evaluate(
        "[getComputedStyle(document.body).color, getComputedStyle(document.body).backgroundColor]"
    )
    assert (ink, paper) == ("rgb(230, 235, 239)", "rgb(18, 24, 30)")
    page.close()


def test_a_report_cannot_ask_the_server(browser: Any, plant: Server) -> None:
    page = browser.new_page()
    page.goto(f"{plant.url}/reports/Arm_A.html")
    page.wait_for_selector("text=kept out")
    page.close()

"""The query page in headless Chromium: it asks, shows the answer, and fetches nothing from elsewhere."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from typing import Any

import httpx
import pytest

pytestmark = pytest.mark.system

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")
ARGUMENTS = [
    "--no-sandbox", "--disable-quic", "--no-first-run", "--disable-background-networking",
    "--disable-component-update", "--disable-sync",
]  # fmt: skip


@pytest.fixture(scope="module")
def page(server) -> Iterator[tuple[Any, list[str]]]:
    """The page, and whatever it complains of or asks of others."""
    if CHROMIUM is None:
        pytest.skip("Chromium is not installed")
    playwright = pytest.importorskip("playwright.sync_api")
    with playwright.sync_playwright() as session:
        browser = session.chromium.launch(executable_path=CHROMIUM, args=ARGUMENTS)
        page = browser.new_page(viewport={"width": 1366, "height": 860})
        page.set_default_timeout(60_000)
        complaints: list[str] = []
        page.on("console", lambda message: complaints.append(f"{message.type}: {message.text}"))
        page.on("pageerror", lambda error: complaints.append(str(error)))
        page.on(
            "request", lambda request: None if request.url.startswith(server.url) else complaints.append(request.url)
        )
        page.goto(f"{server.url}/query")
        page.wait_for_selector("#questions button")
        yield page, complaints
        browser.close()


def test_a_named_question_is_asked_and_answered(page, server) -> None:
    page, complaints = page
    known = httpx.get(f"{server.url}/questions.json").json()["questions"]
    assert page.locator("#questions button").count() == len(known)
    page.fill("#filter", "which robots does the graph know")
    assert page.locator("#questions li:visible").count() == 1
    page.click("#questions li:visible button")
    page.wait_for_selector(".yasr table.dataTable td")
    assert "PREFIX irt: <https://w3id.org/irtwin#>" in page.inner_text(".tabPanel.active .CodeMirror-code")
    assert page.locator(".tabPanel.active .yasr table.dataTable tbody tr").count() > 0
    assert page.inner_text("#address") == server.sparql
    assert complaints == []


def test_a_mistake_is_shown_with_the_parsers_message(page) -> None:
    page, complaints = page
    page.evaluate("document.querySelector('.tabPanel.active .CodeMirror').CodeMirror.setValue('SELECT nothing')")
    page.click(".tabPanel.active .yasqe_queryButton")
    page.wait_for_selector(".tabPanel.active .yasr .errorResult")
    assert "not a SPARQL query: error at 1:" in page.inner_text(".tabPanel.active .yasr .errorResult")
    assert all("400 (Bad Request)" in complaint for complaint in complaints)

"""Templates of pages, compiled once in a process."""

from __future__ import annotations

from pathlib import Path

import jinja2
import pytest
from tests.trusting import trust_all

from irtwin.report.plant import page
from irtwin.report.templates import written
from irtwin.resources import folder, resources_of
from irtwin.serve.page import FOLDER


def test_a_template_that_changed_is_compiled_again(tmp_path: Path) -> None:
    template = tmp_path / "reports" / "energy" / "mine.html.jinja"
    template.parent.mkdir(parents=True)
    for text, expected in (("{{ joules | energy }}", "0.556\u00a0Wh"), ("{{ joules }} J", "2000 J")):
        template.write_text(text, encoding="utf-8")
        trust_all(tmp_path)
        for _ in range(2):
            assert written(resources_of(tmp_path), "energy/mine.html.jinja", joules=2000) == expected


def test_pages_of_a_plant_are_compiled_before_anybody_asks(monkeypatch: pytest.MonkeyPatch) -> None:
    page.compile_templates("http://example.org/id/")

    def compiled(*_: object, **__: object) -> None:
        raise AssertionError("a page would wait for this")

    monkeypatch.setattr(jinja2.Environment, "compile", compiled)
    templates = page._templates("http://example.org/id/")
    for name in ("page", "frame", "robot/page", "run/page", "comparison/page", "individual/page"):
        assert templates.get_template(f"plant/{name}.html.jinja").root_render_func


def test_no_page_asks_for_an_icon_that_is_not_there() -> None:
    pages = [*folder("reports").rglob("*.jinja"), *FOLDER.glob("*.html")]
    texts = {page.name: text for page in pages if "<head>" in (text := page.read_text(encoding="utf-8"))}
    assert len(texts) >= 5
    assert [name for name, text in texts.items() if '<link rel="icon" href="data:,">' not in text] == []

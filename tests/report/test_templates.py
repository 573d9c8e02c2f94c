"""Templates of pages, compiled once in a process."""

from __future__ import annotations

from pathlib import Path

from tests.trusting import trust_all

from irtwin.report.templates import written
from irtwin.resources import resources_of


def test_a_template_that_changed_is_compiled_again(tmp_path: Path) -> None:
    template = tmp_path / "reports" / "energy" / "mine.html.jinja"
    template.parent.mkdir(parents=True)
    for text, expected in (("{{ joules | energy }}", "0.556\u00a0Wh"), ("{{ joules }} J", "2000 J")):
        template.write_text(text, encoding="utf-8")
        trust_all(tmp_path)
        for _ in range(2):
            assert written(resources_of(tmp_path), "energy/mine.html.jinja", joules=2000) == expected

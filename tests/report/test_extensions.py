"""Questions and templates that extend a report, looked through before a page is made."""

from __future__ import annotations

from pathlib import Path

import pytest
from tests.report.robots import six_axis
from tests.trusting import trust_all

from irtwin.errors import InputError
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.report.energy.page import render
from irtwin.report.extensions import check
from irtwin.resources import folder, resources_of

ADDED = """# title: How long did each run take?
# bind: robot
SELECT ?robot ?run ?seconds { ?robot irt:has_RunProcess ?process . ?process irt:Run_Name ?run ; irt:Run_Time ?seconds }
ORDER BY ?run
"""


def put(place: Path, name: str, text: str) -> Path:
    file = place / "reports" / name
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(text, encoding="utf-8")
    trust_all(place)
    return file


@pytest.mark.parametrize(
    ("name", "text", "said"),
    [
        ("energy/mine.rq", "SELECT * { ?s ?p ?o }", "line 1: a question begins with `# title: ...`"),
        ("energy/mine.rq", ADDED.replace("SELECT", "SELEC"), r"line 3, column \d+: "),
        ("energy/mine.rq", ADDED.replace("ORDER BY ?run", "\nORDER BY ("), r"line \d, column"),
        ("energy/mine.rq", ADDED.replace("bind: robot", "bind: diagnosis"), "take of robot, twin"),
        ("energy/runs.rq", ADDED, "does not select .*, which the page takes"),
        ("energy/page.html.jinja", "{% block main %}\n{{ 1 + }}", "line 2: "),
        ("energy/page.html.jinja", f"{{{{ {'(' * 3000} }}}}", "is nested too deep; write it flatter"),
        ("weather/mine.rq", ADDED, "there is no report weather; there are energy, gap, layout"),
    ],
)
def test_a_fault_is_said_with_file_and_line(name: str, text: str, said: str, tmp_path: Path) -> None:
    file = put(tmp_path, name, text)
    with pytest.raises(InputError, match=said) as error:
        check(resources_of(tmp_path))
    assert str(error.value).startswith(str(file))


def test_an_added_question_is_answered_on_the_page(graph: KnowledgeGraph, tmp_path: Path) -> None:
    put(tmp_path, "energy/times.rq", ADDED)
    six = six_axis(graph)
    check(resources_of(tmp_path))
    render(graph, six.iri, six.read_series, tmp_path / "page.html", resources=resources_of(tmp_path))
    page = (tmp_path / "page.html").read_text(encoding="utf-8")
    assert "<caption>How long did each run take?</caption>" in page
    assert '<a href="#added">Further questions</a>' in page


def test_a_template_of_a_workspace_is_kept_in_a_sandbox(graph: KnowledgeGraph, tmp_path: Path) -> None:
    shipped = (folder("reports") / "energy" / "page.html.jinja").read_text(encoding="utf-8")
    attack = "{{ ''.__class__.__mro__[1].__subclasses__() }}"
    file = put(tmp_path, "energy/page.html.jinja", shipped.replace("{% block main %}", "{% block main %}" + attack))
    six = six_axis(graph)
    with pytest.raises(InputError, match="unsafe") as error:
        render(graph, six.iri, six.read_series, tmp_path / "page.html", resources=resources_of(tmp_path))
    assert str(error.value).startswith(str(file))
    assert not (tmp_path / "page.html").exists()

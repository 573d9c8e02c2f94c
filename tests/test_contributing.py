"""The worked examples of CONTRIBUTING.md do what it says; `tests/signals` holds those of channels and log formats."""

import re
import shutil
from pathlib import Path

import pytest

from irtwin.effects import load
from irtwin.effects.catalogue import BASELINE
from irtwin.gap.thresholds import DEFAULT
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.report.plant import page
from irtwin.report.questions import ask
from irtwin.twin.identify import identify
from tests.effects.test_known_truth import ROBOT, Case, measured, only

TEXT = (Path(__file__).parents[1] / "CONTRIBUTING.md").read_text(encoding="utf-8")


def code(section: str, language: str) -> str:
    found = re.search(rf"^## {section}.*?```{language}\n(.*?)```", TEXT, flags=re.DOTALL | re.MULTILINE)
    assert found is not None
    return found[1]


def test_the_effect_is_found_again():
    names = dict(vars(load))
    exec(code("Add an effect", "python"), names)
    case = re.search(r"`(Case\(load\.HoseStiffening.*?)`\.$", TEXT, flags=re.MULTILINE)
    assert case is not None
    known = {"Case": Case, "only": only, "J2": ("joint_2",), "load": type("load", (), names)}
    stiffening = eval(case[1], known)
    twin = identify(ROBOT, [measured(stiffening, seed) for seed in range(2)], (*BASELINE, stiffening.effect))
    (k3,) = (one.value for one in twin.parameters if one.effect == "hose_stiffening")
    assert k3 == pytest.approx(stiffening.truth["k3", "joint_2"], rel=stiffening.off)


def test_the_page_shows_its_answers(tmp_path, monkeypatch):
    reports = tmp_path / "reports"
    shutil.copytree(page.FOLDER.parent, reports)
    (reports / "plant" / "idle").mkdir()
    (reports / "plant" / "idle" / "idle.rq").write_text(code("Add a page", "sparql"))
    (reports / "plant" / "idle" / "page.html.jinja").write_text(code("Add a page", "jinja"))
    monkeypatch.setattr(page, "FOLDER", reports / "plant")
    page._templates.cache_clear()
    graph = KnowledgeGraph()
    graph.update("INSERT DATA { <run/r> irt:run_of <robot/Arm_A> ; irt:Run_Time 60.0e0 ; irt:Idle_Share 0.5e0 }")
    answers = ask(graph, page.questions("idle"), {})
    html = page.render("idle/page.html.jinja", answers, {})
    page._templates.cache_clear()
    page.questions.cache_clear()
    assert "Arm_A</a>: 30.0\N{NO-BREAK SPACE}s" in html


def test_the_threshold_is_there_and_its_record_says_the_value():
    name = re.search(r"## Change a threshold.*?Example: `([\w.]+)`", TEXT, flags=re.DOTALL)
    assert name is not None
    (known,) = (one for one in DEFAULT.listed() if one.name == name[1])
    record = Path(__file__).parents[1] / "docs" / known.source
    assert f"{known.value}" in record.read_text(encoding="utf-8") and f"docs/{known.source}" in TEXT
    assert DEFAULT.changed(name[1], 0.12) != DEFAULT

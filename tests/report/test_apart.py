"""Templates of a workspace: one that never ends, or fills the memory, is told and costs nobody else anything."""

from __future__ import annotations

import shutil
import threading
from pathlib import Path

import pytest
from tests.data_sets import done, irtwin, refused
from tests.trusting import trust_all

from irtwin.errors import InputError
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.report import apart
from irtwin.report.templates import written
from irtwin.resources import Resources, resources_of
from irtwin.storage.database import Workspace
from irtwin.storage.turns import rewriting_alone

pytestmark = pytest.mark.slow

ENDLESS = "{% set n = 99999 %}" + "".join(f"{{% for {it} in range(n) %}}" for it in "abc") + "{% endfor %}" * 3


def extended(place: Path, text: str) -> Resources:
    file = place / "reports" / "energy" / "mine.html.jinja"
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(text, encoding="utf-8")
    return resources_of(trust_all(place))


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (ENDLESS, "takes more than 1 s"),
        ("{{ 'a' * 4000000000 }}", "needs more than 1024 MB of memory"),
        ("{% set x = namespace(s='a') %}{% for i in range(99) %}{% set x.s = x.s ~ x.s %}{% endfor %}{{ x.s }}", "MB"),
        ("{{ 1 / 0 }}", "ZeroDivisionError: division by zero"),
        ("{{ range(999999999) | list }}", "OverflowError"),
        ("{{ nothing.at_all }}", "UndefinedError: 'nothing' is undefined"),
        ("{% include 'energy/mine.html.jinja' %}", "RecursionError"),
    ],
)
def test_what_a_template_may_not_do_is_told(
    text: str, said: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    if text is ENDLESS:
        monkeypatch.setattr(apart, "_SECONDS", 1.0)
    with pytest.raises(InputError, match=rf"mine\.html\.jinja: .*{said}.*; see the files that extend reports/"):
        written(extended(tmp_path, text), "energy/mine.html.jinja")


def test_a_bug_of_the_process_keeps_its_traceback(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(apart, "_MEMORY", "none")
    with pytest.raises(Exception, match="non-zero exit status"):
        written(extended(tmp_path, "x"), "energy/mine.html.jinja")


@pytest.fixture
def workspace(small_run: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(small_run, tmp_path, dirs_exist_ok=True)) / "workspace"


def test_a_page_is_made_while_others_write(workspace: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    begun, done = threading.Event(), threading.Event()

    def slow(*_: object) -> dict[str, str]:
        begun.set()
        assert done.wait(60)
        return {"page": "made"}

    monkeypatch.setattr(apart, "_said", slow)
    extended(workspace, "x")
    again = threading.Thread(target=irtwin, args=("run", tmp_path / "data", "--workspace", workspace))
    again.start()
    assert begun.wait(60)
    with (
        Workspace.existing(workspace) as place,
        rewriting_alone(place.engine, place.folder),
        KnowledgeGraph.of_workspace(place) as graph,
    ):
        assert graph.graphs()
    done.set()
    again.join(60)
    assert (workspace / "reports" / "Arm.html").read_text() == "made"


def test_a_template_that_never_ends_leaves_the_workspace_whole(
    workspace: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(apart, "_SECONDS", 1.0)
    before = (workspace / "reports" / "Arm.html").read_bytes()
    file = workspace / "reports" / "energy" / "page.html.jinja"
    file.parent.mkdir()
    file.write_text(ENDLESS)
    trust_all(workspace)
    said = refused("run", tmp_path / "data", "--workspace", workspace)
    assert said.splitlines()[-1].startswith(f"irtwin: {file}: takes more than 1 s")
    assert (workspace / "reports" / "Arm.html").read_bytes() == before
    done("workspace", "status", "--workspace", workspace)

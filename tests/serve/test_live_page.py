"""/live and /live/ROBOT: what they are made of, and in a browser that they follow a log that is played."""

from __future__ import annotations

import shutil
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import httpx
import pytest
from tests.endpoint import Server, serving
from tests.forks import Command
from tests.screens import complaints_of, faults, narrow_and_dark
from tests.waiting import wait_for

from irtwin.knowledge.store.graph import KnowledgeGraph

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def folder(small_run: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return Path(shutil.copytree(small_run, tmp_path_factory.mktemp("live_page"), dirs_exist_ok=True))


@pytest.fixture(scope="module")
def robot(folder: Path) -> Iterator[Server]:
    """A server of a workspace in which a small robot has a twin."""
    with serving(folder / "workspace" / "graph", token=None) as running:
        yield running


@pytest.mark.parametrize("path", ["/live", "/live/Arm"])
def test_pages_take_everything_from_here(robot: Server, path: str) -> None:
    page = robot.get(path)
    assert page.status_code == 200
    assert "default-src 'none'; script-src 'self'" in page.headers["Content-Security-Policy"]
    for asset in ("live.css", "live.js", "live_list.js", "meshcat.js", "robot.js"):
        assert robot.get(f"/assets/{asset}").status_code == 200
        assert "http://" not in page.text and "https://" not in page.text


def test_the_robot_is_made_of_the_graph(robot: Server) -> None:
    said = robot.get("/live/Arm/robot.json").json()
    assert said["name"] == "Arm"
    assert len(said["joints"]) == 2
    assert said["parts"]
    assert len(said["stood"]) == 2
    assert any(said["stood"])  # where a run left it, and not all joints at zero


@pytest.mark.parametrize("name", ["nobody", "a%3E%20b", "..%2F..%2Fetc"])
def test_a_robot_that_is_not_there(robot: Server, name: str) -> None:
    assert robot.get(f"/live/{name}/robot.json").status_code == 404


def test_too_many_pages_are_refused_and_those_that_leave_make_room(robot: Server) -> None:
    with httpx.Client(timeout=30) as client:
        streams = [client.stream("GET", f"{robot.url}/live/Arm/events") for _ in range(17)]
        answers = [stream.__enter__() for stream in streams]
        assert [answer.status_code for answer in answers] == [200] * 16 + [503]
        assert answers[0].headers["Content-Type"].startswith("text/event-stream")
        for stream in streams:
            stream.__exit__(None, None, None)

        def there_is_room() -> bool:
            with client.stream("GET", f"{robot.url}/live/Arm/events") as answer:
                return bool(answer.status_code == 200)

        wait_for(there_is_room)


@pytest.mark.system
def test_the_page_follows_a_log_that_is_played(robot: Server, folder: Path, browser: Any) -> None:
    page = browser.new_page(viewport={"width": 900, "height": 700})
    complaints = complaints_of(page, (robot.url, "data:", "blob:"))
    page.goto(f"{robot.url}/live/Arm")
    wait_for(lambda: page.inner_text("#stream") == "not watched yet")
    log = next((folder / "data").rglob("*.parquet"))
    begun = time.time()
    replay = "--replay", log, "--speed", 0.4  # 20 s: on a busy machine a second page takes a while to open
    live = Command("live", *replay, "--robot", "Arm", "--workspace", folder / "workspace")
    wait_for(lambda: page.evaluate("irtwinLive.drawn") > 3)
    wait_for(lambda: page.inner_text("#stream") == "flowing")
    wait_for(lambda: page.inner_text("#energy") not in ("–", "0.00"))
    assert begun < page.evaluate("irtwinLive.time") < time.time() + 1  # of this replay, however late it is drawn
    begins_with_what_was_missed(robot, browser, page)
    _, said = live.communicate()
    assert "800 samples stored" in said or "801 samples stored" in said, said
    wait_for(lambda: page.inner_text("#stream") == "run ended")
    assert page.evaluate("irtwinLive.states") > 400
    with KnowledgeGraph(folder / "workspace" / "graph", read_only=True) as graph:
        (row,) = graph.query(
            "SELECT (COALESCE(?measured, ?modelled) AS ?energy) { ?run a irt:Replayed_Run "
            "OPTIONAL { ?run irt:Measured_Energy ?measured } OPTIONAL { ?run irt:Modelled_Energy ?modelled } }"
        )
    wait_for(lambda: page.inner_text("#energy") == f"{row['energy'] / 3600:.2f}")
    assert page.locator("#by-joint .bar").count() == 2
    assert page.locator("#by-effect .bar").count() > 2
    wait_for(lambda: page.locator("#gaps .bar").count() == 3)
    for link in ("#robot-page", "#run-page"):
        assert httpx.get(page.eval_on_selector(link, "link => link.href"), timeout=60).status_code == 200
    page.goto(f"{robot.url}/live")
    wait_for(lambda: page.locator("#robots tr").count() == 1)
    assert page.inner_text("#robots a") == "Arm"
    page.click("#robots a")
    wait_for(lambda: page.inner_text("#name") == "Arm")
    wait_for(lambda: page.locator("#by-joint .bar").count() == 2)
    assert faults(page) == []
    assert narrow_and_dark(page) == []
    assert complaints == []


def begins_with_what_was_missed(robot: Server, browser: Any, watching: Any) -> None:
    """Open the page while a log is played, and one is `watching`: its curve begins before the page did."""
    time.sleep(1.0)
    opened = watching.evaluate("irtwinLive.time")  # by the log's clock
    page = browser.new_page()
    page.goto(f"{robot.url}/live/Arm")
    wait_for(lambda: page.evaluate("irtwinLive.states") > 3)
    first, last, low, high = page.evaluate("irtwinLive.shown()")
    assert first < opened - 0.3 < last
    assert low < high
    page.select_option("#span", "30")
    page.close()

"""`irtwin alarms` beside `irtwin live`, as both are called."""

from __future__ import annotations

import json
import os
import signal
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from tests import rows
from tests.data_sets import irtwin, refused
from tests.forks import Command
from tests.trusting import trust_all

from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.storage.database import Workspace

pytestmark = pytest.mark.slow


@pytest.fixture
def workspace(tmp_path: Path) -> Path:
    with Workspace(tmp_path / "w") as place:
        place.ingest(*rows.data_set())
        with KnowledgeGraph(place.graph_folder) as graph:
            graph.load_ontology()
    return tmp_path / "w"


Start = Callable[..., Command]


@pytest.fixture
def start() -> Iterator[Start]:
    made: list[Command] = []

    def started(*arguments: object) -> Command:
        made.append(Command(*arguments))
        return made[-1]

    yield started
    for process in made:
        process.kill()
        process.wait()


def test_a_robot_that_stands_too_long_is_told_once_and_when_it_is_over(workspace: Path, start: Start) -> None:
    (workspace / "alarms.toml").write_text('[[mqtt]]\nhost = "127.0.0.1"\nport = 9\ntopic = "down"\n')
    trust_all(workspace)
    live = start("live", "--workspace", workspace)
    telling = start("alarms", "--follow", "--workspace", workspace)
    for step in range(40):  # at rest for 390 s
        state = {"robot": rows.ROBOT, "time": 1e9 + 10.0 * step, "position": [0.5, 0], "velocity": [0, 0]}
        live.stdin.write(json.dumps(state) + "\n")
    live.stdin.flush()
    raised = json.loads(telling.stdout.readline())
    assert (raised["event"], raised["robot"], raised["rule"]) == ("raised", "KUKA KR6 R700", "idle_alarm")
    assert raised["reason"] == "has been standing still for more than 5 min; can its drives be switched off?"
    assert raised["since"].startswith("2001-09-09T01:46:40") and "irt:Standing_Time" in raised["sparql"]
    listed = irtwin("alarms", "--workspace", workspace)
    assert "standing still" in listed.out and "1 row" in listed.out, listed.err
    live.communicate(timeout=120)  # its stream ends
    cleared = json.loads(telling.stdout.readline())
    assert (cleared["event"], cleared["since"]) == ("cleared", raised["since"])
    os.kill(telling.pid, signal.SIGTERM)
    rest, said = telling.communicate(timeout=120)
    assert (rest, telling.returncode) == ("", 0)
    first, *others = said.splitlines()
    assert first == "Telling alarms to standard output, MQTT broker at 127.0.0.1:9; 0 active now"
    assert others == [
        "MQTT broker at 127.0.0.1:9: it cannot be reached; trying again",
        "MQTT broker at 127.0.0.1:9: 2 messages not delivered: no time was left",
    ]


def test_what_is_wrong_is_said_before_anything_is_made(tmp_path: Path, workspace: Path) -> None:
    for given, message in (
        (["--workspace", tmp_path / "none"], "no workspace here"),
        (["--workspace", tmp_path / "none", "--follow"], "no workspace here"),
        (["--workspace", workspace, "--config", "a.toml"], "--config goes with --follow"),
        (["--workspace", workspace, "--follow", "--config", "a.toml"], "a.toml: cannot be read"),
        (["--workspace", workspace, "--robot", "nobody"], "there is no robot 'nobody'"),
    ):
        assert message in refused("alarms", *given)
    assert not (tmp_path / "none").exists() and not (workspace / "alarms").exists()

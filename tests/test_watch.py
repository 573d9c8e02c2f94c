"""`irtwin live`, `backup` and `restore`, as they are called."""

from __future__ import annotations

import errno
import json
import shutil
import signal
import socket
import threading
import time
from pathlib import Path

import pytest

from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.live.joint_stream import feed
from irtwin.live.opcua import OpcUa
from irtwin.providers.records import ingest
from irtwin.signals.log import DataSet
from irtwin.storage.database import Workspace
from tests import rows
from tests.data_sets import irtwin, refused, refused_in_a_line
from tests.forks import Command
from tests.live.opcua_robot import ServedRobot
from tests.synthetic import arm
from tests.trusting import trust_all

pytestmark = pytest.mark.slow


def lines(count: int) -> str:
    said = [
        {"robot": rows.ROBOT, "time": 1e9 + 0.1 * step, "position": [step, 0], "power": 100} for step in range(count)
    ]
    return "".join(json.dumps(one) + "\n" for one in said)


def fill(folder: Path, database: str | None = None) -> Path:
    with Workspace(folder, database) as place:
        place.ingest(*rows.data_set())
        KnowledgeGraph(place.graph_folder).close()
    return folder


@pytest.fixture
def workspace(tmp_path: Path) -> Path:
    return fill(tmp_path / "w")


@pytest.mark.parametrize("on_server", [False, pytest.param(True, marks=pytest.mark.nightly)])
def test_a_stream_on_standard_input_ends_by_itself_and_is_kept(
    on_server: bool, tmp_path: Path, request: pytest.FixtureRequest
) -> None:
    new = request.getfixturevalue("new_postgresql_database") if on_server else None
    database, other = (["--database", new()] if new else [] for _ in range(2))
    workspace = fill(tmp_path / "w", *database[1:])
    _, said = Command("live", "--workspace", workspace, *database).communicate(lines(50) + "junk\njunk\n", timeout=120)
    assert said.count("line refused: a line is not JSON") == 1
    assert "50 samples stored, 2 lines refused" in said
    archive = tmp_path / "kept.zip"
    kept = irtwin("workspace", "backup", archive, "--workspace", workspace, *database)
    assert (kept.out.strip(), kept.err) == (str(archive), "")
    after = tmp_path / "after"
    irtwin("workspace", "restore", archive, "--workspace", after, *other)
    question = "SELECT (series:integral(?run, 'power', 0, 9) AS ?joules) { ?run irt:State_Time ?at }"
    for folder in (workspace, after):
        asked = irtwin("query", question, "--format", "json", "--workspace", folder)
        assert json.loads(asked.out) == [{"joules": pytest.approx(490.0)}], asked.err
    again = irtwin("workspace", "restore", archive, "--workspace", after, *other)
    assert "already exists" in again.err
    assert again.status == 2


def test_a_signal_ends_the_watching_and_nothing_is_lost(workspace: Path) -> None:
    process = Command("live", "--port", "0", "--workspace", workspace)
    address = process.stderr.readline().split()[-1]
    host, port = address.split(":")
    with socket.create_connection((host, int(port))) as client:
        client.sendall(lines(30).encode() + b"end\n")
        assert "refused" in process.stderr.readline()  # all before it was taken
        process.send_signal(signal.SIGTERM)
        _, said = process.communicate(timeout=120)
    assert process.returncode == 0
    assert "30 samples stored" in said
    assert not list((workspace / "live").iterdir())


def test_a_fault_in_a_report_of_the_workspace_is_told_before_a_sample_is_read(workspace: Path) -> None:
    template = workspace / "reports" / "energy" / "page.html.jinja"
    template.parent.mkdir(parents=True)
    template.write_text("{% if %}", encoding="utf-8")
    trust_all(workspace)
    assert f"{template}, line 1: " in refused_in_a_line("live", "--workspace", workspace)


def test_a_file_in_place_of_a_workspaces_folder_is_told(workspace: Path) -> None:
    shutil.rmtree(workspace / "live", ignore_errors=True)
    (workspace / "live").touch()
    assert refused("live", "--workspace", workspace).splitlines()[-1] == (
        f"irtwin: {workspace}/live: File exists; a file is where a folder has to be, or a folder in place of a file; "
        "move it away"
    )


def test_a_workspace_that_is_not_there(tmp_path: Path) -> None:
    for command in (["live"], ["workspace", "backup", tmp_path / "a.zip"]):
        assert "no workspace here" in refused_in_a_line(*command, "--workspace", tmp_path / "none")
    assert not list(tmp_path.iterdir())


@pytest.mark.nightly
def test_a_robot_is_followed_by_opc_ua(tmp_path: Path) -> None:
    with Workspace(tmp_path / "w") as there:
        ingest(there, DataSet(tmp_path, arm(6), (), None, None, "dc_bus", False, {}))
        KnowledgeGraph(there.graph_folder).close()
    served = ServedRobot()
    served.start()
    process = Command("live", "--opcua", served.address, "--robot", arm(6).name, "--workspace", tmp_path / "w")
    assert f"Following {served.address}: position (deg)" in process.stderr.readline()
    time.sleep(1.0)
    process.send_signal(signal.SIGINT)
    _, said = process.communicate(timeout=120)
    served.stop()
    assert process.returncode == 0, said
    assert int(said.partition(" samples stored")[0].rpartition("\n")[2]) > 20


def test_a_full_disk_ends_what_follows_a_server_and_is_no_lost_connection() -> None:
    def full(_: object) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    served, said = ServedRobot(), list[str]()
    served.start()
    try:
        followed = OpcUa(served.address, arm(6), "arm")
        with pytest.raises(OSError, match="No space left"):
            feed(followed.states(threading.Event(), said.append), full, print)
    finally:
        served.stop()
    assert not any("lost" in line for line in said)


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--robot", "arm"], "--robot goes with --replay or --opcua"),
        (["--speed", "2"], "--speed is for --replay"),
        (["--nodes", "n.toml"], "--nodes is for --opcua"),
        (["--performs", "reach"], "--performs goes with --robot; lines of a stream say it by themselves"),
        (["--replay", "log.csv"], "--robot goes with --replay or --opcua"),
        (["--replay", "log.csv", "--robot", "arm", "--port", "0"], "Give one of --port, --replay and --opcua"),
        (["--replay", "log.csv", "--robot", "arm", "--speed", "0"], "0.01<=x<=1000.0"),
    ],
)
def test_options_that_do_not_go_together(tmp_path: Path, options: list[str], said: str) -> None:
    assert said in refused("live", "--workspace", tmp_path / "w", *options)
    assert not list(tmp_path.iterdir())


def test_a_log_of_a_robot_that_is_not_there(workspace: Path) -> None:
    replay = ("--replay", "log.csv", "--robot", "nobody")
    assert 'no robot "nobody" here' in refused_in_a_line("live", "--workspace", workspace, *replay)
    assert not list((workspace / "live").iterdir())

"""Series on an S3 server: keys, a server that goes away, two workers at once, and a run from end to end."""

from __future__ import annotations

import json
import math
import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from tests import rows, small_robots, test_plans
from tests.data_sets import irtwin as in_this_process
from tests.memory_s3 import forget
from tests.s3_server import KEYS, checking_keys, s3_server
from tests.sparql_servers import Running
from tests.storage.test_database import WORK, populate, state

from irtwin import workflow
from irtwin.errors import InputError
from irtwin.fleet.fleet import batches_of
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.knowledge.vocabulary import shorten
from irtwin.live.joint_stream import State
from irtwin.live.live_twin import LiveTwin
from irtwin.storage import object_storage
from irtwin.storage.database import Workspace
from irtwin.storage.object_storage import ObjectStorage
from irtwin.storage.schema import Series
from irtwin.storage.staging import staged
from irtwin.storage.windows import open_series

pytestmark = [pytest.mark.system, pytest.mark.slow]

URL = "s3://plant/Halle 1/Röbots a+b #1 %20"
WORKER = """
import sys
from pathlib import Path
from irtwin.storage.database import Workspace
from irtwin.storage.staging import staged
from tests import rows

with Workspace.existing(Path(sys.argv[1])) as place:
    for count in range(2):
        with staged(place, "other") as apart:
            apart.ingest(rows.robot(robot_id="other", name="other"), [], [rows.run(f"w{count}", robot_id="other")],
                         {f"{rows.ROBOT}.w{count}": rows.samples(count + 50)})
"""


@pytest.fixture(scope="module")
def server() -> Iterator[Running]:
    with s3_server() as running:
        yield running


@pytest.fixture
def bucket(server: Running, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Iterator[str]:
    """A new prefix on the server, which this process has keys of."""
    for name, value in {**KEYS, "AWS_ENDPOINT_URL": server.url, "AWS_MAX_ATTEMPTS": "1"}.items():
        monkeypatch.setenv(name, value)
    object_storage._filesystem.cache_clear()
    forget()
    files = object_storage._filesystem()
    if not files.exists("plant"):
        files.mkdir("plant")
    yield f"{URL}/{tmp_path.name}"
    object_storage._filesystem.cache_clear()
    files.clear_instance_cache()
    forget()


def named(place: Workspace) -> set[str]:
    with place.reading() as session:
        return {row.path for row in session.query(Series)}


def test_series_are_written_and_read(bucket: str, tmp_path: Path) -> None:
    with Workspace(tmp_path / "wörk shop", series_url=bucket) as place:
        with staged(place, rows.ROBOT) as apart:
            populate(apart)
        assert ObjectStorage(bucket).paths("series") == named(place)
        assert place.read_series(WORK).equals(rows.samples(1))
        path = max(named(place))
        assert open_series(place.folder, path).mean("power", 0.0, 1.0) == pytest.approx(100.5)
        place.drop_robot(rows.ROBOT)
        assert ObjectStorage(bucket).paths("series") == set()


@pytest.mark.nightly
def test_two_workers_write_at_once(bucket: str, tmp_path: Path) -> None:
    with Workspace(tmp_path, series_url=bucket) as place:
        worker = subprocess.Popen([sys.executable, "-c", WORKER, str(tmp_path)])
        for _ in range(2):
            with staged(place, rows.ROBOT) as apart:
                populate(apart)
            with staged(place, rows.ROBOT) as apart:
                apart.ingest(*rows.data_set()[:2], [], {})
        assert worker.wait(60) == 0
        assert ObjectStorage(bucket).paths("series") == named(place) != set()


def test_a_bucket_that_is_not_there_makes_no_workspace(bucket: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"s3://nowhere/at/all: there is no such bucket"):
        Workspace(tmp_path / "workspace", series_url="s3://nowhere/at/all")
    assert not (tmp_path / "workspace").exists()


@pytest.mark.nightly
def test_a_run_from_end_to_end(bucket: str, tmp_path: Path) -> None:
    def irtwin(*arguments: str | Path, status: int = 0) -> str:
        command = [sys.executable, "-m", "irtwin", *map(str, arguments), "--workspace", str(tmp_path / "wörk shop")]
        done = subprocess.run(command, capture_output=True, text=True, env=os.environ)
        assert done.returncode == status, done.stderr
        said.append(done.stdout + done.stderr)
        return done.stdout

    said: list[str] = []
    data_set = small_robots.data_set(tmp_path / "dätä set", "Röbot 1")
    irtwin("run", data_set, "--series", bucket)
    assert not (tmp_path / "wörk shop" / "series").exists()
    assert f"series      {bucket}" in irtwin("workspace", "status")
    asked = 'SELECT ?run (series:mean(?run, "power", 0, 8) AS ?mean) { ?run a irt:Measured_Run }'
    found = json.loads(irtwin("query", asked, "--format", "json"))
    assert len(found) == 3
    explained = f"{shorten(found[0]['run'])} irt:Energy_Consumption"
    assert f"whole: {bucket}/series/" in irtwin("explain", explained, "--verify")
    storage = ObjectStorage(bucket)
    for path in storage.paths("series"):
        storage.put({path: data_set / "dataset.toml"})
    assert f"changed: {bucket}/series/" in irtwin("explain", explained, "--verify", status=2)
    assert KEYS["AWS_SECRET_ACCESS_KEY"] not in "".join(said)
    for file in (tmp_path / "wörk shop").rglob("*"):
        if file.is_file():
            assert KEYS["AWS_SECRET_ACCESS_KEY"].encode() not in file.read_bytes()


def test_a_run_that_is_watched_goes_there(bucket: str, tmp_path: Path, server: Running) -> None:
    with Workspace(tmp_path, series_url=bucket) as place, KnowledgeGraph.of_workspace(place) as graph:
        populate(place)
        before = ObjectStorage(bucket).paths("series")
        with LiveTwin(place, graph) as twin:
            for step in range(20):
                twin.receive(State(rows.ROBOT, 1e9 + 0.1 * step, ((step, 0), *[(math.nan, math.nan)] * 3, (100.0,))))
        assert len(ObjectStorage(bucket).paths("series") - before) == 1
        (mean,) = graph.query("SELECT (series:mean(?run, 'power', 0, 1) AS ?watts) { ?run a irt:Live_Run }")
        assert mean["watts"] == pytest.approx(100.0)
    with checking_keys(server):
        refused = in_this_process("live", "--workspace", tmp_path)
    assert (refused.status, refused.out) == (2, "")
    assert "the server refuses these keys" in refused.err


@pytest.mark.nightly
def test_plans_and_better_twins_go_there(bucket: str, tmp_path: Path) -> None:
    workspace, reach = tmp_path / "w", tmp_path / "reach.parquet"
    workflow.run(test_plans.write(tmp_path / "logs", test_plans.recorded()), workspace, series_url=bucket)
    before = ObjectStorage(bucket).paths("series")
    planned = in_this_process("plan", "arm_2", *test_plans.GOAL, "--workspace", workspace, "--out", reach)
    assert planned.status == 0, planned.err
    assert len(ObjectStorage(bucket).paths("series") - before) == 2  # as planned and as modelled
    done = test_plans.write(tmp_path / "done", [test_plans.carried_out(reach)]) / "runs" / "done.parquet"
    improved = in_this_process("improve", "arm_2", done, "--workspace", workspace)
    assert improved.status == 0, improved.err
    with Workspace.existing(workspace) as place:
        assert ObjectStorage(bucket).paths("series") == named(place)
        assert place.read_series("arm_2.done").num_rows > 0


def test_keys_that_the_server_does_not_know(bucket: str, tmp_path: Path, server: Running) -> None:
    with Workspace(tmp_path, series_url=bucket) as place:
        populate(place)
        before = state(place)
        with checking_keys(server):
            with pytest.raises(InputError, match="the server refuses these keys") as refused:
                place.read_series(WORK)
            assert KEYS["AWS_ACCESS_KEY_ID"] not in str(refused.value)
            with pytest.raises(InputError, match="the server refuses these keys"), staged(place, rows.ROBOT):
                pass
        assert state(place) == before


@pytest.mark.nightly
def test_a_server_that_dies_in_the_middle_changes_nothing(bucket: str, tmp_path: Path) -> None:
    with s3_server() as dying, pytest.MonkeyPatch.context() as changed:
        changed.setenv("AWS_ENDPOINT_URL", dying.url)
        object_storage._filesystem.cache_clear()
        object_storage._filesystem().clear_instance_cache()
        object_storage._filesystem.cache_clear()
        forget()
        object_storage._filesystem().mkdir("plant")
        with Workspace(tmp_path, series_url=bucket) as place:
            before = state(place)
            with pytest.raises(InputError, match="the server cannot be reached"):  # noqa: SIM117
                with staged(place, rows.ROBOT) as apart:
                    populate(apart)
                    dying.stop()
            assert state(place) == before


@pytest.mark.nightly
def test_a_fleet_keeps_its_series_there(bucket: str, tmp_path: Path) -> None:
    robots, out = tmp_path / "robots", tmp_path / "out"
    asked = ("run", robots, "--out", out, "--workers", "1")
    for seed, (name, said_once) in enumerate({"A": ("--series", bucket), "B": ()}.items()):
        small_robots.data_set(robots / name, f"Arm {name}", seed=10 * seed)
        done = in_this_process(*asked, *said_once)
        assert done.out == f"done     {seed + 1}\n", done.err
    batches = batches_of(out)
    assert len({batch.series_url for batch in batches}) == 2
    for batch in batches:
        assert str(batch.series_url).startswith(f"{bucket}/batch_")
        with Workspace.existing(batch.folder / "workspace") as place:
            assert ObjectStorage(str(batch.series_url)).paths("series") == named(place) != set()
            assert not list((place.folder / "series").glob("*.parquet"))
    other = in_this_process(*asked, "--series", f"{bucket}/other")
    assert other.status == 2 and f"the series of this fleet are in {bucket}; leave --series away" in other.err

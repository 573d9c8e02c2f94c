"""A process killed in mid-write, and two that write at once."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest
from tests import rows
from tests.storage.test_database import populate, state

from irtwin.storage.database import Workspace

pytestmark = pytest.mark.slow

# Each kills the process at one step of taking in a changed data set.
KILLED = """
import os, signal, sys
from pathlib import Path
sys.path.insert(0, {tests!r})
from tests import rows
from sqlalchemy import event
from irtwin.storage import database, files
from irtwin.storage.database import Workspace

def kill(*_):
    os.kill(os.getpid(), signal.SIGKILL)

point = {point!r}
workspace = Workspace(Path({folder!r}), {url!r})
if point == "first file":
    files.put_in_place = kill
elif point == "second file":
    put, calls = files.put_in_place, []
    def second(*arguments):
        calls.append(1)
        kill() if len(calls) == 2 else put(*arguments)
    files.put_in_place = second
elif point == "rows dropped":
    database.insert_rows = kill
elif point == "rows written":
    event.listen(workspace.engine, "commit", kill)
elif point == "committed":
    Workspace.remove_orphans = kill
robot, joints, runs, series = rows.data_set()
for number, run in enumerate(runs):
    run.sha256 = "4" * 64
    series[run.run_id] = rows.samples(20 + number)
workspace.ingest(robot, joints, runs, series)
"""

TAKEN_IN = """
import sys
from pathlib import Path
sys.path.insert(0, {tests!r})
from tests import rows
from irtwin.storage.database import Workspace
for number in range(5):
    robot, joints, runs, series = rows.data_set()
    runs[0].sha256 = {digit!r} * 64
    series[runs[0].run_id] = rows.samples(number + int({digit!r}))
    Workspace(Path({folder!r}), {url!r}).ingest(robot, joints, runs, series)
"""


def python(script: str, **values: object) -> subprocess.Popen[str]:
    code = script.format(tests=str(Path(rows.__file__).parents[1]), **values)
    return subprocess.Popen([sys.executable, "-c", code], stderr=subprocess.PIPE, text=True)


@pytest.fixture(params=["sqlite", pytest.param("postgresql", marks=pytest.mark.system)])
def url(request: pytest.FixtureRequest) -> str | None:
    return None if request.param == "sqlite" else request.getfixturevalue("new_postgresql_database")()


@pytest.mark.parametrize("point", ["first file", "second file", "rows dropped", "rows written"])
def test_a_kill_leaves_the_earlier_state(tmp_path: Path, url: str | None, point: str) -> None:
    with Workspace(tmp_path, url) as workspace:
        populate(workspace)
        before = state(workspace)
    assert python(KILLED, point=point, folder=str(tmp_path), url=url).wait(60) == -9
    with Workspace(tmp_path, url) as workspace:
        workspace.remove_orphans()
        assert state(workspace) == before
        assert workspace.ingest(*rows.data_set()) == "unchanged"


def test_a_kill_after_the_commit_leaves_the_new_state(tmp_path: Path, url: str | None) -> None:
    with Workspace(tmp_path, url) as workspace:
        populate(workspace)
    assert python(KILLED, point="committed", folder=str(tmp_path), url=url).wait(60) == -9
    with Workspace(tmp_path, url) as workspace:
        assert workspace.read_series(f"{rows.ROBOT}.work").equals(rows.samples(21))
        assert len(list((tmp_path / "series").iterdir())) == 5  # with two measured and one modelled from before
        workspace.remove_orphans()
        assert len(list((tmp_path / "series").iterdir())) == 2


def test_two_writers_at_once(tmp_path: Path, url: str | None) -> None:
    """Even where both make the workspace: one waits for the other, and a whole data set is there at the end."""
    both = [python(TAKEN_IN, folder=str(tmp_path), url=url, digit=digit) for digit in ("5", "6")]
    for process in both:
        _, errors = process.communicate(timeout=120)
        assert process.returncode == 0, errors
    with Workspace(tmp_path, url) as workspace:
        found = state(workspace)
        assert len(found["run"]) == len(found["series"]) == len(found["series files"]) == 2  # type: ignore[arg-type]
        for name in ("again", "work"):
            assert workspace.read_series(f"{rows.ROBOT}.{name}").num_rows == 5

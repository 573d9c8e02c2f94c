"""A process killed in mid-write, and two that write at once."""

from __future__ import annotations

from pathlib import Path

import pytest
from tests import rows
from tests.forks import FORKS
from tests.killed_writers import ingest_five_times, killed_while_ingesting
from tests.storage.test_database import populate, state

from irtwin.storage.database import Workspace

pytestmark = pytest.mark.slow


def killed_at(point: str, folder: Path, url: str | None) -> bool:
    process = FORKS.Process(target=killed_while_ingesting, args=(point, folder, url))
    process.start()
    process.join(60)
    return process.exitcode == -9


@pytest.mark.parametrize("point", ["first file", "second file", "rows dropped", "rows written"])
def test_a_kill_leaves_the_earlier_state(tmp_path: Path, database_url: str | None, point: str) -> None:
    with Workspace(tmp_path, database_url) as workspace:
        populate(workspace)
        before = state(workspace)
    assert killed_at(point, tmp_path, database_url)
    with Workspace(tmp_path, database_url) as workspace:
        workspace.remove_orphans()
        assert state(workspace) == before
        assert workspace.ingest(*rows.data_set()) == "unchanged"


def test_a_kill_after_the_commit_leaves_the_new_state(tmp_path: Path, database_url: str | None) -> None:
    with Workspace(tmp_path, database_url) as workspace:
        populate(workspace)
    assert killed_at("committed", tmp_path, database_url)
    with Workspace(tmp_path, database_url) as workspace:
        assert workspace.read_series(f"{rows.ROBOT}.work").equals(rows.samples(21))
        assert len(list((tmp_path / "series").iterdir())) == 5  # with two measured and one modelled from before
        workspace.remove_orphans()
        assert len(list((tmp_path / "series").iterdir())) == 2


def test_two_writers_at_once(tmp_path: Path, database_url: str | None) -> None:
    """Even where both make the workspace: one waits for the other, and a whole data set is there at the end."""
    both = [FORKS.Process(target=ingest_five_times, args=(digit, tmp_path, database_url)) for digit in (5, 6)]
    for process in both:
        process.start()
    for process in both:
        process.join(120)
        assert process.exitcode == 0
    with Workspace(tmp_path, database_url) as workspace:
        found = state(workspace)
        assert len(found["run"]) == len(found["series"]) == len(found["series files"]) == 2  # type: ignore[arg-type]
        for name in ("again", "work"):
            assert workspace.read_series(f"{rows.ROBOT}.{name}").num_rows == 5

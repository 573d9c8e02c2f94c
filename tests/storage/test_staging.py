"""A robot worked on apart: all of it takes its place at once, or nothing does."""

from __future__ import annotations

import signal
from pathlib import Path

import pytest
from tests import killed_writers, rows
from tests.forks import FORKS
from tests.storage.test_database import WORK, another_robot, populate, state, workspace

from irtwin.errors import InputError
from irtwin.storage.database import Workspace
from irtwin.storage.rows import values
from irtwin.storage.schema import LIVE, LIVE_RUN, PLANNED_RUN
from irtwin.storage.staging import staged

pytestmark = pytest.mark.slow

__all__ = ["workspace"]


def test_what_is_made_apart_takes_its_place(workspace: Workspace) -> None:
    with staged(workspace, rows.ROBOT) as apart:
        populate(apart)
        assert not state(workspace)["robot"]
        made = state(apart)
    assert state(workspace) == made
    assert workspace.read_series(WORK).equals(rows.samples(1))
    assert not list(workspace.folder.glob(".staged-*"))


def test_what_was_there_is_worked_on_apart(workspace: Workspace) -> None:
    populate(workspace)
    before = state(workspace)
    with staged(workspace, rows.ROBOT) as apart:
        assert state(apart) == before
        assert apart.ingest(*rows.data_set()) == "unchanged"
    assert state(workspace) == before


@pytest.mark.parametrize("failure", [InputError("dead channel"), ZeroDivisionError("a bug")])
def test_a_failure_leaves_the_earlier_state(workspace: Workspace, failure: Exception) -> None:
    populate(workspace)
    before = state(workspace)
    robot, joints, runs, series = rows.data_set()
    with pytest.raises(type(failure), match=str(failure)), staged(workspace, rows.ROBOT) as apart:
        assert apart.ingest(robot, joints[:1], runs, series) == "replaced"
        raise failure
    assert state(workspace) == before
    assert not list(workspace.folder.glob(".staged-*"))


def test_a_message_names_the_workspace_not_the_place_apart(workspace: Workspace) -> None:
    with pytest.raises(InputError) as raised, staged(workspace, rows.ROBOT) as apart:
        apart.read_document("twins/none.json", "0")
    assert str(raised.value).startswith(f"{workspace.folder}/twins/none.json")


def test_other_robots_and_live_runs_stay(workspace: Workspace) -> None:
    populate(workspace)
    workspace.ingest(*another_robot())
    live = rows.run("live_1", kind=LIVE_RUN, role=None)
    workspace.keep_run(live, rows.samples(8), {"activity": [values(rows.activity("live.1", LIVE, "run"))]})
    robot, joints, runs, series = rows.data_set()
    with staged(workspace, rows.ROBOT) as apart:
        assert apart.ingest(robot, joints[:1], runs, series) == "replaced"
    assert workspace.read_series(f"{rows.ROBOT}.live_1").equals(rows.samples(8))
    assert workspace.read_series("Other.alone").equals(rows.samples(4))
    assert len(state(workspace)["joint"]) == 1  # type: ignore[arg-type]


def test_what_a_twin_says_of_a_live_run_goes_with_the_twin_alone(workspace: Workspace) -> None:
    populate(workspace)
    live = rows.run("live_1", kind=LIVE_RUN, role=None)
    workspace.keep_run(live, rows.samples(8), {"activity": [values(rows.activity("live.1", LIVE, "run"))]})
    (energy,) = rows.run_energy(f"{rows.ROBOT}.t1")
    energy.run_id = live.run_id
    workspace.replace_activity(
        rows.activity("energy.live", "energy", "live run"), [], [energy], {live.run_id: rows.samples(9)}
    )
    before = state(workspace)
    with staged(workspace, rows.ROBOT) as apart:
        apart.keep_run(rows.run("plan", kind=PLANNED_RUN, role=None), rows.samples(3))
    kept = state(workspace)
    assert (kept["run_energy"], len(kept["run"])) == (before["run_energy"], len(before["run"]) + 1)
    assert workspace.read_series(live.run_id, "modelled").equals(rows.samples(9))
    robot, joints, runs, series = rows.data_set()
    with staged(workspace, rows.ROBOT) as apart:
        apart.ingest(robot, joints[:1], runs, series)
    assert not state(workspace)["run_energy"]
    assert workspace.read_series(live.run_id).equals(rows.samples(8))


@pytest.mark.parametrize("damage", [Path.unlink, lambda file: file.write_bytes(b"PAR1")])
def test_a_damaged_series_is_set_right_by_its_data_set(workspace: Workspace, damage) -> None:
    populate(workspace)
    for file in (workspace.folder / "series").iterdir():
        damage(file)
    with staged(workspace, rows.ROBOT) as apart:
        assert apart.ingest(*rows.data_set()) == "replaced"
    assert workspace.read_series(WORK).equals(rows.samples(1))


@pytest.mark.parametrize("point", ["apart", "_link", "insert_values"])
def test_a_kill_leaves_the_earlier_state(tmp_path: Path, point: str) -> None:
    with Workspace(tmp_path) as place:
        place.ingest(*rows.data_set())
        before = state(place)
    process = FORKS.Process(target=killed_writers.killed_apart, args=(tmp_path, point))
    process.start()
    process.join()
    assert process.exitcode == -signal.SIGKILL
    with Workspace(tmp_path) as place:
        assert list(tmp_path.glob(".staged-*"))
        with staged(place, rows.ROBOT) as apart:
            assert apart.ingest(*rows.data_set()) == "unchanged"
        place.remove_orphans()
        assert state(place) == before
    assert not list(tmp_path.glob(".staged-*"))

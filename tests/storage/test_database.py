from __future__ import annotations

from collections.abc import Iterator
from datetime import datetime, timedelta, timezone
from pathlib import Path

import pytest
from sqlalchemy import inspect, select, text
from sqlalchemy.exc import IntegrityError
from tests import rows

from irtwin.errors import InputError
from irtwin.storage.database import Workspace, in_memory
from irtwin.storage.schema import Activity, ActivityUse, Base, JointRow, RunEnergy, RunRow, RunState, Series, TwinRow

WORK = f"{rows.ROBOT}.work"
TWIN, OTHER = f"{rows.ROBOT}.t1", f"{rows.ROBOT}.t2"


@pytest.fixture
def workspace(database_url: str | None, tmp_path: Path) -> Iterator[Workspace]:
    with Workspace(tmp_path / "workspace", database_url) as opened:
        yield opened


def state(workspace: Workspace) -> dict[str, object]:
    """All rows and all files."""
    with workspace.reading() as session:
        found: dict[str, object] = {
            table.name: sorted(map(tuple, session.execute(select(table))), key=str)
            for table in Base.metadata.sorted_tables
        }
    for name in ("series", "twins"):
        folder = workspace.folder / name
        found[f"{name} files"] = {file.name: file.read_bytes() for file in folder.iterdir()} if folder.is_dir() else {}
    return found


def populate(workspace: Workspace) -> None:
    workspace.ingest(*rows.data_set())
    workspace.replace_activity(rows.activity("state.1", "run_state", "run"), ["series"], rows.run_state())
    rows.identify(workspace, TWIN, ["runs"])
    workspace.replace_activity(
        rows.activity("energy.1", "energy"), ["twin"], rows.run_energy(TWIN), series={WORK: rows.samples(9)}
    )


def another_robot() -> rows.DataSet:
    """Return the rows and series of a robot with one run."""
    run = rows.run("alone", run_id="Other.alone", robot_id="Other")
    return rows.robot(robot_id="Other"), [], [run], {run.run_id: rows.samples(4)}


def test_a_data_set_is_taken_in(workspace: Workspace) -> None:
    assert workspace.ingest(*rows.data_set()) == "new"
    assert workspace.read_series(WORK).equals(rows.samples(1))
    assert workspace.read_series(WORK, columns=["power"]).column_names == ["power"]
    (stored,) = workspace.all(select(Series).where(Series.run_id == WORK))
    assert workspace.read_file(stored.path, stored.series_id).equals(rows.samples(1))
    assert workspace.row(RunRow, f"{rows.ROBOT}.again").repeat_of == WORK


def test_the_same_data_set_changes_nothing(workspace: Workspace) -> None:
    populate(workspace)
    before = state(workspace)
    assert workspace.ingest(*rows.data_set()) == "unchanged"
    assert state(workspace) == before


def test_the_time_of_taking_in_is_no_change(workspace: Workspace) -> None:
    _, _, runs, series = rows.data_set()
    for moment in (rows.NOON, rows.NOON + timedelta(days=1)):
        runs = [rows.run(run.name, start_time=moment, start_time_from="ingest") for run in runs]
        outcome = workspace.ingest(rows.robot(), rows.joints(), runs, series)
    assert outcome == "unchanged"


@pytest.mark.parametrize("change", ["robot", "checksum", "joint", "run"])
def test_a_changed_data_set_replaces_all_that_was_derived(workspace: Workspace, change: str) -> None:
    populate(workspace)
    robot, joints, runs, series = rows.data_set()
    if change == "robot":
        robot.weight_kg = 51.0
    elif change == "checksum":
        runs[1].sha256 = "3" * 64
        series[WORK] = rows.samples(7)
    elif change == "joint":
        joints[0].gear_ratio = 101.0
    else:
        runs, series = [runs[1]], {WORK: series[WORK]}
    assert workspace.ingest(robot, joints, runs, series) == "replaced"
    found = state(workspace)
    derived = ("activity", "activity_use", "run_state", "twin", "run_energy", "twins files")
    assert not any(found[table] for table in derived)
    assert len(found["run"]) == len(runs)  # type: ignore[arg-type]
    assert workspace.read_series(WORK).equals(series[WORK])


def test_another_robot_is_left_alone(workspace: Workspace) -> None:
    populate(workspace)
    assert workspace.ingest(*another_robot()) == "new"
    workspace.drop_robot(rows.ROBOT)
    assert workspace.all(select(RunRow.run_id)) == ["Other.alone"]
    assert workspace.read_series("Other.alone").num_rows == 5
    assert len(list((workspace.folder / "series").iterdir())) == 1


def test_lost_series_are_taken_in_again(workspace: Workspace) -> None:
    workspace.ingest(*rows.data_set())
    for file in (workspace.folder / "series").iterdir():
        file.unlink()
    with pytest.raises(InputError, match="the series is missing"):
        workspace.read_series(WORK)
    assert workspace.ingest(*rows.data_set()) == "replaced"
    assert workspace.read_series(WORK).equals(rows.samples(1))


def test_a_provider_replaces_what_it_made_of_the_same_subject(workspace: Workspace) -> None:
    populate(workspace)
    workspace.replace_activity(rows.activity("state.2", "run_state", "run"), [], rows.run_state())
    workspace.replace_activity(rows.activity("state.3", "other", "run"), ["a", "a"], [])
    assert workspace.all(select(RunState.activity_id)) == ["state.2"]
    assert workspace.all(select(ActivityUse.entity).where(ActivityUse.activity_id == "state.3")) == ["a"]
    assert set(workspace.all(select(Activity.activity_id))) == {"state.2", "state.3", "twin.1", "energy.1"}


def test_a_run_is_dropped_alone(workspace: Workspace) -> None:
    populate(workspace)
    again = f"{rows.ROBOT}.again"
    workspace.replace_activity(rows.activity("state.5", "other", f"run/{again}"), ["series"], [])
    workspace.drop_run(again, f"run/{again}")
    with workspace.reading() as session:
        assert session.scalars(select(RunRow.run_id)).all() == [WORK]
        assert set(session.scalars(select(Series.run_id))) == {WORK}
        assert session.get(Activity, "state.5") is None


def test_what_an_activity_read_is_named_below_the_base_and_a_run_informed_it(workspace: Workspace) -> None:
    populate(workspace)
    elsewhere = "https://other.example/run/1"
    read = [f"{workspace.base}run/{WORK}", f"{workspace.base}twin/t", elsewhere]
    workspace.replace_activity(rows.activity("state.4", "other", "run"), read, [])
    with workspace.reading() as session:
        uses = select(ActivityUse.entity, ActivityUse.relation).where(ActivityUse.activity_id == "state.4")
        found = dict(map(tuple, session.execute(uses)))
    assert found == {f"run/{WORK}": "wasInformedBy", "twin/t": "used", elsewhere: "used"}


def test_what_was_derived_from_an_earlier_twin_goes_with_it(workspace: Workspace) -> None:
    populate(workspace)
    assert workspace.read_series(WORK, "modelled").equals(rows.samples(9))
    rows.identify(workspace, OTHER, name="twin.2")
    assert workspace.all(select(TwinRow.twin_id)) == [OTHER]
    assert workspace.all(select(RunEnergy)) == []
    assert set(workspace.all(select(Series.kind))) == {"measured"}
    assert set(workspace.all(select(Activity.activity_id))) == {"state.1", "twin.2"}
    assert [file.name for file in (workspace.folder / "twins").iterdir()] == [f"{OTHER}.json"]
    assert len(list((workspace.folder / "series").iterdir())) == 2


def test_a_failing_replacement_leaves_the_earlier_state(workspace: Workspace) -> None:
    populate(workspace)
    before = state(workspace)
    with pytest.raises(IntegrityError):
        workspace.replace_activity(
            rows.activity("energy.2", "energy"), [], rows.run_energy("no such twin"), series={WORK: rows.samples(3)}
        )
    workspace.remove_orphans()
    assert state(workspace) == before


def test_a_document_stays_inside_the_workspace(workspace: Workspace) -> None:
    workspace.ingest(*rows.data_set())
    with pytest.raises(InputError, match="leads outside the workspace"):
        workspace.replace_activity(rows.activity("a", "p"), [], [], documents={"../escaped.json": b""})
    assert not (workspace.folder.parent / "escaped.json").exists()


def test_times_come_back_in_utc(workspace: Workspace) -> None:
    eastern = timezone(timedelta(hours=-5))
    run = rows.run("work", start_time=datetime(2026, 1, 2, 23, 30, tzinfo=eastern))
    assert workspace.ingest(rows.robot(), [], [run], {WORK: rows.samples(1)}) == "new"
    found = workspace.row(RunRow, WORK).start_time
    assert found.isoformat() == "2026-01-03T04:30:00+00:00"
    assert workspace.ingest(rows.robot(), [], [run], {WORK: rows.samples(1)}) == "unchanged"


def test_a_run_without_series_is_a_programming_error(workspace: Workspace) -> None:
    robot, joints, runs, _ = rows.data_set()
    with pytest.raises(ValueError, match="runs and series differ"):
        workspace.ingest(robot, joints, runs, {})


def test_a_run_that_is_not_there(workspace: Workspace) -> None:
    with pytest.raises(InputError, match="run none has no measured series"):
        workspace.read_series("none")


def test_a_workspace_must_exist_to_be_read(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"no workspace here; run `irtwin run"):
        Workspace.existing(tmp_path)
    Workspace(tmp_path).close()
    Workspace.existing(tmp_path).close()


def test_a_workspace_where_a_file_stands(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="cannot create the workspace"):
        Workspace(tmp_path / "file")


@pytest.mark.parametrize(
    ("change", "table"),
    [("ALTER TABLE robot ADD COLUMN colour VARCHAR", "robot"), ("DROP TABLE base_parameter", "base_parameter")],
)
def test_a_workspace_of_another_version(tmp_path: Path, change: str, table: str) -> None:
    with Workspace(tmp_path) as workspace, workspace.engine.begin() as connection:
        connection.execute(text(change))
    with pytest.raises(InputError, match=f"table {table} is .*of another irtwin version"):
        Workspace(tmp_path)


@pytest.mark.parametrize("name", ["reports", "series", "twins", "live", "graph", "irtwin.db", "next_experiment"])
def test_a_workspace_that_links_elsewhere_is_refused(tmp_path: Path, name: str) -> None:
    mine = tmp_path / "mine"
    mine.mkdir()
    (mine / "letter.html").write_text("mine")
    (tmp_path / "place").mkdir()
    (tmp_path / "place" / name).symlink_to(mine)
    with pytest.raises(InputError, match=f"the path '{name}' leads outside the workspace"):
        Workspace(tmp_path / "place")
    assert [file.name for file in mine.iterdir()] == ["letter.html"]


def test_a_database_in_memory_has_the_tables_of_a_workspace_and_the_rows_that_were_given(tmp_path: Path) -> None:
    with Workspace(tmp_path) as workspace, in_memory([*rows.joints(), rows.robot()]) as engine:
        kept = set(inspect(workspace.engine).get_table_names())
        assert set(inspect(engine).get_table_names()) == kept - {"alembic_version"}
        with engine.connect() as connection:
            assert list(connection.scalars(select(JointRow.name))) == ["joint_a1", "joint_a2"]


def test_each_in_memory_is_a_database_of_its_own() -> None:
    for _ in range(2):
        with in_memory([rows.robot()]) as engine, engine.connect() as connection:
            assert not list(connection.scalars(select(JointRow.name)))

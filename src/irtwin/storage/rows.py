"""The rows of a robot, across all tables: put in, taken out, compared."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from sqlalchemy import (
    ColumnElement,
    Connection,
    Select,
    Table,
    and_,
    delete,
    exists,
    insert,
    inspect,
    select,
    true,
    update,
)
from sqlalchemy.orm import Session, aliased

from irtwin.storage import base_iri
from irtwin.storage.energy_schema import RunPrice
from irtwin.storage.schema import (
    LIVE,
    WATCHED_RUNS,
    Activity,
    Base,
    Individuals,
    RobotRow,
    RunEnergy,
    RunRow,
    Series,
    SourceFile,
    in_utc,
)

Values = dict[str, Any]  # of a row, by column
Tables = dict[str, list[Values]]  # rows, by table

# table -> its columns that name files of the workspace, with those of their SHA-256
FILES = {
    "series": [("path", "series_id")],
    "twin": [("file", "sha256")],
    "link_shape": [("mesh_file", "mesh_sha256")],
    "gap_diagnosis": [
        ("file", "sha256"),
        ("evidence_file", "evidence_sha256"),
        ("twin_file", "twin_sha256"),
        ("motion_file", "motion_sha256"),
    ],
}


@dataclass(frozen=True)
class NamedFile:
    """A file that the database names: its path in the workspace, its SHA-256, and the robot_id that it is of."""

    path: str
    sha256: str
    robot_id: str


def values(row: Base) -> Values:
    """Return a row's values, by column."""
    return {column.name: getattr(row, column.name) for column in row.__table__.columns}


def facts(row: Base) -> tuple[object, ...]:
    """Return a row's values, to compare; when and from which folder it was taken in is no fact of a data set."""
    columns = values(row) | ({"folder": ""} if isinstance(row, SourceFile) else {})
    if isinstance(row, RunRow):
        columns["start_time"] = in_utc(row.start_time) if row.start_time and row.start_time_from == "log" else None
    return (row.__tablename__, *columns.values())


def part_tables() -> list[Table]:
    """Return the tables of what a data set says of the robot itself: its joints, links, shapes and devices."""
    return [
        table
        for table in Base.metadata.sorted_tables
        if table.name not in (RobotRow.__tablename__, RunRow.__tablename__)
        and "robot_id" in table.columns
        and "activity_id" not in table.columns
    ]


def put_robot(session: Session, robot: Values) -> None:
    """Put a robot's row in place of the one that is there, if any: what refers to that stays."""
    session.merge(RobotRow(**robot))
    session.flush()


def insert_rows(session: Session, rows: Iterable[Base]) -> None:
    """Insert rows, those first that others refer to."""
    insert_values(session, tables_of(rows))


def tables_of(rows: Iterable[Base]) -> Tables:
    """Return the values of rows, table by table."""
    by_table: Tables = {}
    for row in rows:
        by_table.setdefault(row.__tablename__, []).append(values(row))
    return by_table


def insert_values(session: Session, rows: Tables) -> None:
    """Insert rows of tables, those first that others refer to."""
    for table in Base.metadata.sorted_tables:
        if rows.get(table.name):
            session.execute(insert(table), rows[table.name])


def recorded_rows(session: Session, robot_id: str) -> Tables:
    """Return the rows of a robot, its data set, its plans and what was derived from them: all but its live runs."""
    runs = select(RunRow.run_id).where(RunRow.robot_id == robot_id, RunRow.kind.not_in(WATCHED_RUNS))
    activities = select(Activity.activity_id).where(
        Activity.robot_id == robot_id, Activity.provider != LIVE, Activity.activity_id.not_in(_of_live(robot_id))
    )
    made = set(session.scalars(activities))  # by name: a query within that of each table takes longer to compile
    there = filled(session.connection())
    found: Tables = {}
    for table in Base.metadata.sorted_tables:
        if table.name in (RunRow.__tablename__, Series.__tablename__):
            recorded: ColumnElement[bool] = table.columns["run_id"].in_(runs)
        elif "activity_id" in table.columns:
            recorded = table.columns["activity_id"].in_(made)
        elif "robot_id" in table.columns:
            recorded = table.columns["robot_id"] == robot_id
        else:
            continue
        found[table.name] = _rows(session, table, recorded) if table in there else []
    return found


def filled(connection: Connection) -> list[Table]:
    """Return the tables that have rows, by one question: to ask 69 for theirs takes a tenth of a second."""
    there = inspect(connection).get_table_names()
    tables = [table for table in Base.metadata.sorted_tables if table.name in there]
    names = map(connection.dialect.identifier_preparer.format_table, tables)
    asked = (f"SELECT {at} WHERE EXISTS (SELECT * FROM {name})" for at, name in enumerate(names))
    return [tables[at] for (at,) in connection.exec_driver_sql(" UNION ALL ".join(asked))]


def modelled_of_live_runs(session: Session, robot_id: str) -> Tables:
    """Return the rows of what a robot's twin says of its live runs."""
    made = set(session.scalars(_of_live(robot_id)))
    return {
        table.name: _rows(session, table, table.columns["activity_id"].in_(made)) if made else []
        for table in _made_tables()
    }


def _rows(session: Session, table: Table, which: ColumnElement[bool]) -> list[Values]:
    return [dict(row) for row in session.execute(select(table).where(which)).mappings()]


def named_files(connection: Connection) -> list[NamedFile]:
    """Return the files of the workspace that the database names."""
    tables = (Base.metadata.tables[name] for name in FILES)
    rows = {table.name: connection.execute(select(table)).mappings().all() for table in tables}
    return files_of(rows)


def files_of(rows: Mapping[str, Sequence[Mapping[Any, Any]]]) -> list[NamedFile]:
    """Return the files of the workspace that rows name, which are given by table."""
    return [
        NamedFile(row[file], row[checksum], row.get("robot_id") or row["run_id"].partition(".")[0])
        for table, columns in FILES.items()
        for file, checksum in columns
        for row in rows.get(table, ())
        if row[file] is not None
    ]


def drop_data_set(session: Session, robot_id: str) -> None:
    """Drop what a data set said and what was derived of the robot; what a twin says of live runs goes with the twin.

    The robot stays, and so do runs of no data set and the prices of plans among them.
    """
    prices = select(RunPrice.activity_id).join(RunRow).where(RunRow.robot_id == robot_id, RunRow.role.is_(None))
    made = and_(Activity.provider != LIVE, Activity.activity_id.not_in(prices))
    _drop(session, robot_id, RunRow.role.is_not(None), made)


def drop_recorded(session: Session, robot_id: str) -> None:
    """Drop all that `recorded_rows` returns but the robot itself."""
    _drop(session, robot_id, RunRow.kind.not_in(WATCHED_RUNS), Activity.provider != LIVE)


def drop_robot(session: Session, robot_id: str) -> None:
    """Drop a robot and all that is known of it."""
    _drop(session, robot_id, true(), true())
    session.execute(delete(RobotRow).where(RobotRow.robot_id == robot_id))


def _drop(session: Session, robot_id: str, runs: ColumnElement[bool], activities: ColumnElement[bool]) -> None:
    """Drop some of a robot's runs and activities, and its parts."""
    made = select(Activity.activity_id).where(Activity.robot_id == robot_id, activities)
    drop_activities(session, set(session.scalars(made)))
    dropped = RunRow.robot_id == robot_id, runs
    session.execute(delete(Series).where(Series.run_id.in_(select(RunRow.run_id).where(*dropped))))
    session.execute(delete(RunRow).where(*dropped))
    for table in part_tables():
        session.execute(delete(table).where(table.columns["robot_id"] == robot_id))


def drop_run(session: Session, run_id: str, subject: str) -> None:
    """Drop a run that no twin knows, with its series and all that providers made of it, their `subject` by IRI."""
    made = select(Activity.activity_id).where(Activity.subject == subject)
    drop_activities(session, with_dependents(session, set(session.scalars(made))))
    for kind in (Series, RunRow):
        session.execute(delete(kind).where(kind.run_id == run_id))


def release_plans(session: Session, robot_id: str) -> None:
    """Let runs of a robot that carried out a plan which is gone say no plan, and slower plans no run that is gone."""
    there = aliased(RunRow)
    for column, also in ((RunRow.performs, {}), (RunRow.time_scaling_of, {RunRow.time_scale: None})):
        gone = ~exists().where(there.run_id == column)
        session.execute(
            update(RunRow)
            .where(RunRow.robot_id == robot_id, column.is_not(None), gone)
            .values({column: None, **also})
            .execution_options(synchronize_session=False)
        )


def drop_activities(session: Session, activities: set[str]) -> None:
    """Drop activities with all that they made."""
    if not activities:
        return
    for table in reversed(_made_tables()):
        session.execute(delete(table).where(table.columns["activity_id"].in_(activities)))


def with_dependents(session: Session, activities: set[str]) -> set[str]:
    """Add the activities whose rows refer to rows of these activities, and theirs in turn."""
    whole = set(activities)
    new = whole
    while new:
        dependents: set[str] = set()
        for table in _made_tables():
            for key in table.foreign_keys:
                parent = key.column.table
                if parent.name != Activity.__tablename__ and "activity_id" in parent.columns:
                    dependents |= set(
                        session.scalars(
                            select(table.columns["activity_id"])
                            .join(parent, key.parent == key.column)
                            .where(parent.columns["activity_id"].in_(new))
                            .distinct()
                        )
                    )
        new = dependents - whole
        whole = whole | new
    return whole


def _of_live(robot_id: str) -> Select[Any]:
    """Return the query of the activities in which a twin worked out the energy of a robot's live runs."""
    energies = (
        select(RunEnergy.activity_id).join(RunRow).where(RunRow.robot_id == robot_id, RunRow.kind.in_(WATCHED_RUNS))
    )
    return energies.where(RunEnergy.twin_id.is_not(None))


def _made_tables() -> list[Table]:
    return [table for table in Base.metadata.sorted_tables if "activity_id" in table.columns]


def base_of(connection: Connection) -> str:
    """Return the base that a database keeps; the default where none was said."""
    base: str | None = connection.scalar(select(Individuals.base_iri))
    return base or base_iri.DEFAULT

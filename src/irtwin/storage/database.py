"""The workspace: a database of what is known of robots, with the series and twins that it names."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Literal, Self, TypeVar

import pyarrow as pa
from sqlalchemy import URL, Engine, Select, Table, delete, exists, insert, select
from sqlalchemy.orm import Session

from irtwin.errors import InputError
from irtwin.location import Location
from irtwin.resources import Resources, resources_of
from irtwin.storage import asserted, base_iri, engine, files, tariff
from irtwin.storage import gap_schema as _gap_schema  # noqa: F401  its tables are made with the others
from irtwin.storage import rows as robot_rows
from irtwin.storage.asserted import AssertedFact
from irtwin.storage.files import InsidePath, inside
from irtwin.storage.migration import VERSION_TABLE, migrate, stamp
from irtwin.storage.package_tables import package_tables
from irtwin.storage.row_rules import check_rows
from irtwin.storage.rows import Tables
from irtwin.storage.schema import (
    LIVE,
    MEASURED,
    MODELLED,
    PLANNED,
    PLANNED_RUN,
    Activity,
    ActivityUse,
    Base,
    Individuals,
    RobotRow,
    RunEnergy,
    RunRow,
    Series,
    SourceFile,
    relation_to,
)
from irtwin.storage.series import FOLDER, is_whole, read_series, write_series
from irtwin.storage.structure_schema import LinkShape

T = TypeVar("T")
Outcome = Literal["new", "unchanged", "replaced"]
_DATABASE = "irtwin.db"
_FROM_A_BACKUP = (
    "`irtwin workspace restore ARCHIVE --workspace NEW` makes another workspace of a backup; without one, run the data "
    "sets again into a new one (where a server keeps the database, give --database)"
)
TWINS, DIAGNOSES, MESHES = "twins", "diagnoses", "meshes"
_MOST_OF_ROWS = 10_000_000  # bytes of a database whose rows are looked at when it is opened: 0.2 s, of a fleet seconds
_FOLDERS = (FOLDER, TWINS, DIAGNOSES, MESHES)  # of files that rows name
# What is written without being asked for: a link among it would lead into somebody's other files.
_OWN = (*_FOLDERS, _DATABASE, LIVE, "graph", "reports", "alarms", "next_experiment", "mapped_rows.db", tariff.FILE)


class Workspace:
    """A folder: `irtwin.db` (or a database elsewhere, by URL), `series/`, `twins/`, `meshes/`, `graph/` and `reports/`.

    Every change is one transaction: files are written first, under the database's lock, rows that name
    them are committed last, and files that no row names are removed afterwards.
    """

    def __init__(
        self,
        folder: Path,
        url: str | None = None,
        resources: Resources | None = None,
        base: str | None = None,
        graph_url: str | None = None,
    ) -> None:
        """Open a workspace, or make one. Raises InputError where the database cannot be opened.

        `resources` are those that hold for it; its own and those of installed packages if None. `base` is what the IRIs
        of its individuals begin with, else what `plant.toml` says; it stays once a robot is there. `graph_url`
        is that of the SPARQL server that keeps the graph, if not the folder does.
        """
        self.location, self.folder = Location(folder, url, graph_url), folder
        self.resources = resources or resources_of(folder)
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise InputError(
                f"{folder}: cannot create the workspace: {error.strerror}; choose another folder"
            ) from None
        for name in _OWN:
            inside(folder, name)
        if url is None and not (folder / _DATABASE).exists():
            _check_that_nothing_is_lost(folder)
        self.engine = engine.open_engine(url or URL.create("sqlite", database=str(folder / _DATABASE)))
        engine.use_write_ahead_log(self.engine)
        size = engine.check(self.engine)
        engine.check_schema(self.engine, {*Base.metadata.tables, VERSION_TABLE})
        self._make_tables()
        if size <= _MOST_OF_ROWS:  # whoever wrote them: the folder may come from elsewhere
            with self.engine.connect() as connection:
                check_rows(connection, engine.shown(self.engine.url))
        self.base = self._base(base)

    @classmethod
    def is_there(cls, where: Location | Path) -> bool:
        """Whether a folder has a workspace, or one may be in a database elsewhere."""
        location = Location.of(where)
        file = location.folder / _DATABASE
        return location.database is not None or file.is_file() or file.is_symlink()  # opening says where a link leads

    @classmethod
    def at(cls, location: Location, base: str | None = None) -> Self:
        """Open a workspace, or make one, with its database and graph where a location says."""
        return cls(location.folder, location.database, None, base, location.graph_url)

    @classmethod
    def existing(cls, where: Location | Path) -> Self:
        """Open a workspace that must be there already. Raises InputError where it is not."""
        location = Location.of(where)
        if not cls.is_there(location):
            folder = location.folder
            _check_that_nothing_is_lost(folder)
            raise InputError(f"{folder}: no workspace here; run `irtwin run DATASET --workspace {folder}` first")
        return cls.at(location)

    @property
    def graph_folder(self) -> Path:
        """Where the graph's store lies."""
        return self.location.graph_folder

    def check_graph(self) -> None:
        """Raise InputError where the graph's folder is not there, though the database knows of robots."""
        if self.knows_robots() and not (self.graph_folder / "CURRENT").is_file():
            raise InputError(
                f"{self.graph_folder}: the graph is missing, or some of its files; the database is intact: "
                f"`irtwin workspace repair --workspace {self.folder}` rebuilds the graph from it (if a server keeps "
                "the graph, give --graph)"
            )

    def knows_robots(self) -> bool:
        """Whether the database knows of any robot."""
        return self.first(select(RobotRow.robot_id)) is not None

    @property
    def mapped_rows(self) -> Path:
        """Where the mapping remembers the rows that the graph was made of."""
        return self.folder / "mapped_rows.db"

    def file(self, path: str) -> InsidePath:
        """Return the file that a path in the workspace means. Raises InputError where it leads outside."""
        return inside(self.folder, path)

    def report_path(self, robot_id: str) -> InsidePath:
        """Where a robot's energy report lies."""
        return self.file(f"reports/{robot_id}.html")

    def gap_report_path(self, robot_id: str) -> InsidePath:
        """Where the report of a robot's last diagnosis lies."""
        return self.file(f"reports/{robot_id}.gap.html")

    def reading(self) -> Session:
        """Give a session to read with, which its block closes; nothing done in it is kept."""
        return Session(self.engine)

    def row(self, kind: type[T], key: Any) -> T:
        """Return the row of a class by its key. NoResultFound where there is none."""
        with self.reading() as session:
            return session.get_one(kind, key)

    def all(self, query: Select[T]) -> Sequence[T]:
        """Return all that a query of one class or column finds."""
        with self.reading() as session:
            return session.scalars(query).all()

    def first(self, query: Select[T]) -> T | None:
        """Return the first that such a query finds."""
        with self.reading() as session:
            return session.scalars(query).first()

    def ingest(
        self,
        robot: RobotRow,
        parts: Sequence[Base],
        runs: Sequence[RunRow],
        series: Mapping[str, pa.Table],
        documents: Mapping[str, bytes] | None = None,
        facts: Sequence[AssertedFact] = (),
    ) -> Outcome:
        """Take in a robot's data set, all of it or nothing.

        `parts` are the rows of joints, links, shapes and devices; `series` holds the measured or planned samples of
        each run, by `run_id`; `documents` the files that parts name, by their path in the workspace. The data set that
        is there already changes nothing; another one of the same robot replaces it, and all that was derived from it is
        dropped. Runs of no data set stay: those that were watched live, plans and logs that were kept on their own. One
        whose plan is gone says none.
        """
        missing = {run.run_id for run in runs} ^ set(series)
        if missing:
            raise ValueError(f"runs and series differ: {sorted(missing)}")
        rows = [robot, *parts, *runs]
        with engine.writing(self.engine) as session:
            known = bool(session.scalar(select(exists().where(RobotRow.robot_id == robot.robot_id))))
            is_followed = not asserted.is_newer_than_twin(session, robot.robot_id, facts)
            if known and is_followed and self._holds(session, robot.robot_id, rows):
                for row in parts:
                    if isinstance(row, SourceFile):
                        session.merge(row)  # the data set may lie in another folder now
                return "unchanged"
            if known:
                robot_rows.drop_data_set(session, robot.robot_id)
            robot_rows.put_robot(session, robot_rows.values(robot))
            for path, content in (documents or {}).items():
                files.write(self.file(path), content)
            stored = [self._store(run.run_id, series[run.run_id], _told(run)) for run in runs]
            robot_rows.insert_rows(session, [*parts, *runs, *stored])
            robot_rows.release_plans(session, robot.robot_id)
        self.remove_orphans()
        return "replaced" if known else "new"

    def replace_activity(
        self,
        activity: Activity,
        used: Iterable[str],
        rows: Sequence[Base],
        series: Mapping[str, pa.Table] | None = None,
        documents: Mapping[str, bytes] | None = None,
        instead_of: str | None = None,
        metered: tuple[Activity, Iterable[str]] | None = None,
    ) -> None:
        """Keep what a provider made, in place of what it, or the provider `instead_of`, made of the same subject.

        used: IRIs of what the activity read, below the workspace's base or whole;
        rows: of the tables with an `activity_id`, which is set here; series: modelled samples by `run_id`;
        documents: files by their path in the workspace (`twins/ID.json`);
        metered: the activity that read the meter alone, and from what.
        What was derived from the replaced rows (the energy of an earlier twin) is dropped too.
        """
        made = [(activity, used), *([] if metered is None else [metered])]
        for row in rows:
            row.activity_id = activity.activity_id  # type: ignore[attr-defined]
            if isinstance(row, RunEnergy) and not row.taken_activity_id:
                row.taken_activity_id = made[-1][0].activity_id
        uses = {(kept.activity_id, entity.removeprefix(self.base)) for kept, read in made for entity in read}
        read_rows = [
            ActivityUse(activity_id=of, entity=entity, relation=relation_to(entity)) for of, entity in sorted(uses)
        ]
        with engine.writing(self.engine) as session:
            same = select(Activity.activity_id).where(
                Activity.provider.in_((*(kept.provider for kept, _ in made), instead_of)),
                Activity.subject == activity.subject,
            )
            robot_rows.drop_activities(session, robot_rows.with_dependents(session, set(session.scalars(same))))
            for path, content in (documents or {}).items():
                files.write(self.file(path), content)
            modelled = [
                self._store(run_id, table, MODELLED, activity.activity_id) for run_id, table in (series or {}).items()
            ]
            robot_rows.insert_rows(session, [*(kept for kept, _ in made), *read_rows, *rows, *modelled])
        self.remove_orphans()

    def keep_run(self, run: RunRow, series: pa.Table, rows: Tables | None = None) -> None:
        """Keep a run of no data set with its samples, and further rows about it, by table."""
        with engine.writing(self.engine) as session:
            stored = self._store(run.run_id, series, _told(run))
            run.file, run.sha256 = stored.path, stored.series_id
            robot_rows.insert_rows(session, [run, stored])
            robot_rows.insert_values(session, rows or {})

    def facts_about(self, robot_id: str) -> Sequence[AssertedFact]:
        """Return the facts that rows of a robot follow, the earliest first."""
        followed = AssertedFact.about_robot == robot_id, AssertedFact.place.is_not(None)
        return self.all(select(AssertedFact).where(*followed).order_by(AssertedFact.time))

    def keep_facts(self, facts: Sequence[AssertedFact], withdrawn: Iterable[str]) -> None:
        """Keep what a user asserted, with the rows that follow; drop what was taken back, by `fact_id`."""
        with engine.writing(self.engine) as session:
            session.execute(delete(AssertedFact).where(AssertedFact.fact_id.in_(list(withdrawn))))
            for fact in facts:
                if fact.place is not None:
                    setattr(
                        asserted.row_of(session, fact), fact.column.name, asserted.value_of(fact.column, fact.value)
                    )
            session.add_all(facts)

    def drop_robot(self, robot_id: str) -> None:
        """Forget a robot and everything derived from it."""
        with engine.writing(self.engine) as session:
            robot_rows.drop_robot(session, robot_id)
        self.remove_orphans()

    def drop_run(self, run_id: str, subject: str) -> None:
        """Forget a run that no twin knows, and what providers made of it, their `subject` by its IRI."""
        with engine.writing(self.engine) as session:
            robot_rows.drop_run(session, run_id, subject)
        self.remove_orphans()

    def read_series(self, run_id: str, kind: str = MEASURED, columns: Sequence[str] | None = None) -> pa.Table:
        """Read a run's samples, or some columns of them. Raises InputError where there are none."""
        row = self.first(select(Series).where(Series.run_id == run_id, Series.kind == kind))
        if row is None:
            raise InputError(f"{self.folder}: run {run_id} has no {kind} series; ingest its data set first")
        return read_series(self.folder, row.path, row.series_id, columns)

    def read_file(self, path: str, checksum: str) -> pa.Table:
        """Read a series by the path and checksum that the graph says of it. Raises InputError as `read_series`."""
        return read_series(self.folder, path, checksum)

    def read_document(self, path: str, checksum: str) -> bytes:
        """Read a document by its path and SHA-256. Raises InputError where it is gone or another."""
        return files.read_document(self.folder, path, checksum)

    def remove_orphans(self) -> None:
        """Remove files that no row names, which a crash or a replaced data set leaves behind."""
        with engine.writing(self.engine) as session:
            named = {file.path for file in robot_rows.named_files(session.connection())}
            for file in [file for name in _FOLDERS for file in (self.folder / name).glob("*")]:
                if file.is_file() and file.relative_to(self.folder).as_posix() not in named:
                    file.unlink()

    def close(self) -> None:
        """Give the database's connections back."""
        self.engine.dispose()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _store(self, run_id: str, table: pa.Table, kind: str, activity_id: str | None = None) -> Series:
        path, series_id = write_series(self.folder, table)
        return Series(
            series_id=series_id,
            run_id=run_id,
            kind=kind,
            path=path,
            row_count=table.num_rows,
            columns=",".join(table.column_names),
            activity_id=activity_id,
        )

    def _holds(self, session: Session, robot_id: str, rows: Sequence[Base]) -> bool:
        """Whether exactly these source rows are stored already, with their series and meshes undamaged."""
        runs = session.scalars(select(RunRow).where(RunRow.robot_id == robot_id, RunRow.role.is_not(None)))
        stored = {robot_rows.facts(session.get_one(RobotRow, robot_id)), *map(robot_rows.facts, runs)}
        for table in robot_rows.part_tables():
            rows_kept = session.execute(select(table).where(table.columns["robot_id"] == robot_id)).mappings()
            stored |= {
                (table.name, *({**row} | ({"folder": ""} if "folder" in row else {})).values()) for row in rows_kept
            }
        measured = select(Series.path, Series.series_id).join(RunRow)
        measured = measured.where(RunRow.robot_id == robot_id, Series.kind != MODELLED)
        named = [(row.path, row.series_id) for row in session.execute(measured)]
        shapes = select(LinkShape.mesh_file, LinkShape.mesh_sha256).where(LinkShape.robot_id == robot_id)
        named += [(row.mesh_file, row.mesh_sha256) for row in session.execute(shapes) if row.mesh_file is not None]
        whole = all(is_whole(self.folder, path, checksum) for path, checksum in named)
        return whole and stored == {robot_rows.facts(row) for row in rows}

    def _base(self, given: str | None) -> str:
        """Return what the IRIs of individuals begin with; keep what is said of it anew."""
        file = self.folder / tariff.FILE
        in_file = base_iri.said(file)
        base = in_file if given is None else base_iri.checked(given, "--base")
        if None not in (in_file, base) and in_file != base:
            raise InputError(
                f"{file}: says {base_iri.KEY} = {in_file!r}, and --base {base}; say the same or leave one out"
            )
        with self.engine.connect() as connection:
            kept = robot_rows.base_of(connection)
        if base is None or base == kept:
            return kept
        with engine.writing(self.engine) as session:
            kept = robot_rows.base_of(session.connection())  # another process may have said one meanwhile
            if base != kept and session.scalar(select(exists().where(RobotRow.robot_id.is_not(None)))):
                raise InputError(
                    f"{self.folder}: the individuals of this workspace lie below {kept}, and others may name them so; "
                    f"they cannot move to {base}: take the data sets into a new workspace with that base"
                )
            session.execute(delete(Individuals))
            session.execute(insert(Individuals).values(base_iri=base))
        return base

    def _make_tables(self) -> None:
        of_packages = package_tables()
        tables = [table for table in Base.metadata.sorted_tables if table not in of_packages]
        there = engine.columns(self.engine)
        if not any(table.name in there for table in tables):  # readers need not wait for the lock
            if self.engine.dialect.name == "sqlite":
                _check_that_nothing_is_lost(self.folder, "its database holds no tables")
            with engine.writing(self.engine) as session:
                Base.metadata.create_all(session.connection())
                stamp(session.connection())
        migrate(self.engine)
        there = engine.columns(self.engine)
        for table in tables:
            if table.name not in there:
                raise InputError(
                    f"{engine.shown(self.engine.url)}: table {table.name} is missing, damaged or of another irtwin "
                    f"version; {_FROM_A_BACKUP}"
                )
            if not _is_of_now(table, there):
                raise InputError(
                    f"{engine.shown(self.engine.url)}: table {table.name} is of another irtwin version; "
                    "choose a new workspace and ingest again"
                )
        self._make_tables_of_packages(of_packages, there)

    def _make_tables_of_packages(self, tables: Sequence[Table], there: Mapping[str, set[str]]) -> None:
        """Make the tables that are not there, and anew those of another version: providers can fill them again."""
        outdated = [table for table in tables if table.name in there and not _is_of_now(table, there)]
        if outdated or not all(table.name in there for table in tables):
            with engine.writing(self.engine) as session:
                Base.metadata.drop_all(session.connection(), outdated)
                Base.metadata.create_all(session.connection(), list(tables))


@contextmanager
def in_memory(rows: Iterable[Base]) -> Iterator[Engine]:
    """Give a database with all tables of a workspace that holds these rows alone; it is gone afterwards."""
    package_tables()
    opened = engine.open_engine("sqlite://")
    try:
        with engine.writing(opened) as session:
            Base.metadata.create_all(session.connection())
            robot_rows.insert_rows(session, rows)
        yield opened
    finally:
        opened.dispose()


def _told(run: RunRow) -> str:
    """Return the kind of the samples that a run comes with."""
    return PLANNED if run.kind == PLANNED_RUN else MEASURED


def _is_of_now(table: Table, there: Mapping[str, set[str]]) -> bool:
    return there[table.name] == set(table.columns.keys())


def _check_that_nothing_is_lost(folder: Path, problem: str = f"{_DATABASE} is missing") -> None:
    """Raise InputError where files lie in a workspace that only a database could have named."""
    for name in ("graph", *_FOLDERS):
        if next((folder / name).glob("[!.]*"), None) is not None:
            raise InputError(f"{folder}: {problem}, though {name}/ is full; {_FROM_A_BACKUP}")

"""A workspace in one file, and back: graph, database, series, twins, diagnoses and reports.

The database goes as rows, so that a backup of an SQLite workspace may be restored into PostgreSQL and the other way.
"""

from __future__ import annotations

import errno
import json
import math
import os
import re
import shutil
from collections.abc import Iterator, Sequence
from contextlib import nullcontext
from datetime import UTC, datetime
from importlib.metadata import version
from itertools import islice
from pathlib import Path
from typing import Any

from pyoxigraph import NamedNode, Quad, RdfFormat, parse, serialize
from sqlalchemy import Connection, Table, func, insert, select
from sqlalchemy.exc import SQLAlchemyError

from irtwin.errors import InputError
from irtwin.json_text import parse_json
from irtwin.knowledge.mapping.source import snapshot_options
from irtwin.knowledge.store.damage import told
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.knowledge.vocabulary import GRAPH_SOURCE
from irtwin.location import Location
from irtwin.resources import KINDS
from irtwin.storage import engine, files
from irtwin.storage.archive import pack, unpack
from irtwin.storage.database import DIAGNOSES, MESHES, TWINS, Workspace
from irtwin.storage.files import inside
from irtwin.storage.package_tables import package_tables
from irtwin.storage.row_rules import check_row
from irtwin.storage.rows import NamedFile, named_files
from irtwin.storage.schema import LIVE, Base, Moment, RobotRow
from irtwin.storage.series import FOLDER
from irtwin.storage.tariff import FILE as PLANT_FILE
from irtwin.trust import withdraw

_FOLDERS = (FOLDER, TWINS, DIAGNOSES, MESHES, LIVE, "reports")
_GRAPH = "graph.nq"
_NAMES = re.compile(
    rf"{re.escape(_GRAPH)}|{re.escape(PLANT_FILE)}"
    rf"|(?:rows|{'|'.join((*_FOLDERS, *KINDS))}|reports/[a-z_]+)/[A-Za-z0-9_~-][A-Za-z0-9_.~-]*"
)
_AT_ONCE = 5000  # rows
_LONGEST_ROW = 100 << 20  # bytes: a robot description may have 10 MB, and is escaped


def backup(place: Workspace, graph: KnowledgeGraph, archive: Path) -> None:
    """Write a workspace into an archive, whole or not at all, while others may write.

    Rows and files are those of one moment: files are linked while the writers' lock is held, rows read from a snapshot
    taken then. Who may only read cannot hold that lock, and is told of files that go meanwhile. The graph is that of a
    moment just after; what it lacks or has more is set right by the next mapping.
    Raises InputError where a file that the database names is missing or altered, or graph or database are damaged.
    """
    engine.check(place.engine, math.inf)  # a large one was not looked through at opening
    reads_only = engine.is_read_only(place.engine)
    with files.working_folder(archive.absolute().parent if reads_only else place.folder, ".backup-") as held:
        with place.engine.connect() as connection:
            connection.execution_options(**snapshot_options(place.engine))
            with connection.begin():
                with nullcontext() if reads_only else engine.writing(place.engine):
                    connection.execute(select(func.count()).select_from(Base.metadata.sorted_tables[0]))
                    contents = dict(_linked(place.folder, held))
                    own = (*place.resources.files, *place.resources.left_aside)
                    contents |= {f"{file.kind}/{file.name}": file.path for file in own if file.is_of_workspace}
                contents |= _dump_rows(connection, held)
                named = named_files(connection)
        lost = [file for file in named if file.path not in contents]
        if lost:
            raise InputError(_incomplete(place.folder, lost, "missing", "nothing was written"))
        with told(graph.folder):
            serialize(graph.quads(), str(held / _GRAPH), RdfFormat.N_QUADS)
        contents[_GRAPH] = held / _GRAPH
        about = {"software": f"irtwin {version('irtwin')}", "created": datetime.now(UTC).isoformat(timespec="seconds")}
        altered = pack(contents, archive, about, {file.path: file.sha256 for file in named})
        lost = [file for file in named if file.path in altered]
        if lost:
            raise InputError(_incomplete(place.folder, lost, "altered", "nothing was written"))


def restore(archive: Path, where: Location | Path) -> None:
    """Make a workspace of an archive, whole or not at all, where there is none.

    Rows go to the location's database, into tables that must be empty, and the graph to its server, where there are
    such.
    Raises InputError where the archive is damaged or not ours, or where there is something already.
    """
    location = Location.of(where)
    folder = location.folder
    if folder.exists() and not (folder.is_dir() and not any(folder.iterdir())):
        raise InputError(f"{folder}: already exists; restore into a new folder")
    folder.absolute().parent.mkdir(parents=True, exist_ok=True)
    with files.working_folder(folder.absolute().parent, ".irtwin-restore-") as working:
        held = working / "workspace"
        with Workspace(held, location.database) as place:
            sums = dict(unpack(archive, held, _NAMES))
            with KnowledgeGraph(location.graph_url or place.graph_folder, held) as graph:
                if graph.graphs():
                    raise InputError(f"{graph.store.shown}: the server holds a graph already; give an empty one")
                with engine.writing(place.engine) as session:
                    for table in Base.metadata.sorted_tables:
                        _insert(session.connection(), table, archive, held / "rows" / f"{table.name}.jsonl")
                    strange = {file.stem for file in (held / "rows").glob("*")} - Base.metadata.tables.keys()
                    if strange:
                        raise InputError(
                            f"{archive}: table {min(strange)} is of a package that is not installed, or of another "
                            "irtwin version; install that"
                        )
                    lost = [file for file in named_files(session.connection()) if sums.get(file.path) != file.sha256]
                    if lost:
                        raise InputError(_incomplete(archive, lost, "missing or altered", "use another backup"))
                    if _GRAPH not in sums:
                        raise InputError(f"{archive}: incomplete: it holds no graph; use another backup")
                    robots = session.scalar(select(func.count()).select_from(RobotRow))
                    names = (str(quad.graph_name) for quad in _read_quads(archive, held / _GRAPH))
                    if robots and not any(name.startswith(f"<{GRAPH_SOURCE}") for name in names):
                        raise InputError(f"{archive}: incomplete: its graph knows no robot; use another backup")
                    graph.replace(_read_quads(archive, held / _GRAPH), "")
        shutil.rmtree(held / "rows", ignore_errors=True)
        (held / _GRAPH).unlink(missing_ok=True)
        _put_in_place(held, folder)


def _put_in_place(held: Path, folder: Path) -> None:
    """Give a workspace its place. What an earlier one there was trusted with is not this one's."""
    withdraw(held)
    withdraw(folder)
    if folder.exists():
        folder.rmdir()
    held.rename(folder)


def _incomplete(place: Path, lost: Sequence[NamedFile], flaw: str, then: str) -> str:
    robots = ", ".join(sorted({file.robot_id for file in lost}))
    return (
        f"{place}: {lost[0].path}{f' and {len(lost) - 1} more files' if len(lost) > 1 else ''} {flaw}; {then}: run the "
        f"data set of {robots} again, or take the robot out by `irtwin workspace drop`"
    )


def _linked(folder: Path, held: Path) -> Iterator[tuple[str, Path]]:
    """Link a workspace's files into a folder; those that still grow are copied."""
    for name in _FOLDERS:
        (held / name).mkdir(exist_ok=True)
        for file in filter(Path.is_file, sorted((folder / name).glob("[!.]*"))):
            target = held / name / file.name
            file = inside(folder, f"{name}/{file.name}")  # a link may lead to what is nobody else's
            try:
                shutil.copyfile(file, target) if name == LIVE else _link(file, target)
            except FileNotFoundError:  # the journal of a run that is in the database now
                continue
            yield f"{name}/{file.name}", target
    if (folder / PLANT_FILE).is_file():
        yield PLANT_FILE, shutil.copyfile(folder / PLANT_FILE, held / PLANT_FILE)


def _link(file: Path, target: Path) -> None:
    try:
        os.link(file, target)
    except OSError as error:
        if error.errno not in (errno.EXDEV, errno.EPERM, errno.EACCES):
            raise
        shutil.copyfile(file, target)  # it is another user's, or lies on another disk


def _dump_rows(connection: Connection, held: Path) -> Iterator[tuple[str, Path]]:
    """Write each table as a file of JSON lines."""
    (held / "rows").mkdir()
    for table in Base.metadata.sorted_tables:
        file = held / "rows" / f"{table.name}.jsonl"
        with file.open("w", encoding="utf-8") as out:
            for row in connection.execution_options(yield_per=_AT_ONCE).execute(select(table)).mappings():
                out.write(json.dumps(dict(row), default=datetime.isoformat) + "\n")
        yield f"rows/{table.name}.jsonl", file


def _insert(connection: Connection, table: Table, archive: Path, file: Path) -> None:
    if connection.execute(select(func.count()).select_from(table)).scalar_one():
        raise InputError(f"table {table.name} of the database holds rows already; give an empty database")
    if not file.is_file():
        if table in package_tables():
            return  # made before the package was installed; its providers fill it
        raise InputError(
            f"{archive}: has no table {table.name}: made by another irtwin version; restore it with that one"
        )
    try:
        rows = (_row(table, archive, line) for line in _lines(file))
        while chunk := list(islice(rows, _AT_ONCE)):
            connection.execute(insert(table), chunk)
    except (ValueError, TypeError, SQLAlchemyError) as error:
        reason = str(error).splitlines()[0][:500]
        raise InputError(
            f"{archive}: the rows of table {table.name} do not fit ({reason}); use another backup"
        ) from None


def _lines(file: Path) -> Iterator[bytes]:
    """Yield the lines of a file; ValueError for one that no row needs."""
    with file.open("rb") as lines:
        while line := lines.readline(_LONGEST_ROW + 1):
            if len(line) > _LONGEST_ROW:
                raise ValueError(f"one has more than {_LONGEST_ROW >> 20} MB")
            yield line


def _row(table: Table, archive: Path, line: bytes) -> dict[str, Any]:
    row = parse_json(line)
    if not isinstance(row, dict) or set(row) != set(table.columns.keys()):
        raise InputError(f"{archive}: table {table.name} was made by another irtwin version; restore it with that one")
    moments = [column.name for column in table.columns if isinstance(column.type, Moment) and row[column.name]]
    row |= {name: datetime.fromisoformat(row[name]) for name in moments}
    check_row(table, row)
    return row


def _read_quads(archive: Path, file: Path) -> Iterator[Quad]:
    try:
        for quad in parse(path=str(file), format=RdfFormat.N_QUADS):
            if isinstance(quad.graph_name, NamedNode):
                yield quad
    except (SyntaxError, MemoryError) as error:  # the parser holds 16 MB of a line
        raise InputError(f"{archive}: its graph is damaged: {error}; use another backup") from None

"""A workspace that another user may only read: what reads works, what writes says why it cannot."""

from __future__ import annotations

import os
import shutil
import sqlite3
import subprocess
import sys
import zipfile
from collections.abc import Callable
from contextlib import closing
from pathlib import Path

import pytest
from tests import rows
from tests.killed_writers import broken_off, take_in

from irtwin.storage import engine
from irtwin.storage.database import Workspace
from irtwin.storage.read_only import connecting, may_only_be_read

OTHER = 65534
COMMANDS = """
import shlex, sys
from tests.data_sets import irtwin
for line in sys.argv[1:]:
    said = irtwin(*shlex.split(line))
    print(said.status, *said.out.split("\\n")[:1], *said.err.split("\\n")[:1], "Traceback" in said.err)
"""
WORKSPACE_OF_ANOTHER = """
import sys
from pathlib import Path
from irtwin.storage.database import Workspace
with Workspace.existing(Path(sys.argv[1])) as place, place.engine.connect() as connection:
    print(connection.exec_driver_sql("SELECT count(*) FROM robot").scalar(), flush=True)
    place.engine.dispose()
"""


def without_rights(code: str, *arguments: object) -> list[str]:
    """Run Python as root without the right to pass over permissions; return the lines that it printed."""
    if os.geteuid() != 0 or shutil.which("setpriv") is None:
        pytest.skip("only root can give rights away, by setpriv")
    less = "-dac_override,-dac_read_search,-fowner"
    done = subprocess.run(
        ["setpriv", f"--bounding-set={less}", f"--inh-caps={less}", sys.executable, "-c", code, *map(str, arguments)],
        capture_output=True, text=True, check=True,
    )  # fmt: skip
    return done.stdout.splitlines()


def given_away(folder: Path) -> Path:
    """Give a folder to another user, who lets others read."""
    for path in (folder, *folder.rglob("*")):
        os.chown(path, OTHER, OTHER)
        path.chmod(0o755 if path.is_dir() else 0o644)
    return folder


def contents(folder: Path) -> dict[str, bytes]:
    return {str(file): file.read_bytes() for file in folder.rglob("*") if file.is_file()}


@pytest.mark.nightly
@pytest.mark.slow
@pytest.mark.skipif(os.geteuid() != 0, reason="only root can give files away")
def test_commands_on_a_workspace_of_another_user(tmp_path: Path) -> None:
    folder, out = tmp_path / "workspace", tmp_path / "out"
    out.mkdir()
    take_in(folder, "A")
    before = contents(given_away(folder))
    reading = ["workspace status", "query energy_per_run", "explain 'id:robot/A a'", "alarms"]
    reading += [f"workspace backup {out}/kept.zip", f"export --owl {out}/graph.owl"]
    writing = ["workspace reason", "workspace drop A", "workspace repair", "improve A", "demo"]
    said = without_rights(COMMANDS, *(f"{command} --workspace {folder}" for command in reading + writing))
    for line in said[: len(reading)]:
        assert line.startswith("0 ") and line.endswith(" False"), line
    for line in said[len(reading) :]:
        assert line.startswith(f"2  irtwin: {folder}") and line.endswith(" False"), line
        assert "ermission denied" in line and "ask its owner for the right" in line, line
    assert contents(folder) == before
    assert sorted(file.name for file in out.iterdir()) == ["graph.owl", "kept.zip"]
    assert {"graph.nq", "rows/robot.jsonl"} <= set(zipfile.ZipFile(out / "kept.zip").namelist())


@pytest.mark.slow
@pytest.mark.skipif(os.geteuid() != 0, reason="only root can give files away")
def test_a_graph_that_is_behind_says_so_to_who_may_only_read_it(tmp_path: Path) -> None:
    take_in(tmp_path, "A")
    broken_off(tmp_path, "B")
    given_away(tmp_path)
    (line,) = without_rights(COMMANDS, f"query 'ASK {{}}' --workspace {tmp_path}")
    assert line.startswith("0 ") and "behind the database" in line


# What a writer of a row leaves of the database, its log and the log's index, put back once it has closed them.
LEFT: dict[str, tuple[str, ...]] = {
    "closed": (),  # what was in the log is in the file
    "killed": ("", "-wal", "-shm"),
    "killed and copied": ("", "-wal"),
    "at work": (),
}


@pytest.mark.slow
@pytest.mark.skipif(os.geteuid() != 0, reason="only root can give files away")
@pytest.mark.parametrize("left", LEFT)
def test_rows_in_the_log_are_read(tmp_path: Path, left: str) -> None:
    with Workspace(tmp_path / "workspace") as place, place.engine.connect() as writer:
        writer.exec_driver_sql("PRAGMA wal_autocheckpoint = 0")
        with engine.writing(place.engine) as session:
            session.add(rows.robot())
        if left != "at work":
            writer.close()
            file = place.folder / "irtwin.db"
            parts = {part: part.read_bytes() for part in (file.with_name(file.name + ending) for ending in LEFT[left])}
            place.close()
            for part, content in parts.items():
                part.write_bytes(content)
        given_away(place.folder)
        assert without_rights(WORKSPACE_OF_ANOTHER, place.folder) == ["1"]


def test_what_may_be_written_is_opened_as_ever(tmp_path: Path) -> None:
    with Workspace(tmp_path) as place:
        assert not may_only_be_read(tmp_path / "irtwin.db") and not engine.is_read_only(place.engine)


def test_a_copy_goes_with_its_last_connection(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = tmp_path / "some.db"
    with closing(sqlite3.connect(file)) as connection:
        connection.execute("CREATE TABLE a (b)")
    monkeypatch.setattr("irtwin.storage.read_only._opening", _refusing(file))
    connect = connecting(file)
    with closing(connect()) as connection:
        (copy,) = [Path(row[2]) for row in connection.execute("PRAGMA database_list")]
        assert connection.execute("SELECT count(*) FROM a").fetchone() == (0,)
    assert copy.exists() and copy != file
    del connect
    assert not copy.exists()


def _refusing(file: Path) -> Callable[[Path], Callable[[], sqlite3.Connection]]:
    """Open databases as SQLite does where it cannot make the files of the log beside `file`."""

    def opening(asked: Path) -> Callable[[], sqlite3.Connection]:
        def connect() -> sqlite3.Connection:
            if asked == file:
                raise sqlite3.OperationalError("unable to open database file")
            return sqlite3.connect(asked)

        return connect

    return opening

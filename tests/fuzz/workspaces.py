"""Ways in which the folder of a workspace, or of a fleet's results, is not what irtwin made."""

from __future__ import annotations

import json
import os
import shutil
import sqlite3
from collections.abc import Callable
from contextlib import closing
from pathlib import Path

import numpy as np
from tests.fuzz.tables_of_toml import FILES, toml
from tests.fuzz.values import as_json, odd, some

_JOURNALS = ("arm.live_9", "nobody.live_1", "..", "arm", "arm.x y", "é", "x" * 200)


def _path(folder: Path, rng: np.random.Generator) -> Path:
    """Return something in the folder; of a graph's many files as seldom one as of others."""
    kinds = {"/".join(path.relative_to(folder).parts[:1]): path for path in folder.rglob("*")}
    top = folder / some(rng, sorted(kinds))
    below = sorted(top.rglob("*")) if top.is_dir() else []
    return below[rng.integers(len(below))] if below and rng.integers(5) else top


def _remove(path: Path) -> None:
    if path.is_dir() and not path.is_symlink():
        shutil.rmtree(path)
    else:
        path.unlink()


def _link(folder: Path, rng: np.random.Generator) -> None:
    """Put a link in place of a file or a folder."""
    path, outside = _path(folder, rng), folder.parents[1]
    is_folder = path.is_dir()
    copy = folder.parent / "moved"
    if rng.integers(3) == 0:  # what is there, elsewhere
        shutil.move(path, copy)
    else:
        _remove(path)
        places = ["", "etc"] if is_folder else ["secret.toml", "x.json", "etc/passwd", "/dev/zero", "/dev/null"]
        copy = some(rng, [*(outside / place for place in places), Path("nowhere"), path])
    path.symlink_to(copy)


def _garbage(folder: Path, rng: np.random.Generator) -> None:
    """Put something else into a file, or a part of it."""
    path = _path(folder, rng)
    if not path.is_file():
        return
    text = path.read_bytes()
    where = int(rng.integers(len(text) + 1))
    odd_texts = [b"", b"[" * 100_000, b"{}", b"[]", b"null", rng.bytes(len(text)), text[:where], text * 2, b"\0" * 4096]
    path.write_bytes(some(rng, [*odd_texts, text[:where] + rng.bytes(4) + text[where + 4 :]]))


def _values(folder: Path, rng: np.random.Generator) -> None:
    """Change a value in a file of JSON."""
    files = [path for path in sorted(folder.rglob("*")) if path.suffix in (".json", ".jsonl") and path.is_file()]
    path = some(rng, files)
    lines = path.read_text().splitlines() if path.suffix == ".jsonl" else [path.read_text()]
    place = int(rng.integers(len(lines)))
    said = inner = json.loads(lines[place])
    while isinstance(inner, dict | list) and inner:
        key = some(rng, inner if isinstance(inner, dict) else range(len(inner)))
        if not (isinstance(inner[key], dict | list) and inner[key]) or rng.integers(6) == 0:
            inner[key] = odd(rng)
            break
        inner = inner[key]
    lines[place] = as_json(said)
    path.write_text("\n".join(lines), encoding="utf-8", errors="surrogatepass")


def _other_kind(folder: Path, rng: np.random.Generator) -> None:
    """Put a folder in place of a file, a file in place of a folder, a pipe, or nothing."""
    path = _path(folder, rng)
    was_folder, how = path.is_dir(), rng.integers(3)
    _remove(path)
    if how == 0 and was_folder:
        path.write_text("x")
    elif how == 0:
        path.mkdir()
    elif how == 1:
        os.mkfifo(path)


def _rows(folder: Path, rng: np.random.Generator) -> None:
    """Change values in the database, as another program may."""
    with closing(sqlite3.connect(folder / "irtwin.db")) as database:
        tables = [name for (name,) in database.execute("SELECT name FROM sqlite_master WHERE type = 'table'")]
        table = some(rng, [name for name in tables if database.execute(f"SELECT 1 FROM {name}").fetchone()])
        columns = [row[1] for row in database.execute(f"PRAGMA table_info({table})")]
        for _ in range(rng.integers(1, 3)):
            value = odd(rng)
            if isinstance(value, int) and abs(value) >= 1 << 63:
                value = float(min(value, 1 << 900))
            if isinstance(value, list | dict):
                value = b"\xff\x00blob"
            if isinstance(value, str):
                value = value.replace("\ud800", "\x80").replace("OUTSIDE", str(folder.parents[1]))
            where = "" if rng.integers(2) else f"WHERE rowid = (SELECT max(rowid) FROM {table})"
            database.execute(f"UPDATE OR IGNORE {table} SET {some(rng, columns)} = ? {where}", (value,))
        database.commit()


def _schema(folder: Path, rng: np.random.Generator) -> None:
    """Change the tables of a database: one gone, renamed, another's, a view, a trigger, an index that is none."""
    name = some(rng, ["irtwin.db", "irtwin.db", "mapped_rows.db"])
    with closing(sqlite3.connect(folder / name)) as database:
        tables = [one for (one,) in database.execute("SELECT name FROM sqlite_master WHERE type = 'table'")]
        table = some(rng, tables)
        column = some(rng, [row[1] for row in database.execute(f"PRAGMA table_info({table})")])
        words = [
            f"DROP TABLE {table}",
            f"ALTER TABLE {table} RENAME TO other",
            f"ALTER TABLE {table} RENAME COLUMN {column} TO other",
            f"ALTER TABLE {table} ADD COLUMN other TEXT DEFAULT 'x'",
            f"ALTER TABLE {table} RENAME TO other; CREATE VIEW {table} AS SELECT * FROM other",
            f"ALTER TABLE {table} RENAME TO other; CREATE VIEW {table} AS WITH RECURSIVE c(a) AS "
            f"(SELECT 1 UNION ALL SELECT a + 1 FROM c) SELECT other.* FROM other, c",
            f"CREATE TRIGGER t AFTER UPDATE ON {table} BEGIN DELETE FROM {table}; END",
            f"CREATE TRIGGER t BEFORE DELETE ON {table} BEGIN SELECT RAISE(ABORT, 'no'); END",
            f"DELETE FROM {table}",
            "UPDATE alembic_version SET version_num = '9999'",
            "CREATE TABLE stranger (x)",
            "PRAGMA user_version = 99; PRAGMA journal_mode = WAL",
        ]
        database.executescript(some(rng, words))


def _settings(folder: Path, rng: np.random.Generator) -> None:
    """Put a settings file there."""
    name = some(rng, FILES)
    (folder / name).write_bytes(toml(name, rng))


def _left_over(folder: Path, rng: np.random.Generator) -> None:
    """Put there what a process may have left behind: a journal, alarms that were told, folders of work."""
    how = rng.integers(3)
    if how == 0:
        header = {"run_id": "arm.live_9", "robot_id": "arm", "payload_kg": 0.0, "columns": ["time", "q_joint_1"]}
        for _ in range(rng.integers(3)):
            header[some(rng, header)] = odd(rng)
        content = as_json(header).encode("utf-8", "surrogatepass") + b"\n" + rng.bytes(int(rng.integers(200)))
        (folder / "live" / f"{some(rng, _JOURNALS)}.journal").write_bytes(content)
    elif how == 1:
        (folder / "alarms").mkdir()
        alarm = {"robot": "arm", "run": "live_1", "rule": "twin_alarm", "since": "2026-03-01T12:00:00+00:00"}
        alarm |= {"channel": "torque", "joint": "joint_2", "until": "", "state": "active", "reason": "x"}
        alarm[some(rng, alarm)] = odd(rng)
        texts = [as_json([alarm]), "{", as_json([odd(rng)]), "[" * 5000, as_json({"x": odd(rng)})]
        (folder / "alarms" / "told.json").write_text(some(rng, texts), encoding="utf-8", errors="surrogatepass")
    else:
        left = folder / some(rng, [".backup-x", ".repair-x", "graph.damaged", ".graph.turn", "reports/.x.tmp"])
        if rng.integers(2):
            left.unlink(missing_ok=True)
            left.symlink_to(some(rng, [folder.parents[1], folder.parents[1] / "etc", Path("nowhere")]))
        else:
            left.mkdir(exist_ok=True) if not left.exists() else None


WAYS: dict[str, Callable[[Path, np.random.Generator], None]] = {
    "link": _link,
    "garbage": _garbage,
    "values": _values,
    "other kind": _other_kind,
    "rows": _rows,
    "schema": _schema,
    "settings": _settings,
    "left over": _left_over,
}
OF_FOLDERS = {name: WAYS[name] for name in ("link", "garbage", "values", "other kind")}

from __future__ import annotations

import sqlite3
from contextlib import closing
from pathlib import Path

import pytest
from sqlalchemy import text
from sqlalchemy.exc import IntegrityError

from irtwin.errors import InputError
from irtwin.storage import engine


@pytest.mark.slow
def test_a_password_never_shows() -> None:
    with pytest.raises(InputError) as caught:
        engine.open_engine("postgresql://me:secret@127.0.0.1:1/none?connect_timeout=2")
    assert "postgresql+psycopg://me:***@127.0.0.1:1/none" in str(caught.value)
    assert "cannot open the database" in str(caught.value)
    assert "secret" not in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("url", ["no url:secret", ""])
def test_a_url_that_cannot_be_read(url: str) -> None:
    with pytest.raises(InputError, match="the database URL cannot be read") as caught:
        engine.open_engine(url)
    assert "secret" not in str(caught.value)


def test_an_unknown_driver_is_named() -> None:
    with pytest.raises(InputError, match=r"nosuch://me:\*\*\*@host/db: no driver for this database"):
        engine.open_engine("nosuch://me:secret@host/db")


def test_a_missing_sqlite_file_is_not_made(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no such SQLite database"):
        engine.open_engine(f"sqlite:///{tmp_path}/none.db", must_exist=True)
    assert list(tmp_path.iterdir()) == []


def test_a_file_that_is_no_database(tmp_path: Path) -> None:
    (tmp_path / "text.db").write_text("no database at all, only some text " * 50)
    with pytest.raises(InputError, match="file is not a database"):
        engine.open_engine(f"sqlite:///{tmp_path}/text.db")


def test_a_writer_commits_all_or_nothing(tmp_path: Path) -> None:
    database = engine.open_engine(f"sqlite:///{tmp_path}/a.db")
    with engine.writing(database) as session:
        session.execute(text("CREATE TABLE one (a INTEGER PRIMARY KEY)"))
    with pytest.raises(IntegrityError), engine.writing(database) as session:
        session.execute(text("INSERT INTO one VALUES (1)"))
        session.execute(text("INSERT INTO one VALUES (1)"))
    with database.connect() as connection:
        assert connection.scalar(text("SELECT count(*) FROM one")) == 0


def test_foreign_keys_hold_in_sqlite(tmp_path: Path) -> None:
    database = engine.open_engine(f"sqlite:///{tmp_path}/a.db")
    with database.connect() as connection:
        assert connection.scalar(text("PRAGMA foreign_keys")) == 1


def test_a_second_writer_waits_then_says_so(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(engine, "BUSY_TIMEOUT", 0.1)
    one, two = (engine.open_engine(f"sqlite:///{tmp_path}/a.db") for _ in range(2))
    with (
        engine.writing(one),
        pytest.raises(InputError, match=r"another process has been writing for 0\.1 s; try again later"),
        engine.writing(two),
    ):
        pass


def test_a_large_file_is_not_looked_through_at_opening(tmp_path: Path) -> None:
    opened = engine.open_engine(f"sqlite:///{tmp_path / 'large.db'}")
    with opened.begin() as connection:
        connection.execute(text("CREATE TABLE number (value INTEGER)"))
        connection.execute(text("INSERT INTO number VALUES " + ", ".join(f"({value})" for value in range(5000))))
    opened.dispose()
    content = (tmp_path / "large.db").read_bytes()
    (tmp_path / "large.db").write_bytes(content[:4096] + bytes(4096) + content[8192:])
    with pytest.raises(InputError, match="damaged"):
        engine.check(opened)
    engine.check(opened, len(content) - 1)
    with pytest.raises(InputError, match="damaged"), opened.connect() as connection:
        connection.execute(text("SELECT sum(value) FROM number")).one()


@pytest.mark.parametrize(
    ("spoilt", "sql"),
    [
        (b"t_AAAA", "SELECT name FROM sqlite_master"),
        (b"c_AAAA", "SELECT * FROM t_AAAA"),
        (b"c_AAAA", "PRAGMA table_info(t_AAAA)"),
        (b"v_AAAA", "SELECT * FROM t_AAAA"),
        (b"w_AAAA", "SELECT * FROM shown"),
    ],
    ids=["table", "column", "column's description", "value", "view"],
)
def test_text_that_is_not_utf8_is_told(tmp_path: Path, spoilt: bytes, sql: str) -> None:
    file = tmp_path / "odd.db"
    with closing(sqlite3.connect(file)) as made:
        made.execute("CREATE TABLE t_AAAA (c_AAAA TEXT)")
        made.execute("INSERT INTO t_AAAA VALUES ('v_AAAA')")
        made.execute("CREATE VIEW shown AS SELECT w_AAAA FROM t_AAAA")
        made.commit()
    file.write_bytes(file.read_bytes().replace(spoilt, spoilt[:2] + b"\xff\xfe\xff\xfe"))
    database = engine.open_engine(f"sqlite:///{file}")
    with database.connect() as connection, pytest.raises(InputError, match=r"odd\.db: holds text that is not UTF-8"):
        connection.exec_driver_sql(sql).fetchall()

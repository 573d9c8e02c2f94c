"""The fleet that reasoning is measured on fits the tables as they are."""

from __future__ import annotations

import sqlite3
from pathlib import Path

import fleet


def test_a_made_fleet_is_taken_by_the_tables(tmp_path: Path) -> None:
    fleet.make_database(tmp_path, robots=2, runs=3)
    with sqlite3.connect(tmp_path / "irtwin.db") as connection:
        assert connection.execute("SELECT count(*) FROM run").fetchone() == (6,)
        assert connection.execute("PRAGMA foreign_key_check").fetchall() == []

"""Rows given by hand become what the same rows become from the database."""

from __future__ import annotations

from pathlib import Path

import pytest
from tests.knowledge.test_mapping import PREFIXES, mapped, person

from irtwin.knowledge.mapping import RowMapper
from irtwin.storage.engine import open_engine

ROWS = [
    {"id": 1, "name": "Ada", "boss": None, 'Odd "name': "x", "Shoe": 40},
    {"id": 2, "name": "Bo & Co/é", "boss": 1, 'Odd "name': None, "Shoe": 41},
]
MAPPING = person('rr:objectMap [ rr:column "name" ], [ rr:column "\\"Shoe\\"" ]')


def row_mapper(folder: Path, mapping: str) -> RowMapper:
    document = folder / "a.r2rml.ttl"
    document.write_text(PREFIXES + mapping)
    return RowMapper(open_engine(f"sqlite:///{folder}/a.db"), [document])


def test_rows_become_what_the_database_would_give(tmp_path: Path) -> None:
    from_database = mapped(tmp_path, MAPPING)
    assert {str(quad) for quad in row_mapper(tmp_path, MAPPING).quads("person", ROWS)} == from_database


def test_a_row_may_lack_columns(tmp_path: Path) -> None:
    mapped(tmp_path, MAPPING)
    found = row_mapper(tmp_path, MAPPING).quads("person", [{"id": 3, "name": "Cy"}, {"name": "nobody"}])
    assert [str(quad) for quad in found] == ['<http://example.com/3> <http://example.com/p> "Cy"']


def test_only_tables_by_name(tmp_path: Path) -> None:
    mapping = MAPPING + person('rr:object "q"', table='rr:sqlQuery "SELECT * FROM person"').replace("<#P>", "<#Q>")
    mapped(tmp_path, mapping)
    mapper = row_mapper(tmp_path, mapping)
    assert not any('"q"' in str(quad) for quad in mapper.quads("person", ROWS))
    with pytest.raises(ValueError, match="no mapping document reads table 'robot' by its name"):
        list(mapper.quads("robot", []))

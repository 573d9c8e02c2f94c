"""The W3C's R2RML test cases, as they are, on SQLite and on PostgreSQL.

Positive cases: the mapped dataset is the expected one up to names of blank nodes; negative ones: an InputError.
"""

from __future__ import annotations

import re
import sqlite3
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
from pyoxigraph import CanonicalizationAlgorithm, Dataset, Quad, RdfFormat, parse
from rdflib import Graph, Namespace
from sqlalchemy import Engine, create_engine

from irtwin.errors import InputError
from irtwin.knowledge.mapping import map_database

SUITE = Path(__file__).parents[3] / "shared" / "conformance" / "r2rml"
TEST = Namespace("http://purl.org/NET/rdb2rdf-test#")
DC = Namespace("http://purl.org/dc/elements/1.1/")
BASE = "http://example.com/base/"

pytestmark = [pytest.mark.system, pytest.mark.skipif(not SUITE.is_dir(), reason="the W3C suite is not there")]


@dataclass(frozen=True)
class Case:
    name: str
    database: Path  # create.sql
    mapping: Path
    expected: Path | None  # None where an error is expected


def cases() -> Iterator[Case]:
    for manifest in sorted(SUITE.glob("*/manifest.ttl")):
        graph = Graph().parse(manifest)
        for node in graph.subjects(None, TEST.R2RML):

            def value(name: str, node: Any = node, graph: Graph = graph) -> str:
                return str(graph.value(node, TEST[name]))

            yield Case(
                name=str(graph.value(node, DC.identifier)),
                database=manifest.with_name("create.sql"),
                mapping=manifest.with_name(value("mappingDocument")),
                expected=manifest.with_name(value("output")) if value("hasExpectedOutput") == "true" else None,
            )


CASES = sorted(cases(), key=lambda case: case.name)
each_case = pytest.mark.parametrize("case", CASES, ids=[case.name for case in CASES])


def canonical(quads: Iterator[Quad]) -> set[str]:
    dataset = Dataset(quads)
    dataset.canonicalize(CanonicalizationAlgorithm.RDFC_1_0)
    return {str(quad) for quad in dataset}


def check(case: Case, engine: Engine) -> None:
    if case.expected is None:
        with pytest.raises(InputError):
            list(map_database(engine, [case.mapping], BASE))
    else:
        expected = parse(case.expected.read_bytes(), RdfFormat.N_QUADS)
        assert canonical(map_database(engine, [case.mapping], BASE)) == canonical(expected)


def test_the_suite_is_whole() -> None:
    assert len(CASES) == 63
    assert sum(case.expected is None for case in CASES) == 13


@each_case
def test_on_sqlite(case: Case, tmp_path: Path) -> None:
    with sqlite3.connect(tmp_path / "a.db") as connection:
        connection.executescript(case.database.read_text())
    check(case, create_engine(f"sqlite:///{tmp_path}/a.db"))


def in_postgresql(script: str) -> str:
    """PostgreSQL has its own name and notation for binary strings."""
    return re.sub(r"X'([0-9A-F]+)'", r"'\\x\1'", script).replace("VARBINARY(200)", "BYTEA")


@pytest.fixture(scope="module")
def postgresql(new_postgresql_database: Callable[[], str]) -> Callable[[Path], Engine]:
    """Give a function that loads a case's database, each once."""
    engines: dict[Path, Engine] = {}

    def load(script: Path) -> Engine:
        if script not in engines:
            engines[script] = create_engine(new_postgresql_database())
            with engines[script].begin() as connection:
                connection.exec_driver_sql(in_postgresql(script.read_text()), execution_options={"no_parameters": True})
        return engines[script]

    return load


@each_case
def test_on_postgresql(case: Case, postgresql: Callable[[Path], Engine]) -> None:
    check(case, postgresql(case.database))

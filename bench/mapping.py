"""How long the mapping takes: 100,000 rows to 400,000 quads in the store, how much memory, and what ten changes cost.

python bench/mapping.py [ROWS]
"""

from __future__ import annotations

import resource
import sqlite3
import sys
import tempfile
import time
from pathlib import Path

from pyoxigraph import Store
from sqlalchemy import Engine

from irtwin.knowledge.mapping import map_database, refresh
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.storage.engine import open_engine

MAPPING = """
@prefix rr: <http://www.w3.org/ns/r2rml#> .
@prefix ex: <http://example.com/> .
<#Reading> rr:logicalTable [ rr:tableName "reading" ] ;
    rr:subjectMap [ rr:template "http://example.com/reading/{robot}/{number}" ; rr:class ex:Reading ;
        rr:graphMap [ rr:template "https://w3id.org/irtwin/graph/source/{robot}" ] ] ;
    rr:predicateObjectMap [ rr:predicate ex:of ; rr:objectMap [ rr:template "http://example.com/robot/{robot}" ] ] ;
    rr:predicateObjectMap [ rr:predicate ex:power ; rr:objectMap [ rr:column "power" ] ] ;
    rr:predicateObjectMap [ rr:predicate ex:state ; rr:objectMap [ rr:column "state" ] ] .
"""


def make_database(path: Path, rows: int) -> None:
    with sqlite3.connect(path) as connection:
        connection.execute(
            "CREATE TABLE reading (number INTEGER PRIMARY KEY, robot VARCHAR, power FLOAT, state VARCHAR)"
        )
        connection.executemany(
            "INSERT INTO reading VALUES (?, ?, ?, ?)",
            ((row, f"robot {row % 100}", row * 0.37, "moving" if row % 3 else "idle") for row in range(rows)),
        )


def main(rows: int) -> None:
    with tempfile.TemporaryDirectory() as folder:
        database, mapping = Path(folder, "readings.db"), Path(folder, "readings.r2rml.ttl")
        make_database(database, rows)
        mapping.write_text(MAPPING)
        engine = open_engine(f"sqlite:///{database}")
        before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        started = time.perf_counter()
        count = sum(1 for _ in map_database(engine, [mapping]))
        mapped = time.perf_counter() - started
        grown = (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) / 1024
        print(f"{rows} rows -> {count} quads: {mapped:.2f} s, memory grew by {grown:.1f} MB")
        for name, store in (("memory", Store()), ("disk", Store(str(Path(folder, "graph"))))):
            started = time.perf_counter()
            store.bulk_extend(map_database(engine, [mapping]))
            print(f"into a store in {name}: {time.perf_counter() - started:.2f} s, {len(store)} quads")
        incremental(engine, database, mapping, Path(folder))


def incremental(engine: Engine, database: Path, mapping: Path, folder: Path) -> None:
    """A first run into the graph on disk, one without changes, and one after ten: updates, inserts and deletions."""
    changes = [
        *(f"UPDATE reading SET power = power - 1 WHERE number = {row}" for row in range(0, 4000, 1000)),
        "DELETE FROM reading WHERE number IN (SELECT number FROM reading WHERE number % 1000 = 1 LIMIT 3)",
        *["INSERT INTO reading (robot, power, state) VALUES ('robot 7', 0.5, 'idle')"] * 3,
    ]
    graph = KnowledgeGraph(folder / "refreshed")
    for what, statements in (("first run", []), ("no change", []), ("ten changed rows", changes)):
        with sqlite3.connect(database) as connection:
            for statement in statements:
                connection.execute(statement)
        started = time.perf_counter()
        refresh(graph, engine, [mapping], folder / "rows.db")
        print(f"{what}: {time.perf_counter() - started:.3f} s")
    print(f"the remembered rows take {(folder / 'rows.db').stat().st_size / 1e6:.0f} MB")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 100_000)

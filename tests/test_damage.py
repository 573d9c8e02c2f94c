"""A workspace whose files were lost or altered: each command answers, or says in one line what to do."""

from __future__ import annotations

import random
import shutil
import sqlite3
import subprocess
import sys
from collections.abc import Callable
from contextlib import closing
from pathlib import Path

import numpy as np
import pytest
from sqlalchemy import select

from irtwin import rewriting
from irtwin.knowledge.mapping import refresh
from irtwin.knowledge.store import snapshot
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.providers.records import ingest
from irtwin.signals.log import read_data_set
from irtwin.storage.database import Workspace
from irtwin.storage.journal import Header, Journal
from irtwin.storage.schema import LIVE, Base
from tests.data_sets import irtwin, refused_in_a_line
from tests.mapped import MAPPINGS
from tests.small_robots import data_set
from tests.trusting import trust_all

pytestmark = pytest.mark.slow

COUNT = "SELECT (COUNT(*) AS ?count) { ?s ?p ?o }"
NAMES = "SELECT ?name { ?robot irt:IR_Name ?name } ORDER BY ?name"
Damage = Callable[[Path], object]


def flip(file: Path) -> None:
    content = bytearray(file.read_bytes())
    middle = len(content) // 2
    content[middle : middle + 16] = bytes(255 - byte for byte in content[middle : middle + 16])
    file.write_bytes(content)


DAMAGES: dict[str, Damage] = {
    "deleted": Path.unlink,
    "empty": lambda file: file.write_bytes(b""),
    "cut": lambda file: file.write_bytes(file.read_bytes()[: file.stat().st_size // 2]),
    "flipped": flip,
    "random": lambda file: file.write_bytes(random.Random(3).randbytes(file.stat().st_size)),
}


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A workspace with two robots taken in and mapped."""
    folder = tmp_path_factory.mktemp("made")
    with Workspace(folder / "workspace") as place:
        for seed, name in enumerate(("First", "Second arm"), start=1):
            ingest(place, read_data_set(data_set(folder / name, name, seed=seed)))
        with KnowledgeGraph(place.graph_folder) as graph:
            graph.load_ontology()
            refresh(graph, place.engine, MAPPINGS, place.mapped_rows)
    return folder / "workspace"


@pytest.fixture(autouse=True)
def little_patience(monkeypatch: pytest.MonkeyPatch) -> None:
    """Take files that do not belong together for damaged after half a second, not five: nobody writes to them here."""
    monkeypatch.setattr(snapshot, "_PATIENCE", 0.5)


@pytest.fixture
def workspace(made: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(made, tmp_path / "workspace"))


def asked(workspace: Path, question: str) -> str:
    said = irtwin("query", question, "--workspace", workspace, "--format", "csv")
    assert said.status == 0, said.err
    return said.out


def one_line(workspace: Path, *arguments: object) -> str:
    return refused_in_a_line(*arguments, "--workspace", workspace)


def tables(workspace: Path) -> list[Path]:
    return sorted((workspace / "graph").glob("*.sst"))


@pytest.mark.parametrize("damage", DAMAGES)
def test_a_damaged_table_of_the_graph_is_told_before_it_is_read(workspace: Path, damage: str) -> None:
    for file in tables(workspace):
        content = file.read_bytes()
        DAMAGES[damage](file)
        assert f"`irtwin workspace repair --workspace {workspace}`" in one_line(workspace, "query", COUNT)
        file.write_bytes(content)
    assert asked(workspace, NAMES)


@pytest.mark.parametrize("damage", DAMAGES)
@pytest.mark.parametrize("pattern", ["CURRENT", "MANIFEST-*"])
def test_the_files_that_a_graph_begins_with(workspace: Path, pattern: str, damage: str) -> None:
    (file,) = (workspace / "graph").glob(pattern)
    DAMAGES[damage](file)
    backup, export = ("workspace", "backup", workspace / "kept.zip"), ("export", "--owl", workspace / "x.owl")
    for command in (("query", COUNT), backup, export):
        assert "`irtwin workspace repair --workspace" in one_line(workspace, *command)


@pytest.mark.parametrize("damage", DAMAGES)
def test_a_log_of_the_graph_holds_nothing_once_it_is_closed(made: Path, workspace: Path, damage: str) -> None:
    for file in (workspace / "graph").glob("*.log"):
        if file.stat().st_size or damage in ("deleted", "random"):
            DAMAGES[damage](file)
    assert asked(workspace, COUNT) == asked(made, COUNT)


def test_a_lost_graph_is_not_begun_anew_in_silence(workspace: Path) -> None:
    shutil.rmtree(workspace / "graph")
    for command in (("query", COUNT), ("workspace", "backup", workspace / "kept.zip"), ("workspace", "drop", "First")):
        assert "graph is missing" in one_line(workspace, *command)
    assert not (workspace / "graph").exists()


@pytest.mark.parametrize("damage", [each for each in DAMAGES if each != "flipped"])  # SQLite sums no contents
def test_a_damaged_database_is_told(workspace: Path, damage: str) -> None:
    DAMAGES[damage](workspace / "irtwin.db")
    for command in (("repair",), ("backup", workspace / "kept.zip"), ("drop", "First")):
        assert "`irtwin workspace restore ARCHIVE --workspace NEW`" in one_line(workspace, "workspace", *command)
    assert asked(workspace, NAMES)  # the graph is whole


def test_a_database_that_lacks_a_table_is_told(workspace: Path) -> None:
    with Workspace(workspace) as place, place.engine.begin() as connection:
        connection.exec_driver_sql("DROP TABLE joint_energy")
    assert "table joint_energy is missing" in one_line(workspace, "workspace", "drop", "First")


@pytest.mark.parametrize("damage", DAMAGES)
def test_damaged_remembered_rows_are_made_anew(made: Path, workspace: Path, damage: str) -> None:
    """Though a robot goes at the same time, whose rows are looked up in them."""
    DAMAGES[damage](workspace / "mapped_rows.db")
    with Workspace(workspace) as place:
        place.drop_robot("First")
        with KnowledgeGraph.of_workspace(place) as graph:
            refresh(graph, place.engine, MAPPINGS, place.mapped_rows)
    assert asked(workspace, NAMES).split() == ["name", "Second", "arm"]


@pytest.fixture
def unreasoned(monkeypatch: pytest.MonkeyPatch) -> None:
    """Reasoning has tests of its own, and takes long."""
    monkeypatch.setattr(rewriting, "conclude", lambda graph, announce: None)
    monkeypatch.setattr(rewriting, "populate_others", lambda place, graph, announce: False)


@pytest.mark.parametrize("damage", ["none", "flipped", "folder"])
def test_repair_makes_the_graph_of_the_database(made: Path, workspace: Path, unreasoned: None, damage: str) -> None:
    if damage == "flipped":
        flip(tables(workspace)[-1])
    elif damage == "folder":
        shutil.rmtree(workspace / "graph")
    said = irtwin("workspace", "repair", "--workspace", workspace)
    assert said.status == 0, said.err
    assert asked(workspace, COUNT) == asked(made, COUNT)
    assert asked(workspace, NAMES) == asked(made, NAMES)
    assert not (workspace / "graph.damaged").exists()
    assert not list(workspace.glob(".*"))


def test_repair_looks_through_what_extends_a_workspace(workspace: Path) -> None:
    shape = workspace / "shapes" / "mine.ttl"
    shape.parent.mkdir()
    shape.write_text(
        "@prefix sh: <http://www.w3.org/ns/shacl#> . <urn:s> a sh:NodeShape ; sh:targetNode <urn:x> ; "
        'sh:sparql [ sh:select "SELECT $this { SERVICE <http://h/> { $this ?a ?b } }" ] .'
    )
    trust_all(workspace)
    assert f"{shape}, line 1: its SPARQL is none: column 16: SERVICE" in one_line(workspace, "workspace", "repair")


def test_repair_says_which_files_are_lost(workspace: Path, unreasoned: None) -> None:
    file = next((workspace / "series").iterdir())
    file.unlink()
    said = irtwin("workspace", "repair", "--workspace", workspace)
    assert said.status == 2
    robots = said.err.count(f"  series/{file.name} of ")  # those whose logs are this one
    assert robots and f"the graph is rebuilt, but files are missing or altered ({robots})" in said.err


def test_a_graph_in_use_is_not_repaired(workspace: Path) -> None:
    code = "import sys; from pyoxigraph import Store; store = Store(sys.argv[1]); print(flush=True); sys.stdin.read()"
    command = [sys.executable, "-c", code, str(workspace / "graph")]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as process:
        assert process.stdout is not None
        process.stdout.readline()
        assert "another process has the graph open; stop it first" in one_line(workspace, "workspace", "repair")
        process.kill()


def test_a_live_run_that_a_crash_left_is_dropped_by_its_name(workspace: Path, unreasoned: None) -> None:
    header = Header("First.live_1", "First", 0.0, ("time", "q_joint_1"))
    journal = Journal(workspace / LIVE, header)
    journal.append(np.array([[1e9, 0.0], [1e9 + 1, 0.1]]))
    drop = ("workspace", "drop", "First", "--run", "live_1")
    assert '"live_1" is being watched; stop `irtwin live` first' in one_line(workspace, *drop)
    journal.close()
    assert irtwin(*drop, "--workspace", workspace).status == 0
    assert not list((workspace / LIVE).iterdir())
    assert 'the robot has no run "live_1"; the nearest is' in one_line(workspace, *drop)
    assert asked(workspace, NAMES).split() == ["name", "First", "Second", "arm"]


def test_a_dropped_robot_is_forgotten(workspace: Path, unreasoned: None) -> None:
    report = workspace / "reports" / "First.html"
    report.parent.mkdir()
    report.write_text("<html>")
    assert 'no robot "Frist" here; the nearest is "First"' in one_line(workspace, "workspace", "drop", "Frist")
    assert irtwin("workspace", "drop", "First", "--workspace", workspace).status == 0
    assert not report.exists()
    with Workspace(workspace) as place, place.reading() as session:
        for table in Base.metadata.sorted_tables:
            assert not [row for row in session.execute(select(table)) if "First" in str(row)]
        assert len(list((workspace / "series").iterdir())) == 3
    assert asked(
        workspace, 'SELECT ?s { ?s ?p ?o FILTER(CONTAINS(STR(?s), "/First") || STR(?o) = "First") }'
    ).split() == ["s"]
    assert irtwin("workspace", "drop", "Second arm", "--workspace", workspace).status == 0
    assert asked(workspace, NAMES).split() == ["name"]


def test_a_row_that_leads_outside_removes_nothing_there(workspace: Path, tmp_path: Path) -> None:
    (tmp_path / "mine.html").write_text("mine")
    (tmp_path / "mine.run.journal").write_text("mine")
    with closing(sqlite3.connect(workspace / "irtwin.db")) as database:
        for table in Base.metadata.sorted_tables:
            if "robot_id" in table.columns:
                database.execute(f"UPDATE {table.name} SET robot_id = '../../mine' WHERE robot_id = 'First'")
        database.commit()
    changed = "a row of table robot was changed by another program: robot_id '../../mine'"
    assert changed in one_line(workspace, "workspace", "drop", "First")
    assert (tmp_path / "mine.html").read_text() == (tmp_path / "mine.run.journal").read_text() == "mine"

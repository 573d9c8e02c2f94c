"""A workspace in one file, and back."""

from __future__ import annotations

import hashlib
import json
import math
import subprocess
import sys
import zipfile
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from pyoxigraph import NamedNode, Triple
from sqlalchemy import func, select
from tests import rows
from tests.mapped import map_into

from irtwin.errors import InputError
from irtwin.input_file import checksum
from irtwin.knowledge.store.backup import backup, restore
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.knowledge.store.named_graphs import in_graph
from irtwin.knowledge.vocabulary import GRAPH_SOURCE
from irtwin.location import Location
from irtwin.storage import database
from irtwin.storage.database import Workspace
from irtwin.storage.schema import Base, Series

pytestmark = pytest.mark.slow

State = tuple[dict[str, list[tuple[object, ...]]], dict[str, str], int]


def fill(place: Workspace) -> None:
    place.ingest(*rows.data_set())
    rows.identify(place, f"{rows.ROBOT}.abc")
    report = place.report_path(rows.ROBOT)
    report.parent.mkdir()
    report.write_text("<html>")
    (place.folder / "plant.toml").write_text("co2_kg_per_kwh = 0.4\n")
    with KnowledgeGraph(place.graph_folder) as graph:
        graph.load_ontology()
        map_into(graph, place)


def state(place: Workspace) -> State:
    """Return all rows, the checksums of all files, and how many triples the graph has."""
    with place.reading() as session:
        tables = {
            table.name: sorted((tuple(row) for row in session.execute(select(table))), key=str)
            for table in Base.metadata.sorted_tables
        }
    files = {
        str(file.relative_to(place.folder)): checksum(file)
        for folder in ("series", "twins", "reports")
        for file in (place.folder / folder).glob("*")
    }
    files["plant.toml"] = checksum(place.folder / "plant.toml")
    with KnowledgeGraph(place.graph_folder) as graph:
        return tables, files, len(graph.triples()) + sum(len(graph.triples(name)) for name in graph.graphs())


@pytest.fixture(scope="module")
def filled(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Workspace]:
    with Workspace(tmp_path_factory.mktemp("backup") / "before") as place:
        fill(place)
        yield place


@pytest.fixture(scope="module")
def kept(filled: Workspace) -> bytes:
    return backed_up(filled, filled.folder.with_name("kept.zip")).read_bytes()


def backed_up(place: Workspace, archive: Path) -> Path:
    with KnowledgeGraph(place.graph_folder) as graph:
        backup(place, graph, archive)
    return archive


@pytest.fixture
def archive(kept: bytes, tmp_path: Path) -> Path:
    (tmp_path / "kept.zip").write_bytes(kept)
    return tmp_path / "kept.zip"


def test_what_is_restored_is_what_was_kept(filled: Workspace, archive: Path, tmp_path: Path) -> None:
    restore(archive, tmp_path / "after")
    with Workspace.existing(tmp_path / "after") as place:
        assert state(place) == state(filled)
        assert place.read_series(f"{rows.ROBOT}.work").equals(rows.samples(1))
        assert place.ingest(*rows.data_set()) == "unchanged"
    left = {path.name for path in (tmp_path / "after").iterdir()}
    assert left <= {"irtwin.db", "irtwin.db-wal", "irtwin.db-shm", "series", "twins", "reports", "graph", "plant.toml"}
    assert not [path for path in tmp_path.rglob(".*")]


@pytest.mark.system
def test_into_postgresql_and_back(
    filled: Workspace, archive: Path, tmp_path: Path, new_postgresql_database: Callable[[], str]
) -> None:
    url = new_postgresql_database()
    restore(archive, Location(tmp_path / "after", url))
    with Workspace(tmp_path / "after", url) as place:
        assert not (tmp_path / "after" / "irtwin.db").exists()
        backed_up(place, tmp_path / "again.zip")
    with pytest.raises(InputError, match="holds rows already"):
        restore(archive, Location(tmp_path / "third", url))
    assert not (tmp_path / "third").exists()
    restore(tmp_path / "again.zip", tmp_path / "back")
    with Workspace(tmp_path / "back") as place:
        assert state(place) == state(filled)


WRITER = """
import sys
from pathlib import Path
sys.path.insert(0, sys.argv[2])
from tests import rows
from irtwin.storage import database
from irtwin.storage.database import Workspace
with Workspace(Path(sys.argv[1])) as place:
    for number in range(10**9):
        robot, joints, runs, series = rows.data_set()
        for run in runs:
            run.sha256 = f"{number:064x}"
            series[run.run_id] = rows.samples(number)
        place.ingest(robot, joints, runs, series)
        print(number, flush=True)
"""


KNOWING = KnowledgeGraph()
KNOWING.replace(in_graph([Triple(NamedNode("a:a"), NamedNode("a:a"), NamedNode("a:a"))], GRAPH_SOURCE), GRAPH_SOURCE)


@pytest.mark.nightly
def test_it_is_of_one_moment_while_another_process_writes(tmp_path: Path) -> None:
    filled = Workspace(tmp_path / "before")
    tests = Path(rows.__file__).parents[1]
    command = [sys.executable, "-c", WRITER, str(filled.folder), str(tests)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        process.stdout.readline()
        for number in range(2):
            backup(filled, KNOWING, tmp_path / f"{number}.zip")
        process.kill()
        written = process.stdout.read().split()
    filled.close()
    assert written, "the writer wrote nothing meanwhile"
    for number in range(2):
        restore(tmp_path / f"{number}.zip", tmp_path / f"{number}")
        with Workspace(tmp_path / f"{number}") as place, place.reading() as session:
            series = session.execute(select(Series.path, Series.series_id)).all()
            assert len(series) == 2
            assert all(checksum(place.folder / path) == series_id for path, series_id in series)
            assert session.scalar(select(func.count()).select_from(Base.metadata.tables["run"])) == 2


Contents = dict[str, bytes]
Change = Callable[[Contents], object]


def altered(archive: Path, change: Change, sums: bool = True) -> Path:
    """Return the archive with other contents, its list made to agree with them if `sums`."""
    with zipfile.ZipFile(archive) as source:
        contents = {name: source.read(name) for name in source.namelist()}
    manifest = json.loads(contents.pop("manifest.json"))
    change(contents)
    if sums:
        manifest["files"] = {
            name: {"sha256": hashlib.sha256(data).hexdigest(), "size": len(data)} for name, data in contents.items()
        }
    other = archive.with_name("other.zip")
    with zipfile.ZipFile(other, "w") as target:
        for name, data in contents.items():
            target.writestr(name, data)
        target.writestr("manifest.json", json.dumps(manifest))
    return other


def refuse(archive: Path, message: str) -> None:
    folder = archive.parent / "after"
    with pytest.raises(InputError, match=message):
        restore(archive, folder)
    assert not folder.exists()
    assert not list(archive.parent.glob(".irtwin-restore-*"))
    assert not (archive.parent / "outside").exists()


@pytest.mark.parametrize("share", [0.0, 0.01, 0.5, 0.999])
def test_a_cut_off_archive_is_told(archive: Path, share: float) -> None:
    data = archive.read_bytes()
    archive.write_bytes(data[: int(share * len(data))])
    refuse(archive, "damaged")


def test_no_flipped_byte_is_restored(archive: Path, filled: Workspace) -> None:
    """Each is told, but for those that mean nothing, as the date of an entry."""
    data = archive.read_bytes()
    expected, told = state(filled), 0
    for place in range(40, len(data), len(data) // 12):
        archive.write_bytes(data[:place] + bytes([data[place] ^ 0xFF]) + data[place + 1 :])
        after = archive.with_name(f"after_{place}")
        try:
            restore(archive, after)
        except InputError:
            told += 1
            assert not after.exists()
        else:
            with Workspace(after) as restored:
                assert state(restored) == expected
    assert told > 8


def put(name: str, data: bytes) -> Change:
    return lambda contents: contents.update({name: data})


def without(name: str) -> Change:
    return lambda contents: contents.pop(name)


def replaced(found: bytes, by: bytes, within: str = "rows/robot.jsonl") -> Change:
    """Return a change of what stands in all files whose name begins so."""
    return lambda contents: contents.update(
        {name: data.replace(found, by) for name, data in contents.items() if name.startswith(within)}
    )


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (replaced(b"\n", b"\n#", "graph.nq"), "do not match its list"),
        (replaced(b" ", b"#", "graph.nq"), r"graph\.nq is damaged, its checksum differs"),
        (put("more", b""), "do not match its list"),
        (without("graph.nq"), "do not match its list"),
    ],
)
def test_contents_that_are_not_those_of_the_list(archive: Path, change: Change, message: str) -> None:
    refuse(altered(archive, change, sums=False), message)


ESCAPING = ("../outside", "series/../../outside", "/tmp/outside", "irtwin.db", "graph/CURRENT")
NO_ROBOT = ("../../../outside", "/tmp/outside", "..", "a/b", "a\\u0000b")
WEIGHT = b'"weight_kg": 50.0'
NOT_OURS = "{} .* is none that irtwin writes"
ALTERED = [
    *((put(name, b"x"), "does not belong in a workspace") for name in ESCAPING),
    (put("graph.nq", b"<a"), "its graph is damaged"),
    (put("graph.nq", b'<a:a> <a:b> "' + b"x" * (17 << 20)), "its graph is damaged: Reached the buffer maximal size"),
    (put("rows/robot.jsonl", b"{}\n"), "table robot was made by another irtwin version"),
    (put("rows/robot.jsonl", b"[\n"), "rows of table robot do not fit"),
    (put("rows/robot.jsonl", b""), "do not fit"),
    (without("rows/joint.jsonl"), "has no table joint"),
    (without("graph.nq"), "incomplete: it holds no graph"),
    (put("graph.nq", b""), "incomplete: its graph knows no robot"),
    *((replaced(rows.ROBOT.encode(), name.encode(), "rows/"), NOT_OURS.format("robot_id")) for name in NO_ROBOT),
    (replaced(b'"controlled_axes": 2', b'"controlled_axes": 1' + b"0" * 30), NOT_OURS.format("controlled_axes")),
    (replaced(WEIGHT, b'"weight_kg": ' + b"[" * 100_000 + b"]" * 100_000), "do not fit"),
    (replaced(WEIGHT, b'"weight_kg": ' + b"9" * 5000), "do not fit"),
    (replaced(WEIGHT, b'"weight_kg": NaN'), NOT_OURS.format("weight_kg")),
    (replaced(b'"name": "KUKA KR6 R700"', b'"name": "\\ud800"'), NOT_OURS.format("name")),
]


@pytest.mark.parametrize(("change", "message"), ALTERED)
def test_contents_that_are_no_workspace_are_refused(archive: Path, change: Change, message: str) -> None:
    refuse(altered(archive, change), message)


def test_a_row_beyond_all_bounds_is_refused(archive: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("irtwin.knowledge.store.backup._LONGEST_ROW", 1 << 20)
    refuse(altered(archive, put("rows/robot.jsonl", b" " * (2 << 20))), "more than 1 MB")


def test_a_link_out_of_the_workspace_is_not_backed_up(tmp_path: Path) -> None:
    (tmp_path / "secret.html").write_text("mine")
    with Workspace(tmp_path / "place") as place:
        fill(place)
        (place.folder / "reports" / "x.html").symlink_to(tmp_path / "secret.html")
        with pytest.raises(InputError, match="leads outside"):
            backed_up(place, tmp_path / "kept.zip")
    assert not (tmp_path / "kept.zip").exists()


def test_what_is_no_backup(tmp_path: Path) -> None:
    foreign = tmp_path / "foreign.zip"
    endless = '{"format": "irtwin backup", "version": 1, "files": {"a.txt": {"sha256": "", "size": Infinity}}}'
    for manifest in (None, "{}", '"x"', '{"format": "irtwin backup", "version": 1}', "[" * 100_000, endless):
        with zipfile.ZipFile(foreign, "w") as target:
            target.writestr("a.txt", "a")
            if manifest is not None:
                target.writestr("manifest.json", manifest)
        refuse(foreign, "not an irtwin backup|damaged")
    with zipfile.ZipFile(foreign, "w") as target:
        target.writestr("manifest.json", '{"format": "irtwin backup", "version": 2, "software": "irtwin 9"}')
    refuse(foreign, "made by another irtwin version .irtwin 9")
    refuse(tmp_path / "none.zip", "cannot be read")
    (tmp_path / "text.zip").write_text("hello")
    refuse(tmp_path / "text.zip", "or not a backup")


def test_nothing_is_overwritten(archive: Path, filled: Workspace, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="already exists; restore into a new folder"):
        restore(archive, filled.folder)
    (tmp_path / "empty").mkdir()
    restore(archive, tmp_path / "empty")
    assert (tmp_path / "empty" / "irtwin.db").is_file()


def test_a_lost_or_altered_file_is_not_backed_up(tmp_path: Path) -> None:
    with Workspace(tmp_path / "before") as place:
        fill(place)
        for damage in (lambda file: file.write_bytes(b"PAR1"), Path.unlink):
            for name in ("series", "twins"):
                file = next((place.folder / name).iterdir())
                content = file.read_bytes()
                damage(file)
                with pytest.raises(InputError, match=f"{file.name} (altered|missing); nothing was written"):
                    backed_up(place, tmp_path / "kept.zip")
                file.write_bytes(content)
        assert [path.name for path in tmp_path.iterdir()] == ["before"]
        assert not list(place.folder.glob(".*"))


def test_an_archive_of_an_earlier_version_whose_series_is_lost_is_told(archive: Path, filled: Workspace) -> None:
    with filled.reading() as session:
        path = session.scalars(select(Series.path)).first()
    refuse(altered(archive, without(path)), f"{path} missing or altered; use another backup")
    refuse(altered(archive, put(path, b"PAR1")), "missing or altered")


def test_what_extends_a_workspace_goes_with_it(tmp_path: Path) -> None:
    names = ["rules/my_rules.ttl", "questions/mine.rq", "reports/energy/mine.rq"]
    for name in names:
        (tmp_path / "before" / name).parent.mkdir(parents=True)
        (tmp_path / "before" / name).write_text(f"# {name}")
    with Workspace(tmp_path / "before") as place:
        backed_up(place, tmp_path / "all.zip")
    restore(tmp_path / "all.zip", tmp_path / "after")
    assert [(tmp_path / "after" / name).read_text() for name in names] == [f"# {name}" for name in names]


def test_a_large_database_is_looked_through_first(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with Workspace(tmp_path / "w") as place:
        fill(place)
        with place.engine.begin() as connection:
            connection.exec_driver_sql("CREATE TABLE mine AS SELECT hex(zeroblob(2000)) AS text FROM series, run")
            connection.exec_driver_sql("INSERT INTO mine SELECT text FROM mine")  # the file ends with it
    file = tmp_path / "w" / "irtwin.db"
    content = file.read_bytes()
    file.write_bytes(content[:-4096] + bytes(4096))
    monkeypatch.setattr(database.engine, "check", lambda engine: math.inf)  # as for one of more than 100 MB
    with Workspace.existing(tmp_path / "w") as place, KnowledgeGraph(place.graph_folder) as graph:
        monkeypatch.undo()
        with pytest.raises(InputError, match="the database is damaged"):
            backup(place, graph, tmp_path / "kept.zip")
    assert not (tmp_path / "kept.zip").exists()

"""A workspace whose log, data set, twin and series are real files: whole, and each tampered with in turn."""

import os
from collections.abc import Callable
from hashlib import sha256
from pathlib import Path

import pytest
from click.testing import CliRunner
from tests import rows
from tests.mapped import MAPPINGS

from irtwin.cli.graph import explain
from irtwin.knowledge.explain.provenance import told_in
from irtwin.knowledge.mapping import refresh
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.knowledge.vocabulary import term
from irtwin.providers.names import run_iri, twin_iri
from irtwin.providers.records import inputs
from irtwin.storage.database import Workspace
from irtwin.storage.schema import SourceFile

NOTHING = "irtwin: nothing was checked: no file behind this is known by its checksum"
RUN, TWIN = f"{rows.ROBOT}.work", f"{rows.ROBOT}.t1"
CONTENT = {name: name.encode() for name in ("dataset.toml", "robot.urdf", "runs/work.csv", "runs/again.csv")}


@pytest.fixture(scope="module")
def filled(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with a data set in `data`, and a workspace in `w` whose twin and energy follow from it."""
    place = tmp_path_factory.mktemp("verify")
    data = place / "data"
    (data / "runs").mkdir(parents=True)
    for name, content in CONTENT.items():
        (data / name).write_bytes(content)
    robot, joints, runs, series = rows.data_set()
    sums = {name: sha256(content).hexdigest() for name, content in CONTENT.items()}
    for run in runs:
        run.sha256 = sums[run.file]
    files = [
        SourceFile(
            source_file_id=f"{rows.ROBOT}.{number}", robot_id=rows.ROBOT, kind=kind, path=name, folder=str(data),
            sha256=sums[name],
        )
        for number, (kind, name) in enumerate([("data set", "dataset.toml"), ("URDF", "robot.urdf")])
    ]  # fmt: skip
    with Workspace(place / "w") as workspace, KnowledgeGraph(workspace.graph_folder) as graph:
        workspace.ingest(robot, [*joints, *files], runs, series)
        read = inputs(workspace, rows.ROBOT, [RUN])
        rows.identify(workspace, TWIN, read)
        energy = rows.activity("energy.1", "energy", run_iri(RUN))
        meter = rows.activity("meter.1", "meter", run_iri(RUN)), [one for one in read if one.startswith("series/")]
        workspace.replace_activity(energy, [*read, twin_iri(TWIN)], rows.run_energy(TWIN), metered=meter)
        graph.load_ontology()
        refresh(graph, workspace.engine, MAPPINGS, workspace.mapped_rows)
    return place


def asked(place: Path, property: str, subject: str = f"id:run/{RUN}") -> tuple[int, list[str], str]:
    """Return the exit status of `irtwin explain --verify`, its lines on files, and what it explains."""
    done = CliRunner().invoke(explain, [subject, property, "--verify", "--workspace", str(place / "w")])
    outline, _, files = done.output.rpartition("\n\n")
    return done.exit_code, sorted(line.replace(str(place) + "/", "") for line in files.splitlines()), outline


@pytest.fixture
def tampered(filled: Path) -> Callable[[str, bytes | None], None]:
    """Return a function that writes a file anew, or removes it where its content is None; all is undone at the end."""
    before: dict[Path, bytes] = {}

    def tamper(name: str, content: bytes | None) -> None:
        (path,) = filled.glob(name)
        before[path] = path.read_bytes()
        path.unlink() if content is None else path.write_bytes(content)

    yield tamper  # type: ignore[misc]
    for path, content in before.items():
        path.write_bytes(content)


def series_of(place: Path) -> str:
    with Workspace(place / "w") as workspace:
        (series,) = [one for one in inputs(workspace, rows.ROBOT, [RUN]) if one.startswith("series/")]
    return f"w/series/{series.split('/')[-2]}.parquet"


def test_untouched_files_are_whole(filled: Path) -> None:
    status, files, _ = asked(filled, "irt:Modelled_Energy")
    read = ["data/dataset.toml", "data/robot.urdf", "data/runs/work.csv", series_of(filled), f"w/twins/{TWIN}.json"]
    assert (status, files) == (0, sorted(f"whole: {name}" for name in read))


def test_a_measured_energy_is_proved_by_the_samples_alone(filled: Path) -> None:
    for name in ("Measured_Energy", "Energy_Consumption", "Run_Power", "Peak_Power"):
        status, files, outline = asked(filled, f"irt:{name}")
        assert (status, files) == (0, ["whole: data/runs/work.csv", f"whole: {series_of(filled)}"])
        assert "provider:meter" in outline and "id:twin/" not in outline


def test_what_a_data_set_says_cites_it(filled: Path) -> None:
    for name, key in (("Payload", "payload_mass"), ("Run_Role", "role")):
        _, files, outline = asked(filled, f"irt:{name}")
        assert files == ["whole: data/dataset.toml"]
        assert f'at [[run]] file = "runs/work.csv": {key}' in outline
    assert asked(filled, "irt:Sample_Count")[1] == ["whole: data/runs/work.csv"]


def test_a_joints_limits_cite_the_file_that_describes_the_robot(filled: Path) -> None:
    joint = f"id:joint/{rows.ROBOT}/joint_a1"
    for name in ("Lower_Limit", "Upper_Limit", "Speed_Limit"):
        _, files, outline = asked(filled, f"irt:{name}", joint)
        assert files == ["whole: data/robot.urdf"]
        assert "at joint joint_a1: limit " in outline
    graph = KnowledgeGraph()  # of a robot that a table of its data set describes
    graph.update("""INSERT DATA { irt:Lower_Limit irt:told_in "URDF" . <urn:j> irt:joint_of <urn:r> .
        <urn:s> irt:source_of <urn:r> ; irt:Source_Kind "data set" ; irt:File "dataset.toml" ; irt:Checksum "1" ;
        irt:Data_Folder "/data" }""")
    assert told_in(graph, "urn:j", term("Lower_Limit"))["file"] == "dataset.toml"


@pytest.mark.parametrize("kind", ["data/runs/work.csv", "data/dataset.toml", "data/robot.urdf", "twin", "series"])
def test_a_tampered_file_is_told(filled: Path, tampered: Callable[[str, bytes | None], None], kind: str) -> None:
    name = {"series": series_of(filled), "twin": f"w/twins/{TWIN}.json"}.get(kind, kind)
    tampered(name, b"other")
    status, files, _ = asked(filled, "irt:Modelled_Energy")
    wrong = f"changed: {name} (sha256 is now {sha256(b'other').hexdigest()})"
    assert status == 2 and wrong in files
    assert [line for line in files if not line.startswith("whole: ")] == [wrong]


def test_a_missing_file_and_a_data_set_elsewhere_are_told_apart(
    filled: Path, tampered: Callable[[str, bytes | None], None]
) -> None:
    tampered("data/runs/work.csv", None)
    assert asked(filled, "irt:Sample_Count")[:2] == (2, ["missing: data/runs/work.csv"])
    (filled / "data").rename(filled / "moved")
    try:
        status, (line, told), _ = asked(filled, "irt:Sample_Count")
    finally:
        (filled / "moved").rename(filled / "data")
    assert status == 2
    assert line.startswith("cannot be checked: data/runs/work.csv (its data set is not at ")
    assert told == NOTHING


def test_a_total_is_verified_by_the_logs_of_its_runs(
    filled: Path, tampered: Callable[[str, bytes | None], None]
) -> None:
    total = f"id:robot_total/{rows.ROBOT}"
    status, files, _ = asked(filled, "irt:Run_Count", total)
    assert status == 0
    assert {"whole: data/runs/work.csv", "whole: data/runs/again.csv"} <= set(files)
    tampered("data/runs/again.csv", b"other")
    status, files, _ = asked(filled, "irt:Run_Count", total)
    assert status == 2
    assert [line.partition(" (")[0] for line in files if "whole" not in line] == ["changed: data/runs/again.csv"]
    status, files, outline = asked(filled, "irt:Total_Modelled_Energy", total)
    assert status == 0 and f"whole: w/twins/{TWIN}.json" in files
    assert f'id:run/{RUN} irt:Modelled_Energy "98"' in outline and "provider:energy" in outline


def test_what_is_no_plain_file_is_not_read(filled: Path, tampered: Callable[[str, bytes | None], None]) -> None:
    tampered("data/runs/work.csv", None)
    pipe = filled / "data" / "runs" / "work.csv"
    os.mkfifo(pipe)
    try:
        status, files, _ = asked(filled, "irt:Sample_Count")
    finally:
        pipe.unlink()
    assert (status, files) == (2, ["cannot be checked: data/runs/work.csv (it is no plain file)", NOTHING])


def test_what_is_irtwins_own_has_no_checksum(filled: Path) -> None:
    done = CliRunner().invoke(explain, ["irt:Payload", "a", "--verify", "--json", "--workspace", str(filled / "w")])
    assert done.exit_code == 2
    assert NOTHING in done.output
    assert '"state": "cannot be checked"' in done.output and '"file": "ontology/robot.ttl"' in done.output


def test_a_data_set_that_is_taken_in_from_elsewhere_is_the_same(tmp_path: Path) -> None:
    told = {"source_file_id": "1", "robot_id": rows.ROBOT, "kind": "URDF", "path": "robot.urdf"}
    with Workspace(tmp_path) as workspace:
        for folder, checksum, outcome in (("a", "1", "new"), ("b", "1", "unchanged"), ("b", "2", "replaced")):
            file = SourceFile(**told, folder=folder, sha256=checksum)
            robot, joints, runs, series = rows.data_set()
            assert workspace.ingest(robot, [*joints, file], runs, series) == outcome
            with workspace.reading() as session:
                assert session.get_one(SourceFile, "1").folder == folder

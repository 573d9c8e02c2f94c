"""Many data sets by one command: data sets in, results by batch, and what was set aside."""

import itertools
import sys
import threading
import time
from pathlib import Path

import pytest
from tests import data_sets, small_robots
from tests.fleet.test_batch import batch_of

from irtwin.errors import InputError
from irtwin.fleet import fleet
from irtwin.fleet.batch import key
from irtwin.fleet.fleet import batches_of

pytestmark = pytest.mark.slow

DIES = (sys.executable, "-m", "tests.fleet.worker_that_dies")
BASE = "https://plant.example/energy/"


@pytest.fixture(scope="module")
def robots(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two good data sets and one with a misspelt key."""
    folder = tmp_path_factory.mktemp("robots")
    for seed, name in enumerate(("A", "B")):
        small_robots.data_set(folder / name, f"Arm {name}", seed=10 * seed)
    (folder / "C").mkdir()
    (folder / "C" / "dataset.toml").write_text('[robot]\nnam = "Arm C"\n')
    return folder


@pytest.fixture(scope="module")
def first(robots: Path, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, data_sets.Said]:
    """Return the folder of a fleet that was run once, and what the command said."""
    out = tmp_path_factory.mktemp("out")
    return out, run(robots, out)


@pytest.fixture(scope="module")
def out(first: tuple[Path, data_sets.Said]) -> Path:
    return first[0]


def run(robots: Path, out: Path) -> data_sets.Said:
    return data_sets.irtwin("run", robots, "--out", out, "--workers", 2, "--base", BASE)


def test_a_fleet_is_run_into_workspaces_and_only_once(robots: Path, first: tuple[Path, data_sets.Said]) -> None:
    out, said = first
    assert said.status == 3, said.err
    assert said.out == "done     2\nrefused  1\n"
    assert "nam" in said.err and "Traceback" not in said.err
    workspaces = [batch.folder / "workspace" for batch in batches_of(out)]
    assert len(workspaces) == 2
    pages = [page for place in workspaces for page in place.glob("reports/*.html")]
    assert len(pages) == 2
    written = {page: page.stat().st_mtime_ns for page in pages}
    again = run(robots, out)
    assert again.out == said.out
    assert {page: page.stat().st_mtime_ns for page in pages} == written


def test_it_is_told_how_far_it_is_while_it_works(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(fleet, "_EVERY", 0.01)
    told, three = itertools.count(), threading.Event()
    with fleet.told_meanwhile(lambda: next(told) > 1 and three.set()):
        assert three.wait(60)
    heard = next(told)
    time.sleep(0.05)
    assert next(told) == heard + 1  # it ends with the block


def test_a_fleet_has_one_base_of_iris(robots: Path, out: Path) -> None:
    asked = "SELECT ?robot { ?robot a irt:Industrial_Robot }"
    places = [batch.folder / "workspace" for batch in batches_of(out)]
    said = [data_sets.irtwin("query", asked, "--workspace", place).out for place in places if place.is_dir()]
    assert said and all(lines.count(f"{BASE}robot/") == 2 for lines in said)
    other = f"the IRIs of this fleet begin with {BASE}; give --base {BASE}, or another --out"
    assert other in data_sets.refused_in_a_line("run", robots, "--out", out)
    assert data_sets.refused_in_a_line("run", robots, "--out", out, "--base", "plant").startswith("irtwin: --base: ")


def test_status_says_what_became_of_each(out: Path) -> None:
    said = data_sets.irtwin("workspace", "status", "--workspace", out)
    assert said.status == 0 and said.out == "done     2\nrefused  1\n"
    assert said.err.startswith("refused: ") and said.err.count("\n") == 1


def test_a_folder_is_of_one_kind(robots: Path, out: Path) -> None:
    said = data_sets.refused_in_a_line("diagnose", robots, "--out", out)
    assert "holds a fleet of `run`; give `diagnose` a folder of its own" in said


def test_a_folder_of_data_sets_alone_is_told_how_all_are_taken(robots: Path) -> None:
    said = data_sets.irtwin("run", robots)
    assert said.status == 2
    assert f"{robots}: holds data sets, and is none itself; name one, or take all by --out" in said.err


def test_a_process_that_dies_costs_the_data_set_that_it_died_of(tmp_path: Path) -> None:
    batch = batch_of(tmp_path, "a", "large", "b")
    fleet.work_through([batch], 2, lambda batch: None, DIES)
    assert [record.state if record else "" for record in batch.records()] == ["done", "failed", "done"]


def test_a_process_that_never_begins_is_not_tried_for_ever(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="its process ended with status 7 and left no record"):
        never = (sys.executable, "-c", "raise SystemExit(7)")
        fleet.work_through([batch_of(tmp_path, "a")], 1, lambda batch: None, never)


@pytest.mark.parametrize("name", ["records", "records/a"])
def test_a_folder_that_cannot_be_written_is_told_in_one_line(name: str, tmp_path: Path, capfd) -> None:
    batch = batch_of(tmp_path, "a")
    place = batch.folder / name.replace("/a", f"/{key(batch.sets.data_sets[0])}.json/x")
    if name == "records":
        place.write_text("a file in its place")
    else:
        place.mkdir(parents=True)
    with pytest.raises(InputError, match="cannot be written"):
        fleet.work_through([batch], 1, lambda batch: None)
    assert capfd.readouterr().err == ""

"""Batches by processes that die, and by a cluster that loses a worker."""

import os
import sys
from pathlib import Path

import pytest

from irtwin.errors import InputError
from irtwin.fleet import schedule
from irtwin.fleet.batch import Batch, key

pytestmark = pytest.mark.slow
DIES = (sys.executable, "-m", "tests.fleet.worker_that_dies")
# one that says which Dask worker it is a child of, and takes its time
SLOW = (
    sys.executable,
    "-c",
    "import os, sys, time, pathlib; place = pathlib.Path(sys.argv[1]);"
    "(place / 'worker').write_text(str(os.getppid())); time.sleep(1); (place / 'ended').write_text('')",
)


def _batches(folder: Path, *members: tuple[str, ...]) -> list[Batch]:
    for name in (name for names in members for name in names):
        (folder / name).mkdir()
        (folder / name / "dataset.toml").write_text(name)
    return [
        Batch.create(folder / "out" / f"b{k}", "diagnose", [str(folder / name) for name in names])
        for k, names in enumerate(members)
    ]


def test_a_process_that_dies_costs_the_data_set_that_it_died_of(tmp_path: Path) -> None:
    (batch,) = _batches(tmp_path, ("a", "large", "b"))
    schedule.work_here([batch], 2, lambda batch: None, DIES)
    assert [record.state if record else "" for record in batch.records()] == ["done", "failed", "done"]


def test_a_process_that_never_begins_is_not_tried_for_ever(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="its process ended with status 7 and left no record"):
        schedule.work_here(
            _batches(tmp_path, ("a",)), 1, lambda batch: None, (sys.executable, "-c", "raise SystemExit(7)")
        )


@pytest.mark.parametrize("name", ["records", "lock", "records/a"])
def test_a_folder_that_cannot_be_written_is_told_in_one_line(name: str, tmp_path: Path, capfd) -> None:
    (batch,) = _batches(tmp_path, ("a",))
    place = batch.folder / name.replace("/a", f"/{key(batch.sets.data_sets[0])}.json/x")
    if name == "records":
        place.write_text("a file in its place")
    else:
        place.mkdir(parents=True)
    with pytest.raises(InputError, match="cannot be written"):
        schedule.work_here([batch], 1, lambda batch: None)
    assert capfd.readouterr().err == ""


def test_a_cluster_goes_on_where_a_worker_is_killed(tmp_path: Path) -> None:
    from distributed import LocalCluster

    batches = _batches(tmp_path, ("a",), ("b",), ("c",), ("d",))
    killed = []

    def kill_once(batch: Batch) -> None:
        if not killed:
            at_work = [one for one in batches if (one.folder / "worker").exists() and one is not batch]
            killed.append(int((at_work[-1].folder / "worker").read_text()))
            os.kill(killed[0], 9)

    with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster:
        schedule.work_on_cluster(batches, cluster.scheduler_address, kill_once, SLOW)
    assert killed and all((batch.folder / "ended").exists() for batch in batches)


def test_an_address_where_no_scheduler_answers_is_one_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(schedule, "_CONNECT", 0.5)
    with pytest.raises(InputError, match=r"tcp://127\.0\.0\.1:9: no Dask scheduler answers"):
        schedule.work_on_cluster(_batches(tmp_path, ("a",)), "tcp://127.0.0.1:9", lambda batch: None)

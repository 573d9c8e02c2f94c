"""Batches by processes that die, and by a cluster that loses a worker."""

import os
import time
from pathlib import Path
from unittest import mock

import pytest

from irtwin import workflow
from irtwin.errors import InputError
from irtwin.fleet import schedule
from irtwin.fleet.batch import Batch

pytestmark = pytest.mark.slow


def _dies_of_large(data_set: Path, json_file: Path, twin_file: Path) -> None:
    if data_set.name == "large":
        os._exit(9)


def _slow(data_set: Path, json_file: Path, twin_file: Path) -> None:
    (data_set.parent / f"worker_of_{data_set.name}").write_text(str(os.getpid()))
    time.sleep(0.5)


def work_and_die(folder: str) -> None:
    with mock.patch.object(workflow, "diagnose", _dies_of_large):
        Batch(Path(folder)).work()


def work_slowly(folder: str) -> None:
    with mock.patch.object(workflow, "diagnose", _slow):
        Batch(Path(folder)).work()


def _batches(folder: Path, *members: tuple[str, ...]) -> list[Batch]:
    for name in (name for names in members for name in names):
        (folder / name).mkdir()
        (folder / name / "dataset.toml").write_text(name)
    return [
        Batch.create(folder / "out" / f"b{k}", "diagnose", [str(folder / name) for name in names])
        for k, names in enumerate(members)
    ]


def _states(batches: list[Batch]) -> list[str]:
    return [record.state if record else "" for batch in batches for record in batch.records()]


def test_a_process_that_dies_costs_the_data_set_that_it_died_of(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(schedule, "_work", work_and_die)
    batches = _batches(tmp_path, ("a", "large", "b"))
    schedule.work_here(batches, 2, lambda batch: None)
    assert _states(batches) == ["done", "failed", "done"]


def test_a_process_that_never_begins_is_not_tried_for_ever(tmp_path: Path) -> None:
    (batch,) = _batches(tmp_path, ("a",))
    with pytest.raises(InputError, match="its process ended before it began"):
        schedule._again(batch, died=True)


def test_a_cluster_goes_on_where_a_worker_is_killed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from distributed import LocalCluster

    monkeypatch.setattr(schedule, "_work", work_slowly)
    batches = _batches(tmp_path, ("a", "b"), ("c", "d"), ("e",))
    killed = []

    def kill_once(batch: Batch) -> None:
        if not killed:
            running = [int(file.read_text()) for file in tmp_path.glob("worker_of_*")]
            killed.append(running[-1])
            os.kill(running[-1], 9)

    with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster:
        schedule.work_on_cluster(batches, cluster.scheduler_address, kill_once)
    assert killed and _states(batches) == ["done"] * 5


def test_an_address_where_no_scheduler_answers_is_one_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(schedule, "_CONNECT", 0.5)
    with pytest.raises(InputError, match=r"tcp://127\.0\.0\.1:9: no Dask scheduler answers"):
        schedule.work_on_cluster(_batches(tmp_path, ("a",)), "tcp://127.0.0.1:9", lambda batch: None)

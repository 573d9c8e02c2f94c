"""Batches by processes that die."""

import sys
from pathlib import Path

import pytest

from irtwin.errors import InputError
from irtwin.fleet import schedule
from irtwin.fleet.batch import Batch, key

pytestmark = pytest.mark.slow
DIES = (sys.executable, "-m", "tests.fleet.worker_that_dies")


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
    schedule.work_through([batch], 2, lambda batch: None, DIES)
    assert [record.state if record else "" for record in batch.records()] == ["done", "failed", "done"]


def test_a_process_that_never_begins_is_not_tried_for_ever(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="its process ended with status 7 and left no record"):
        schedule.work_through(
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
        schedule.work_through([batch], 1, lambda batch: None)
    assert capfd.readouterr().err == ""

"""What becomes of a batch's data sets: each by itself, once, and on record."""

import errno
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from irtwin import diagnosing
from irtwin.errors import InputError, WorkspaceFault
from irtwin.fleet.batch import Batch, Record, checksum, key
from irtwin.fleet.fleet import find_data_sets


def _raise(error: Exception) -> Any:
    raise error


WAYS: dict[str, Callable[[], Any]] = {
    "bad": lambda: _raise(InputError("runs/a.csv, line 3: not a number")),
    "full": lambda: _raise(WorkspaceFault("workspace: the disk is full")),
    "odd": lambda: 1 / 0,
}


@pytest.fixture
def asked(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """The data sets that were diagnosed."""
    found: list[str] = []

    def diagnose(data_set: Path, json_file: Path, twin_file: Path) -> None:
        found.append(data_set.name)
        WAYS.get(data_set.name, lambda: None)()
        json_file.parent.mkdir(parents=True, exist_ok=True)
        json_file.write_text("{}")

    monkeypatch.setattr(diagnosing, "diagnose", diagnose)
    return found


def batch_of(folder: Path, *names: str) -> Batch:
    for name in names:
        (folder / name).mkdir()
        (folder / name / "dataset.toml").write_text(name)
    return Batch.create(folder / "out" / "batch_0001", "diagnose", [str(folder / name) for name in names])


def _states(batch: Batch) -> list[str]:
    return [record.state if record else "" for record in batch.records()]


def test_a_data_set_that_is_refused_or_fails_costs_no_other(tmp_path: Path, asked: list[str]) -> None:
    batch = batch_of(tmp_path, "bad", "odd", "good")
    batch.work()
    assert _states(batch) == ["refused", "failed", "done"]
    refused, failed, _ = batch.records()
    assert refused is not None and refused.said == "runs/a.csv, line 3: not a number"
    assert failed is not None and failed.said.startswith("ZeroDivisionError, see ")
    trace = Path(failed.said.removeprefix("ZeroDivisionError, see "))
    assert "1 / 0" in trace.read_text()
    assert (batch.folder / "diagnoses" / key(batch.sets.data_sets[2]) / "gap.json").exists()


def test_only_what_changed_or_failed_is_taken_again(tmp_path: Path, asked: list[str]) -> None:
    batch = batch_of(tmp_path, "bad", "odd", "good", "other")
    batch.work()
    (tmp_path / "good" / "dataset.toml").write_text("changed")
    asked.clear()
    batch.work()
    assert asked == ["odd", "good"]


def test_what_a_full_disk_hindered_is_taken_again(tmp_path: Path, asked: list[str]) -> None:
    batch = batch_of(tmp_path, "full", "good")
    batch.work()
    assert _states(batch) == ["failed", "done"]
    assert next(it.said for it in batch.records() if it) == "workspace: the disk is full"
    asked.clear()
    batch.work()
    assert asked == ["full"]


def test_a_data_set_of_which_processes_die_is_set_aside(tmp_path: Path, asked: list[str]) -> None:
    batch = batch_of(tmp_path, "large", "good")
    batch.work()
    records = batch.folder / "records"
    for attempts, state in ((1, "done"), (2, "failed")):
        one = next(batch.records())
        assert one is not None
        batch._write(Record(one.data_set, "begun", attempts=attempts, checksum=one.checksum))
        batch.work()
        assert _states(batch) == [state, "done"]
    found = next(batch.records())
    assert found is not None and found.said.startswith("the process ended 2 times while it worked on this")
    assert len(list(records.iterdir())) == 2


@pytest.mark.parametrize("text", ['{"state"', "[" * 100_000, '{"data_set": "x", "state": "done", "seconds": []}'])
def test_a_damaged_record_is_as_none(tmp_path: Path, asked: list[str], text: str) -> None:
    batch = batch_of(tmp_path, "good")
    batch.work()
    (batch.folder / "records" / f"{key(batch.sets.data_sets[0])}.json").write_text(text)
    batch.work()
    assert _states(batch) == ["done"] and asked == ["good", "good"]


def test_a_disk_that_does_not_answer_fails_one_data_set(
    tmp_path: Path, asked: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    batch = batch_of(tmp_path, "lost", "good")

    def answering(data_set: Path) -> str:
        if data_set.name == "lost":
            raise OSError(errno.EIO, "Input/output error")
        return checksum(data_set)

    monkeypatch.setattr("irtwin.fleet.batch.checksum", answering)
    batch.work()
    assert _states(batch) == ["failed", "done"]


@pytest.mark.parametrize("text", ["{", "[" * 100_000, "[]", '{"data_sets": []}', '{"kind": "run", "data_sets": {}}'])
def test_a_damaged_list_of_sets_says_what_to_do(tmp_path: Path, text: str) -> None:
    (tmp_path / "sets.json").write_text(text)
    with pytest.raises(InputError, match=r"sets\.json: cannot be read .*; remove its folder"):
        _ = Batch(tmp_path).sets.data_sets


def test_folders_of_one_name_have_files_of_their_own() -> None:
    assert key("/plant/a/robot 1") != key("/plant/b/robot 1")
    assert key("/plant/a/robot 1").startswith("robot_1-")


def _leading_out(folder: Path, name: str) -> tuple[Batch, Path]:
    """A batch whose folder of a name is a link, and where that leads."""
    batch, outside = batch_of(folder, "good"), folder / "outside"
    outside.mkdir()
    (batch.folder / name).symlink_to(outside)
    return batch, outside


def test_records_that_a_link_leads_out_of_the_batch_end_it(tmp_path: Path, asked: list[str]) -> None:
    batch, outside = _leading_out(tmp_path, "records")
    with pytest.raises(InputError, match=r"the path 'records/good-.*' leads outside"):
        batch.work()
    assert list(outside.iterdir()) == []


def test_results_that_a_link_leads_out_of_the_batch_are_refused(tmp_path: Path, asked: list[str]) -> None:
    batch, outside = _leading_out(tmp_path, "diagnoses")
    batch.work()
    (record,) = batch.records()
    assert record is not None and record.state == "refused"
    assert "the path 'diagnoses/good-" in record.said and "leads outside" in record.said
    assert list(outside.iterdir()) == []


def _write(folder: Path, text: str = "") -> Path:
    folder.mkdir(parents=True)
    (folder / "dataset.toml").write_text(text)
    return folder


def test_every_folder_below_that_has_a_data_set_is_found(tmp_path: Path) -> None:
    found = [_write(tmp_path / name) for name in ("hall_2/b", "hall_1/a", "c")]
    (tmp_path / "hall_1" / "notes").mkdir()
    assert find_data_sets(tmp_path) == sorted(map(str, found))


def test_a_list_names_one_a_line_beside_itself(tmp_path: Path) -> None:
    one = _write(tmp_path / "one")
    listed = tmp_path / "fleet.txt"
    listed.write_text("# the press shop\none\n\none\n")
    assert find_data_sets(listed) == [str(one)]


def test_a_checksum_is_of_names_and_bytes(tmp_path: Path) -> None:
    one, other = _write(tmp_path / "one", "a"), _write(tmp_path / "other", "a")
    assert checksum(one) == checksum(other)
    (other / "dataset.toml").rename(other / "data.toml")
    assert checksum(one) != checksum(other)


@pytest.mark.parametrize(
    ("source", "said"),
    [
        ("empty", "holds no data set; a data set is a folder with dataset.toml"),
        ("none", "cannot be read (No such file or directory); name an existing file"),
        ("bad.txt", "line 2: missing holds no dataset.toml"),
        ("binary.txt", "line 1: not UTF-8 text (byte 1)"),
    ],
)
def test_where_there_is_none_one_line_says_so(source: str, said: str, tmp_path: Path) -> None:
    (tmp_path / "empty").mkdir()
    (tmp_path / "bad.txt").write_text("# all\nmissing\n")
    (tmp_path / "binary.txt").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(InputError) as raised:
        find_data_sets(tmp_path / source)
    assert said in str(raised.value)

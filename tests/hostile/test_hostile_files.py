"""Logs that ask their reader for much: each is refused in one line before it takes it, or read for what it is."""

from __future__ import annotations

import re
import time
from pathlib import Path

import pytest
from tests.hostile import hostile_bags, hostile_parquet, hostile_tables
from tests.synthetic import arm

from irtwin.bring.recording import read_recording
from irtwin.errors import InputError
from irtwin.signals.samples import read_signals

FILES = {**hostile_tables.FILES, **hostile_parquet.FILES, **hostile_bags.FILES}
ROBOT = arm(1)
_TOO_MUCH = r"more than the \d+ MB that a file of this size may unpack to; "
_SHEET = r": xl/worksheets/sheet1\.xml"
REFUSED = {
    "100000 columns.csv": ", line 1: 100000 columns; a run has at most 10000: leave out what nobody needs",
    "a line of quotes.csv": ", line 2: is longer than 1 MB",
    "a cell of 9 MB.csv": ", line 2: is longer than 1 MB",
    "a cell of 9 MB in the last line.csv": r": not readable as text, .* \(a line is longer than 1 MB\)",
    "one line of blanks.csv": ", line 1: is longer than 1 MB",
    "times before time.csv": ": column time has times before 1678",
    "a row far below.xlsx": ", sheet log, row 1048577: a sheet has at most 1,048,576 rows; save the log as CSV",
    "many rows.xlsx": f"{_SHEET}: {_TOO_MUCH}save the log as CSV",
    "a row of many cells.xlsx": f"{_SHEET} has more than 10,000 cells in row 1; save the log as CSV",
    "cells far to the right.xlsx": ", sheet log, row 1: 18278 columns; a run has at most 10000: save the log as CSV",
    "many cells.xlsx": f"{_SHEET}: {_TOO_MUCH}",
    "a bomb of shared strings.xlsx": r": xl/sharedStrings\.xml has more elements than a log of this size has",
    "one long shared string.xlsx": rf": xl/sharedStrings\.xml: {_TOO_MUCH}",
    "deep XML.xlsx": f"{_SHEET} has elements more than 100 deep",
    "many columns described.xlsx": f"{_SHEET} has more elements than a log of this size has",
    "many styles.xlsx": r": xl/styles\.xml has more elements than a log of this size has",
    "a number of many digits.xlsx": ": not a readable Excel file .*4300 digits",
    "many attributes.xlsx": f"{_SHEET} has a tag of more than 1 MB",
    "a part that hides its size.xlsx": ": not a readable Excel file .*Bad CRC-32",
    "entities.xlsx": f"{_SHEET} has a document type, which no workbook needs",
    "long strings.parquet": f": column note: {_TOO_MUCH}leave the column out",
    "40 million rows.parquet": f": 40000000 samples of 3 columns: {_TOO_MUCH}cut it into several",
    "11000 columns.parquet": ": 11000 columns; a run has at most 10000",
    "times beyond nanoseconds.parquet": ": column time has times before 1678 or after 2261",
    "other types.parquet": ": column g has times before 1678 or after 2261",
    "the same name many times.parquet": ": column a occurs twice",
    "pages that unpack to more than the footer says.parquet": f": column time: {_TOO_MUCH}",
    "groups in groups.parquet": ": cannot be read .*too deeply nested",
    "a chunk of zeros.mcap": f": a chunk, or one many times: {_TOO_MUCH}",
    "a chunk of 4 GB by its own account.mcap": ": not a readable bag, .*expected 4000000000 bytes, got 1000000",
    "a chunk that is named 50000 times.mcap": f": a chunk, or one many times: {_TOO_MUCH}",
    "values made by a formula.db3": ": not a readable bag, .*too big",
    "a table without end.db3": f": its database: {_TOO_MUCH}record the run again",
    "a metadata of aliases": r"/metadata\.yaml: repeats a part of itself",
    "a metadata of 9 MB": r"/metadata\.yaml: is larger than the 1 MB limit",
    "a chunk of zeros.bag": f": a chunk, or one many times: {_TOO_MUCH}",
    "an index that is named 50000 times.bag": f": its index: {_TOO_MUCH}",
    "many topics before each message.bag": f": its index: {_TOO_MUCH}",
}
_LONG = (
    *("a row far below.xlsx", "a long shared string in many cells.xlsx", "many columns described.xlsx"),
    *("a list of many values in one row.parquet", "40 million rows.parquet", "many messages that pack well.mcap"),
    *("a chunk that is named 50000 times.mcap", "a table without end.db3", "a chunk of zeros.bag"),
    *("many row groups.parquet",),
)
_LONGER = (
    "chunks that take turns.bag",
    "an index that is named 50000 times.bag",
    "many topics before each message.bag",
)


def _cases(names: list[str]) -> list[object]:
    marks = {**dict.fromkeys(_LONG, pytest.mark.slow), **dict.fromkeys(_LONGER, pytest.mark.nightly)}
    return [pytest.param(name, marks=[marks[name]] if name in marks else [], id=name) for name in names]


@pytest.mark.slow
@pytest.mark.parametrize("name", _cases(sorted(FILES.keys() - {"10000 columns.parquet"})))  # which is read below
def test_each_is_refused_in_a_line_or_read(name: str, tmp_path: Path) -> None:
    path = tmp_path / name
    FILES[name](path)
    if name not in REFUSED:
        read_recording(path, ROBOT, {})
        return
    with pytest.raises(InputError) as refused:
        read_recording(path, ROBOT, {})
    said = str(refused.value)
    assert "\n" not in said and len(said) < 1000
    assert re.match(REFUSED[name], said.removeprefix(str(path))), said


@pytest.mark.slow
def test_time_grows_with_columns_and_not_with_their_square(tmp_path: Path) -> None:
    path = tmp_path / "run.parquet"
    FILES["10000 columns.parquet"](path)
    began = time.process_time()
    assert len(read_recording(path, ROBOT, {}).columns) == 10_000
    assert time.process_time() - began < 20  # s; it is 1.3, with their square 141


@pytest.mark.parametrize(
    "name",
    _cases(
        [
            "a line of quotes.csv",
            "40 million rows.parquet",
            "pages that unpack to more than the footer says.parquet",
            "a chunk of zeros.mcap",
            "a table without end.db3",
        ]
    ),
)
def test_a_run_is_held_to_the_same_bounds(name: str, tmp_path: Path) -> None:
    path = tmp_path / name
    FILES[name](path)
    with pytest.raises(InputError, match="longer than 1 MB|" + _TOO_MUCH):
        read_signals(path, ROBOT)


def test_a_list_in_a_row_is_a_column_that_is_not_used(tmp_path: Path) -> None:
    path = tmp_path / "run.parquet"
    FILES["maps and lists.parquet"](path)
    assert read_recording(path, ROBOT, {}).texts == ("q",)


def test_rosbags_is_as_it_was_once_a_bag_is_read(tmp_path: Path) -> None:
    from rosbags.rosbag1 import reader

    before = reader.decompressors, reader.Header, reader.Reader.read_index_data
    with pytest.raises(InputError):
        read_signals(_written(tmp_path / "a metadata of aliases"), ROBOT)
    path = _written(tmp_path / "a chunk of zeros.mcap")
    with pytest.raises(InputError):
        read_signals(path, ROBOT)
    assert before == (reader.decompressors, reader.Header, reader.Reader.read_index_data)


def _written(path: Path) -> Path:
    FILES[path.name](path)
    return path

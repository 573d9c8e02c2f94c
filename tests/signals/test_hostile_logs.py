"""Data sets that are broken, too large, or meant to do harm: each gets one line that names the file."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from tests.data_sets import write
from tests.synthetic import arm, as_run, measure, swing

from irtwin.errors import InputError
from irtwin.signals.log import read_data_set

ROBOT = arm(1)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return write(tmp_path / "set", ROBOT, [as_run(measure(ROBOT, swing(ROBOT, 1, 2.0)))])


def refused(folder: Path) -> str:
    with pytest.raises(InputError) as caught:
        read_data_set(folder)
    said = str(caught.value)
    assert "\n" not in said
    assert len(said) < 500
    return said


def rewrite(folder: Path, line: str, instead: str) -> None:
    file = folder / "dataset.toml"
    text = file.read_text()
    assert re.search(line, text, re.M)
    file.write_text(re.sub(line, lambda _: instead, text, flags=re.M))


@pytest.mark.parametrize(
    ("value", "message"),
    [
        ("9" * 400, r"run.payload_mass is a number beyond 1e\+300"),
        ("0x" + "f" * 6000, r"run.payload_mass is a number beyond 1e\+300"),
        ("1e999", "should be a number of at least 0, not inf"),
        ("nan", "should be a number of at least 0, not nan"),
        ('"' + "x" * 5000 + '"', "should be a number of at least 0, not 'xxx"),
        ("\x00", "not valid TOML"),
    ],
    ids=range(6),
)
def test_values_that_no_toml_should_have(folder, value, message):
    rewrite(folder, "^payload_mass.*$", f"payload_mass = {value}")
    assert re.search(message, refused(folder))


@pytest.mark.parametrize(
    "line",
    [
        ".".join("a" * 50_000) + " = 1",
        " . ".join(['"a b"', "'c'"] * 25_000) + "=1",
        "[" + ".".join("a" * 50_000) + "]",
        "x = {" + ".".join("a" * 50_000) + " = 1}",
        "x = { y = 1, " + ".".join("a" * 50_000) + " = 1}",
    ],
    ids=range(5),
)
def test_tables_in_tables_without_end(folder, line):
    rewrite(folder, "^role.*$", line)
    assert "nested too deeply" in refused(folder)


def test_an_array_that_takes_the_parser_seconds_is_not_read(folder):
    rewrite(folder, "^payload_mass.*$", "payload_mass = [" + "1," * 1_500_000 + "]")
    assert "is larger than the 2 MB limit" in refused(folder)


def test_text_with_many_dots_is_no_table(folder):
    rewrite(folder, "^role.*$", 'role = "observed"\nnote = "' + ".".join("a" * 1000) + '"')
    read_data_set(folder)


def test_a_folder_whose_name_no_disk_takes(tmp_path):
    with pytest.raises(InputError, match="not found"):
        read_data_set(tmp_path / ("x" * 5000))


@pytest.mark.parametrize("year", ["0001", "1899", "2201", "9999"])
def test_a_run_of_no_age(folder, year):
    rewrite(folder, "^role.*$", f"started = {year}-12-31T23:59:59+14:00")
    assert "started must be in the years 1900 to 2200" in refused(folder)


def test_files_that_lead_nowhere(folder):
    (folder / "round.csv").symlink_to(folder / "round.csv")
    said = {"round.csv": "no such file|usable path", "x" * 5000: "usable path", "runs": "no such file"}
    for name, message in said.items():
        rewrite(folder, "^file.*$", f'file = "{name}"')
        assert re.search(message, refused(folder))


def test_a_data_set_that_is_no_file(folder):
    (folder / "dataset.toml").unlink()
    (folder / "dataset.toml").symlink_to("/dev/zero")
    assert "is not a file" in refused(folder)


def as_csv(folder: Path, content: bytes) -> Path:
    (folder / "runs/log.csv").write_bytes(content)
    rewrite(folder, "^file.*$", 'file = "runs/log.csv"')
    return folder


ROWS = b"".join(b"%g,0.1,1\n" % (row / 100) for row in range(30))


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"c" + b",c" * 999_999 + b"\n" + ROWS, "line 1: 1000000 columns"),
        (b"time,q_joint_1,tau_joint_1\n" + b"1" * 10_000_000 + b"\n", "a line is longer than 1 MB"),
        (b"time,q_joint_1,tau_joint_1\n0," + b"9" * 5000 + b",1\n" + ROWS, "line 2, column q_joint_1"),
        (b"time,q_joint_1,tau_joint_1\n0,1e999,1\n" + ROWS, "line 2, column q_joint_1"),
        (b"\xff\xfetime\n" + ROWS, "line 1: not UTF-8 text"),
        (b"time,q_a\n0,1,\xe9,2\n" + ROWS, "line 2: not UTF-8 text"),
        (b"time,q_joint_1,tau_joint_1\n0,\x00,1\n" + ROWS, "line 2, column q_joint_1"),
        (b"\x00" * 1000 + b"\n" + ROWS, "column 1, .* has 1000 characters"),
        (b'time,"q_joint_1,tau_joint_1\n' + ROWS, "not readable as CSV"),
    ],
    ids=range(9),
)
def test_tables_of_text_that_are_none(folder, content, message):
    assert re.search(message, refused(as_csv(folder, content)))


@pytest.mark.parametrize("ends", [b"\r\n", b"\n"])
@pytest.mark.parametrize("mark", [b"\xef\xbb\xbf", b""])
def test_byte_order_marks_and_line_ends_do_not_matter(folder, ends, mark):
    content = (b"time,q_joint_1,tau_joint_1\n" + ROWS).replace(b"\n", ends)
    (run,) = read_data_set(as_csv(folder, mark + content)).runs
    assert len(run.signals.time) == 30


def parquet(folder: Path, **columns: object) -> Path:
    (file,) = (folder / "runs").iterdir()
    table = pq.read_table(file)
    for name, values in columns.items():
        table = table.set_column(table.column_names.index(name), name, values)
    pq.write_table(table, file)
    return folder


@pytest.mark.parametrize(
    "values",
    [
        pa.array([[0.1]] * 200),
        pa.array([{"x": 1.0}] * 200),
        pa.array([0] * 200, pa.date32()),
        pa.array([0] * 200, pa.timestamp("ns")),
        pa.array([True] * 200),
        pa.array(["a"] * 200).dictionary_encode(),
        pa.array([b"\xff"] * 200),
    ],
    ids=str,
)
def test_columns_that_hold_no_numbers(folder, values):
    assert "column q_joint_1 is of type" in refused(parquet(folder, q_joint_1=values))


def test_decimals_are_numbers(folder):
    (run,) = read_data_set(parquet(folder, q_joint_1=pa.array([1] * 200, pa.decimal128(10, 3)))).runs
    np.testing.assert_array_equal(run.signals.q, 1.0)


@pytest.mark.slow
def test_columns_that_nobody_asked_for_are_not_read(folder):
    (file,) = (folder / "runs").iterdir()
    table = pq.read_table(file).append_column("bomb", pa.array(["x" * 1_000_000] * 200))
    pq.write_table(table, file, compression="zstd")
    (run,) = read_data_set(folder).runs
    assert len(run.signals.time) == 200


@pytest.mark.slow
def test_damaged_parquet_is_said_to_be(folder):
    (file,) = (folder / "runs").iterdir()
    whole = file.read_bytes()
    rng = np.random.default_rng(0)
    for _ in range(100):
        data = bytearray(whole)
        for place in rng.integers(len(data), size=3):
            data[place] = rng.integers(256)
        file.write_bytes(data)
        try:
            read_data_set(folder)
        except InputError as error:
            assert "\n" not in str(error)


def test_a_run_in_pieces_is_no_copy_of_itself(tmp_path):
    from irtwin.gap.data.admission import admit
    from irtwin.signals.conditioning import condition

    whole = as_run(measure(ROBOT, swing(ROBOT, 1, 6.0)))
    whole.signals.time[300:] += 100.0
    data_set = read_data_set(write(tmp_path / "set", ROBOT, [whole]))
    admit(data_set, {run.name: condition(run, ROBOT, 5.0) for run in data_set.runs}, 1.0)

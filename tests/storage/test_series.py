from __future__ import annotations

from pathlib import Path

import pyarrow as pa
import pytest

from irtwin.errors import InputError
from irtwin.input_file import checksum
from irtwin.storage.series import read_series, write_series

TABLE = pa.table({"time": [0.0, 0.1], "q_a1": [1.0, 2.0]})


def test_a_series_comes_back_as_it_was(tmp_path: Path) -> None:
    stored = write_series(tmp_path, TABLE)
    assert read_series(tmp_path, *stored).equals(TABLE)
    assert read_series(tmp_path, *stored, ["q_a1"]).column_names == ["q_a1"]


def test_a_file_is_named_by_its_content(tmp_path: Path) -> None:
    path, series_id = write_series(tmp_path, TABLE)
    assert (path, series_id) == (f"series/{series_id}.parquet", checksum(tmp_path / path))
    assert write_series(tmp_path, TABLE) == (path, series_id)
    assert len(list((tmp_path / "series").iterdir())) == 1


def test_an_altered_series_is_refused(tmp_path: Path) -> None:
    path, series_id = write_series(tmp_path, TABLE)
    file = tmp_path / path
    file.write_bytes(file.read_bytes()[:-1] + b"?")
    with pytest.raises(InputError, match=r"altered, its checksum differs"):
        read_series(tmp_path, path, series_id)


def test_a_missing_series_is_named(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"none\.parquet: the series is missing"):
        read_series(tmp_path, "series/none.parquet", "0")


@pytest.mark.parametrize("path", ["../outside.parquet", "/etc/passwd", "series/../../outside"])
def test_no_path_leads_out_of_the_workspace(tmp_path: Path, path: str) -> None:
    with pytest.raises(InputError, match="leads outside the workspace"):
        read_series(tmp_path / "workspace", path, "0")

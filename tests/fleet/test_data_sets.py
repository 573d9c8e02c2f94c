"""Where a fleet's data sets are found."""

from pathlib import Path

import pytest

from irtwin.errors import InputError
from irtwin.fleet.data_sets import checksum, find_data_sets


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

from __future__ import annotations

from pathlib import Path

import pytest

from irtwin.storage import files


def test_a_file_is_written_whole(tmp_path: Path) -> None:
    file = tmp_path / "deep" / "twin.json"
    files.write(file, b"one")
    files.write(file, b"two")
    assert file.read_bytes() == b"two"
    assert list(file.parent.iterdir()) == [file]


def test_a_failure_leaves_nothing_behind(tmp_path: Path) -> None:
    with pytest.raises(RuntimeError), files.temporary_beside(tmp_path) as temporary:
        temporary.write_bytes(b"half")
        raise RuntimeError
    assert list(tmp_path.iterdir()) == []

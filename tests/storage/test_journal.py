"""A journal that was damaged is told from one that a crash cut off."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from irtwin.storage.journal import DamagedJournal, Header, Journal, of_robot, read_journal

HEADER = Header("R.live_1", "R", 1.5, ("time", "q_a"), performs="R.plan")


@pytest.fixture
def path(tmp_path: Path) -> Path:
    journal = Journal(tmp_path, HEADER)
    journal.append(np.array([[0.0, 1.0], [1.0, 2.0]]))
    journal.close()
    return journal.path


def test_it_comes_back(path: Path) -> None:
    header, rows = read_journal(path)
    assert header == HEADER
    assert rows.tolist() == [[0.0, 1.0], [1.0, 2.0]]
    assert of_robot(path.parent, "R") == [path]
    assert of_robot(path.parent, "R_2") == []


@pytest.mark.parametrize(
    "line",
    [
        b"garbage", b"\xff\xfe\x00", b"{}", b"[]", b"null", b"7", b'{"run_id": "R.live_1"}', b"[" * 5000,
        b'{"run_id": 1, "robot_id": "R", "payload_kg": 0, "columns": ["time"]}',
        b'{"run_id": "R.live_1", "robot_id": "R", "payload_kg": "x", "columns": ["time"]}',
        b'{"run_id": "R.live_1", "robot_id": "R", "payload_kg": 0, "columns": []}',
        b'{"run_id": "R.live_1", "robot_id": "R", "payload_kg": 0, "columns": ["time"], "performs": 0}',
        b'{"run_id": "../R", "robot_id": "R", "payload_kg": 0, "columns": ["time"]}',
    ],
)  # fmt: skip
def test_a_damaged_header_is_told(path: Path, line: bytes) -> None:
    path.write_bytes(line + b"\n" + bytes(32))
    with pytest.raises(DamagedJournal, match=f"{path.name}: its header is"):
        read_journal(path)


def test_a_header_that_a_crash_cut_off_is_no_damage(path: Path) -> None:
    path.write_bytes(path.read_bytes()[:10])
    with pytest.raises(ValueError, match="ends within its header") as raised:
        read_journal(path)
    assert not isinstance(raised.value, DamagedJournal)

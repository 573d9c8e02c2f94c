"""What is spoilt beyond reading stays as it is: the next way to spoil it is not the end of a session."""

from __future__ import annotations

from pathlib import Path

import pytest
from tests.fuzz.ways import spoil_case

WAYS = {"given.zip": "archive: tables", "workspace/irtwin.db": "workspace: schema"}


@pytest.mark.parametrize("name", WAYS)
def test_what_is_spoilt_beyond_reading_stays_as_it_is(name, tmp_path: Path):
    file = tmp_path / name
    file.parent.mkdir(exist_ok=True)
    file.write_bytes(b"no such file" * 99)
    spoil_case(tmp_path, WAYS[name], 1)
    assert file.read_bytes() == b"no such file" * 99

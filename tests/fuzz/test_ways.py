"""What is spoilt beyond reading stays as it is: the next way to spoil it is not the end of a session."""

from __future__ import annotations

from pathlib import Path

import pytest
from tests.fuzz import logs
from tests.fuzz.case import Case
from tests.fuzz.ways import spoil_case

WAYS = {"given.zip": "archive: tables", "workspace/irtwin.db": "workspace: schema"}


@pytest.mark.parametrize("name", WAYS)
def test_what_is_spoilt_beyond_reading_stays_as_it_is(name, tmp_path: Path):
    file = tmp_path / name
    file.parent.mkdir(exist_ok=True)
    file.write_bytes(b"no such file" * 99)
    spoil_case(tmp_path, WAYS[name], 1)
    assert file.read_bytes() == b"no such file" * 99


@pytest.mark.parametrize(
    "spoils",
    [
        (("log: types", 749), ("log: times", 942470)),  # a time that is none
        (("log: times", 516068), ("log: times", 115865)),  # a time that is text
        (("log: names", 697893), ("log: workbook", 128673)),  # a name that no cell takes
        (("log: types", 1), ("log: many", 5)),
    ],
)
def test_a_way_takes_what_another_left(spoils, tmp_path: Path):
    logs.write(Case().data, tmp_path / "data")
    for way, seed in spoils:
        spoil_case(tmp_path, way, seed)
    assert [*(tmp_path / "data" / "runs").iterdir()]

"""Cases that once failed: each goes through its commands to an answer, or to one clear line."""

from __future__ import annotations

from pathlib import Path

import pytest
from tests.fuzz.case import read_case
from tests.fuzz.commands import try_case_apart

pytestmark = pytest.mark.slow

KEPT = sorted((Path(__file__).parent / "kept").glob("*.json"))


@pytest.fixture(scope="module")
def sound(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Where what is sound is made, by the first case that needs it."""
    return tmp_path_factory.mktemp("sound")


@pytest.mark.parametrize("file", KEPT, ids=lambda file: file.stem)
def test_what_once_failed_comes_to_an_answer_or_to_one_line(file: Path, sound: Path):
    fault = try_case_apart(read_case(file.read_text(encoding="utf-8")), sound)
    assert fault is None, f"{fault.kind}\n{fault.said}"

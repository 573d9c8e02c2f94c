"""Cases that once failed: each goes through its commands to an answer, or to one clear line."""

from __future__ import annotations

from pathlib import Path

import pytest
from tests.fuzz.case import read_case
from tests.fuzz.commands import try_case_apart

pytestmark = pytest.mark.slow

KEPT = sorted((Path(__file__).parent / "kept").glob("*.json"))


@pytest.mark.parametrize("file", KEPT, ids=lambda file: file.stem)
def test_what_once_failed_comes_to_an_answer_or_to_one_line(file: Path):
    fault = try_case_apart(read_case(file.read_text(encoding="utf-8")))
    assert fault is None, f"{fault.kind}\n{fault.said}"

"""Cases that once failed: each goes through its commands to an answer, or to one clear line."""

from __future__ import annotations

from pathlib import Path

import pytest
from tests.fuzz.apart import try_case_apart
from tests.fuzz.case import read_case

pytestmark = pytest.mark.slow

CASES = {
    file.stem: file.read_text(encoding="utf-8") for file in sorted((Path(__file__).parent / "kept").glob("*.json"))
}
# A sound workspace takes half a minute to make; what these cases showed has tests of its own.
KEPT = [
    pytest.param(text, id=name, marks=pytest.mark.nightly if read_case(text).sound else ())
    for name, text in CASES.items()
]


@pytest.fixture(scope="module")
def sound(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Where what is sound is made, by the first case that needs it."""
    return tmp_path_factory.mktemp("sound")


@pytest.mark.parametrize("text", KEPT)
def test_what_once_failed_comes_to_an_answer_or_to_one_line(text: str, sound: Path):
    fault = try_case_apart(read_case(text), sound)
    assert fault is None, f"{fault.kind}\n{fault.said}"

"""What diagnoses of tests may go without."""

from __future__ import annotations

from collections.abc import Iterator

import pytest


@pytest.fixture(scope="module")
def no_experiment() -> Iterator[None]:
    """Design no next experiment, which is half of a small diagnosis' time, where what it blames is all that counts."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("irtwin.gap.diagnosis.next_experiment", lambda *_: None)
        yield

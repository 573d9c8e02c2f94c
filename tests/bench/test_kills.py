"""A few of the kills that `bench/kills.py` makes by the dozen."""

from __future__ import annotations

import pytest

import kills


@pytest.mark.slow
@pytest.mark.parametrize("command", ["run", "live", "diagnose", "restore", "repair"])
def test_a_killed_command_can_be_done_again(command: str) -> None:
    assert kills.main(2, [command], seed=11) == 0

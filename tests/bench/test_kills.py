"""A few of the kills that `bench/kills.py` makes by the dozen."""

from __future__ import annotations

import random
from pathlib import Path

import pytest

import kills


@pytest.fixture(scope="module")
def commands(tmp_path_factory: pytest.TempPathFactory) -> dict[str, kills.Command]:
    return kills.prepared(tmp_path_factory.mktemp("kills"))


@pytest.mark.slow
@pytest.mark.nightly
@pytest.mark.parametrize("kind", ["run", "live", "diagnose", "repair"])
def test_a_killed_command_can_be_done_again(commands: dict[str, kills.Command], kind: str, tmp_path: Path) -> None:
    assert kills.killed_often(kind, commands[kind], 1, random.Random(11), tmp_path / "tried") == 0


@pytest.mark.nightly
@pytest.mark.parametrize("kind", ["fleet", "restore", "live of 20"])
def test_ten_kills(commands: dict[str, kills.Command], kind: str, tmp_path: Path) -> None:
    assert kills.killed_often(kind, commands[kind], 10, random.Random(12), tmp_path / "tried") == 0

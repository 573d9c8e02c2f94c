"""A disk that fills, as a limit on the size of files makes it: one line, exit status 2, and the earlier state."""

from __future__ import annotations

import resource
import shutil
from functools import partial
from pathlib import Path

import pytest

from tests.data_sets import irtwin
from tests.forks import Command
from tests.small_robots import data_set

pytestmark = pytest.mark.slow
BY_DAY = (("run", 40), ("workspace backup", 40))


@pytest.mark.parametrize(
    ("command", "size"),
    [
        pytest.param(command, size, marks=() if (command, size) in BY_DAY else pytest.mark.nightly)
        for command in ("run", "workspace backup")
        for size in (1, 8, 40, 200, 1000)
    ],
)
def test_a_full_disk_is_one_line(small_run: Path, tmp_path: Path, command: str, size: int) -> None:
    """size: kB that the longest file may have, so that each step of the way is met by one."""
    workspace = shutil.copytree(small_run / "workspace", tmp_path / "workspace")
    what = data_set(tmp_path / "second", "Second", seed=5) if command == "run" else tmp_path / "kept.zip"
    asked = ("query", "energy_per_run", "--workspace", workspace, "--format", "csv")
    before = irtwin(*asked).out
    limit = partial(resource.setrlimit, resource.RLIMIT_FSIZE, (size << 10, size << 10))
    done = Command(*command.split(), what, "--workspace", workspace, prepare=limit)
    _, said = done.communicate()
    assert done.returncode == 2, said
    assert "Traceback" not in said
    assert said.splitlines()[-1].startswith("irtwin: ")
    assert irtwin(*asked).out == before
    assert not (tmp_path / "kept.zip").exists()
    assert {file.name for file in workspace.glob(".*")} <= {".graph.turn"}  # a lock, which is nobody's

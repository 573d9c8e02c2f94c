"""A sound workspace, its backup and a fleet's results, made once: what is spoilt afterwards is a copy."""

from __future__ import annotations

import json
import math
import shutil
from functools import partial
from pathlib import Path

from tests.fuzz.child import in_child
from tests.fuzz.run_irtwin import run_irtwin
from tests.fuzz.streams import NOON
from tests.small_robots import data_set

ROBOT = "arm"
PARTS = ("workspace", "given.zip", "fleet")


class Sound:
    """What is sound, of an arm of some joints, in a folder that is filled when it is first needed."""

    def __init__(self, folder: Path, joints: int) -> None:
        self._folder, self._joints = folder / f"of_{joints}_joints", joints

    def copy(self, part: str, folder: Path) -> None:
        """Put one of `PARTS` into the folder of a case."""
        source = self._folder / part
        if not source.exists():
            self._make()
        (shutil.copytree if source.is_dir() else shutil.copy)(source, folder / part)

    def _make(self) -> None:
        """Take a robot in, find its gap, watch it until it has an alarm; back all that up."""
        folder, joints = self._folder, self._joints
        folder.mkdir()
        data, workspace, archive, fleet, stream = (folder / name for name in ("data", *PARTS, "stream"))
        made = in_child(lambda: data_set(data, ROBOT, joints=joints) and None, folder)
        assert made.status == 0, made.err
        stream.write_text("".join(_line(number, joints) for number in range(500)))
        into = ["--workspace", str(workspace)]
        for words in (
            ["run", str(data), *into],
            ["diagnose", str(data), *into],
            ["live", *into],
            ["backup", str(archive), *into],
            ["fleet", "diagnose", str(data), "--workers", "1", "--out", str(fleet)],
        ):
            done = in_child(partial(run_irtwin, words), folder, stream if words[0] == "live" else None)
            assert done.status == 0, done.err


def _line(number: int, joints: int) -> str:
    time = NOON + number / 20
    said = {"robot": ROBOT, "time": time, "position": [0.3 * math.sin(time + joint) for joint in range(joints)]}
    return json.dumps(said | {"effort": [90.0] * joints, "power": 5000.0}) + "\n"

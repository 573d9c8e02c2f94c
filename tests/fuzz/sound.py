"""A sound workspace, its backup and a fleet's results, each made once: what is spoilt afterwards is a copy."""

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


class Sound:
    """What is sound, of an arm of some joints, in a folder that is filled when it is first needed."""

    def __init__(self, folder: Path, joints: int) -> None:
        self._folder, self._joints = folder / f"of_{joints}_joints", joints

    def copy(self, part: str, folder: Path) -> None:
        """Put a part into the folder of a case: "data", "workspace", "given.zip" or "fleet"."""
        source = self._part(part)
        (shutil.copytree if source.is_dir() else shutil.copy)(source, folder / part)

    def _part(self, part: str) -> Path:
        """Make a part unless it is there, of those that it is made of."""
        place = self._folder / part
        if not place.exists():
            made = {"data": self._data, "workspace": self._watched, "given.zip": self._backup, "fleet": self._fleet}
            made[part](place)
        return place

    def _data(self, place: Path) -> None:
        place.parent.mkdir(exist_ok=True)
        made = in_child(lambda: data_set(place, ROBOT, joints=self._joints) and None, self._folder)
        assert made.status == 0, made.err

    def _watched(self, place: Path) -> None:
        """Take a robot in, find its gap, watch it until it has an alarm."""
        data, into = self._part("data"), ("--workspace", place)
        stream = self._folder / "stream"
        stream.write_text("".join(_line(number, self._joints) for number in range(500)))
        self._do("run", data, *into)
        self._do("diagnose", data, *into)
        self._do("live", *into, stdin=stream)

    def _backup(self, place: Path) -> None:
        self._do("workspace", "backup", place, "--workspace", self._part("workspace"))

    def _fleet(self, place: Path) -> None:
        self._do("diagnose", self._part("data"), "--workers", "1", "--out", place)

    def _do(self, *words: str | Path, stdin: Path | None = None) -> None:
        done = in_child(partial(run_irtwin, list(map(str, words))), self._folder, stdin)
        assert done.status == 0, done.err


def _line(number: int, joints: int) -> str:
    time = NOON + number / 20
    said = {"robot": ROBOT, "time": time, "position": [0.3 * math.sin(time + joint) for joint in range(joints)]}
    return json.dumps(said | {"effort": [90.0] * joints, "power": 5000.0}) + "\n"

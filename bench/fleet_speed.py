"""Robots a minute through `irtwin run`, by 1, 2 and 4 processes: `python fleet_speed.py [ROBOTS]`.

A robot is an arm of two joints with three runs of 8 s; its time is that of reading, fitting, mapping, reasoning and its
page, not of its samples. Every way begins with an empty folder.
"""

from __future__ import annotations

import sys
import tempfile
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))
from tests import small_robots

from irtwin.fleet.fleet import work

WAYS = (1, 2, 4)


def robots_a_minute(source: Path, count: int, workers: int) -> float:
    """Take a fleet through `run`, and return how many robots a minute were done."""
    with tempfile.TemporaryDirectory() as out:
        began = time.monotonic()
        found = work(source, Path(out), "run", batch=100, workers=workers)
        assert found.counts == {"done": count}, found
        return 60 * count / (time.monotonic() - began)


def main(count: int) -> None:
    with tempfile.TemporaryDirectory() as folder:
        source = Path(folder)
        for k in range(count):
            small_robots.data_set(source / f"robot_{k:04d}", f"Arm {k:04d}", seed=10 * k)
        print("| workers | robots a minute |\n| --- | --- |")
        for workers in WAYS:
            print(f"| {workers}, processes | {robots_a_minute(source, count, workers):.1f} |", flush=True)


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 24)

"""What processes do that write to one workspace at once, in a module that such a process imports once."""

from __future__ import annotations

import signal
from multiprocessing.connection import Connection
from pathlib import Path

from irtwin.rewriting import map_rows, rewriting
from irtwin.storage import engine
from irtwin.storage.database import Workspace
from tests import rows

NAMES = ("A", "B")


def taken_in(folder: Path, url: str | None, name: str) -> None:
    """Take in a robot, then a robot that all take in, each time with rows and graph."""
    for robot_id, number in ((name, 1), ("shared", NAMES.index(name) + 2)):
        with Workspace(folder, url) as place, rewriting(place) as graph:
            place.ingest(*data_set(robot_id, number))
            map_rows(place, graph)


def data_set(robot_id: str, number: int) -> tuple[object, ...]:
    robot, parts, runs, series = rows.data_set()
    for row in (robot, *parts, *runs):
        row.robot_id = robot_id
    robot.name = robot_id
    for run in runs:
        run.run_id = f"{robot_id}.{run.name}"
        run.repeat_of = run.repeat_of and f"{robot_id}.{run.repeat_of.partition('.')[2]}"
    return robot, parts, runs, {f"{robot_id}.{key.partition('.')[2]}": rows.samples(number) for key in series}


def hold(folder: Path, url: str | None, ready: Connection) -> None:
    """Hold all that a writer may hold, for good."""
    with Workspace(folder, url) as place, rewriting(place), engine.writing(place.engine):
        ready.send_bytes(b".")
        signal.pause()

"""A robot worked on apart: what is made of it takes its place in the workspace at once, or not at all."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager

from irtwin.errors import InputError
from irtwin.storage import engine, files
from irtwin.storage import rows as robot_rows
from irtwin.storage.database import Workspace
from irtwin.storage.rows import Tables
from irtwin.storage.series import is_whole

_PREFIX = ".staged-"


@contextmanager
def staged(place: Workspace, robot_id: str) -> Iterator[Workspace]:
    """Give a workspace that holds one robot, with its data set, its plans and all that was derived, but no live runs.

    Where the block ends well, what the robot is there replaces in one transaction what it was. Else all stays as it
    was, and so it does where the process is killed. Others may read and write meanwhile.
    """
    with (
        files.working_folder(place.folder, _PREFIX) as folder,
        Workspace(folder, resources=place.resources, base=place.base) as apart,
    ):
        before = _rows(place, robot_id)
        whole = _put(place, before, apart, robot_id)
        try:
            yield apart
        except InputError as error:
            error.args = (str(error).replace(str(folder), str(place.folder)),)
            raise
        after = _rows(apart, robot_id)
        if after != before or whole != {file.path for file in robot_rows.files_of(before)}:
            _put(apart, after, place, robot_id)
            place.remove_orphans()


def _rows(place: Workspace, robot_id: str) -> Tables:
    with place.reading() as session:
        return robot_rows.recorded_rows(session, robot_id)


def _put(source: Workspace, rows: Tables, target: Workspace, robot_id: str) -> set[str]:
    """Make the rows, and the files that they name, all that the target has of the robot but its live runs.

    Returns the files that were whole; whoever needs another says so.
    """
    with engine.writing(target.engine) as session:
        named = robot_rows.files_of(rows)
        whole = {file.path for file in named if is_whole(source.folder, file.path, file.sha256)}
        for path in whole:
            _link(source, target, path)
        of_live = robot_rows.modelled_of_live_runs(session, robot_id)
        robot_rows.drop_recorded(session, robot_id)
        for robot in rows["robot"]:
            robot_rows.put_robot(session, robot)
        robot_rows.insert_values(session, {**rows, "robot": []})
        if {row["twin_id"] for row in of_live["run_energy"]} <= {row["twin_id"] for row in rows["twin"]}:
            robot_rows.insert_values(session, of_live)  # it is the same twin: what it says of live runs holds
        robot_rows.release_plans(session, robot_id)
    return whole


def _link(source: Workspace, target: Workspace, path: str) -> None:
    """Give a file of one workspace a name in the other, in place of a damaged one."""
    file = target.file(path)
    file.parent.mkdir(exist_ok=True)
    linked = file.with_name(f".{file.name}.tmp")
    linked.unlink(missing_ok=True)
    os.link(source.file(path), linked)
    files.put_in_place(linked, file)
    linked.unlink(missing_ok=True)  # it was the same file already

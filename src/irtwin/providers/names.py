"""Names of robots and runs: as they stand in IRIs, keys and files, and the robot or run that a user means."""

from __future__ import annotations

import difflib
import hashlib
import re
import unicodedata

from sqlalchemy import select

from irtwin.errors import InputError
from irtwin.storage.database import Workspace
from irtwin.storage.schema import MEASURED_RUN, PLANNED_RUN, RobotRow, RunRow

_PLAIN = re.compile(r"[A-Za-z0-9_-]{1,200}")  # longer ones leave no room for the rest of a file's name
_READABLE = 40  # characters of a name that is not plain


def identifier(name: str) -> str:
    """Return a name as it stands in IRIs, keys and names of files; other names have others.

    Letters, digits, "_" and "-" stay as they are. Any other name, and one too long for a file's, is what of it can be
    read, "~", and a checksum of the whole. Two ways to write the same letters in Unicode are the same name.
    """
    name = unicodedata.normalize("NFC", name)
    if _PLAIN.fullmatch(name):
        return name
    readable = re.sub(r"[^A-Za-z0-9_-]+", "_", name)[:_READABLE]
    return f"{readable}~{hashlib.sha256(name.encode(errors='surrogatepass')).hexdigest()[:16]}"


def find_robot(workspace: Workspace, name: str | None) -> str:
    """Return the robot_id of a robot by its name, of the only one where None.

    Raises InputError, with the nearest name, where there is none, or where there are others.
    """
    known = _names(workspace)
    if name is None and len(known) == 1:
        return next(iter(known))
    if name is None:
        shown = ", ".join(sorted(known.values())[:10]) or "none: run a data set first"
        raise InputError(f"{workspace.folder}: say which robot by --robot; known are {shown}")
    for robot_id, of in known.items():
        if name == robot_id or identifier(of) == identifier(name):
            return robot_id
    near = difflib.get_close_matches(name, known.values(), 1, 0.0)
    hint = f'the nearest is "{near[0]}"' if near else "it has none; run a data set first"
    raise InputError(f'{workspace.folder}: no robot "{name}" here; {hint}')


_CALLED = {None: "run", PLANNED_RUN: "planned run", MEASURED_RUN: "measured run"}


def find_run(workspace: Workspace, robot_id: str, name: str, kind: str | None = None) -> RunRow:
    """Return a robot's run, of a kind if one is given, by its name; InputError, with the nearest, where there is none.

    kind: PLANNED_RUN or MEASURED_RUN.
    """
    of_robot = select(RunRow).where(RunRow.robot_id == robot_id)
    known = {row.name: row for row in workspace.all(of_robot if kind is None else of_robot.where(RunRow.kind == kind))}
    for row in known.values():
        if name == row.run_id or identifier(row.name) == identifier(name):
            return row
    near = difflib.get_close_matches(name, known, 1, 0.0)
    hint = f'the nearest is "{near[0]}"' if near else "it has none"
    raise InputError(f'{workspace.folder}: the robot has no {_CALLED[kind]} "{name}"; {hint}')


def check_name(workspace: Workspace, name: str) -> None:
    """Raise InputError where a robot of this name would be taken for another of the workspace."""
    for robot_id, known in _names(workspace).items():
        if robot_id != identifier(name) and _folded(known) == _folded(name):
            raise InputError(
                f'{workspace.folder}: robot "{name}" differs from "{known}" there in upper and lower case or in the '
                f"form of letters alone; use the same spelling for the same robot, another name for another"
            )


def check_run_name(workspace: Workspace, robot_id: str, name: str) -> None:
    """Raise InputError where a robot has a run of this name, in any form of Unicode, upper or lower case."""
    for other in workspace.all(select(RunRow.name).where(RunRow.robot_id == robot_id)):
        if _folded(other) == _folded(name):
            raise InputError(f'{workspace.folder}: the robot has a run "{other}" already; choose another name')


def robot_iri(robot_id: str) -> str:
    """Return the IRI of a robot's individual, below the workspace's base: see `KnowledgeGraph.iri`."""
    return f"robot/{robot_id}"


def run_iri(run_id: str) -> str:
    """Return the IRI of a run's individual, likewise."""
    return f"run/{run_id}"


def twin_iri(twin_id: str) -> str:
    """Return the IRI of a twin's individual, likewise."""
    return f"twin/{twin_id}"


def _names(workspace: Workspace) -> dict[str, str]:
    with workspace.reading() as session:
        return {robot_id: name for robot_id, name in session.execute(select(RobotRow.robot_id, RobotRow.name))}


def _folded(name: str) -> str:
    return unicodedata.normalize("NFKC", unicodedata.normalize("NFKC", name).casefold())

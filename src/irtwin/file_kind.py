"""What a file or folder is to irtwin, and what one can do with it."""

from __future__ import annotations

import re
import shlex
from collections import Counter
from pathlib import Path
from typing import Any

from irtwin.bring.metered import is_metered
from irtwin.bring.recording import BAGS, SHEETS
from irtwin.errors import InputError
from irtwin.input_file import check_file
from irtwin.storage.database import Workspace
from irtwin.toml_file import read_toml

_TEXTS = (".csv", ".tsv", ".txt")
_LOGS = (*_TEXTS, ".parquet", *SHEETS, *BAGS)
_GRAPHS = (".ttl", ".owl", ".rdf", ".nt", ".nq", ".trig", ".jsonld")
_HEAD = 4096  # bytes that tell a URDF from a model of MuJoCo


class FileKind:
    """What something is, and the commands that take it, each with what it does."""

    def __init__(self, what: str, *commands: tuple[str, str]) -> None:
        self.what, self.commands = what, commands


def file_kind(path: Path) -> FileKind:
    """Return what a file or folder is. Raises InputError where it is nothing that irtwin takes, or cannot be read."""
    shown, suffix = shlex.quote(str(path)), path.suffix.lower()
    if path.is_dir():
        return _folder(path, shown)
    if suffix in _TEXTS and is_metered(names_of(path)):
        made = "makes a data set of it, for `irtwin run FOLDER`: load, standby, cycles and cost, without a twin"
        return FileKind("a meter's log: power or energy, and no joint", (f"irtwin import {shown} --out FOLDER", made))
    if suffix in _LOGS:
        made = "makes a data set of it, and says what each column is"
        return FileKind("a log", (f"irtwin import {shown} --robot ROBOT.urdf --out FOLDER", made))
    if suffix in (".urdf", ".xml"):
        return _model(path, shown)
    if suffix == ".json":
        return FileKind(
            "a twin, if `--save-twin` wrote it",
            (f"irtwin predict {shown} RUN --out FILE", "torque, power and energy that it expects of a motion"),
            (f"irtwin plan {shown} --from POSE --to POSE --out FILE", "a motion, and what it costs"),
            (f"irtwin diagnose DATASET --twin {shown}", "where new logs differ from it, and why"),
        )
    if suffix == ".zip":
        command = f"irtwin workspace restore {shown} --workspace NEW"
        return FileKind("an archive, if `irtwin workspace backup` wrote it", (command, "makes a workspace of it"))
    if suffix in _GRAPHS:
        command = f"irtwin workspace reason {shown} --out FILE"
        return FileKind("a graph", (command, "draws all conclusions from it, by OWL 2 RL"))
    raise InputError(
        f"{path}: neither a data set, a workspace, a log ({', '.join(_LOGS)}), a robot (.urdf), a model of MuJoCo "
        "(.xml), a twin (.json) nor an archive (.zip); `irtwin --help` lists what can be done"
    )


def names_of(path: Path) -> list[str]:
    """Return the names in the first line of a text. Raises InputError where it is no file that can be read."""
    check_file(path)
    with path.open("rb") as file:
        first = file.readline(_HEAD).decode("utf-8", errors="replace")
    return [name.strip().strip('"') for name in re.split(r"[;,\t]", first)]


def _folder(path: Path, shown: str) -> FileKind:
    if (path / "dataset.toml").is_file():
        return FileKind(
            _data_set(read_toml(path / "dataset.toml")),
            (f"irtwin check {shown}", "looks for faults of its logs: signs, swapped columns, units, dead channels"),
            (f"irtwin run {shown}", "builds twin, graph and energy report"),
            (f"irtwin diagnose {shown} --report gap.html", "says where twin and robot differ, and why"),
        )
    if Workspace.is_there(path):
        return FileKind(
            "a workspace",
            (f"irtwin workspace status --workspace {shown}", "what is in it"),
            (f"irtwin serve --workspace {shown}", "its pages, in the browser, and its SPARQL endpoint"),
            (f"irtwin query --workspace {shown}", "the questions that it answers"),
        )
    if sets := len(list(path.glob("*/dataset.toml"))):
        return FileKind(
            f"a folder with {sets} data set{'s' if sets > 1 else ''}",
            (f"irtwin run {shown} --out RESULTS", "builds twin, graph and energy report of each"),
            (f"irtwin diagnose {shown} --out RESULTS", "says of each where twin and robot differ, and why"),
        )
    logs = sorted(file for file in path.iterdir() if file.suffix.lower() in _LOGS)
    if not logs:
        raise InputError(
            f"{path}: a folder without dataset.toml, workspace or logs ({', '.join(_LOGS)}); name a file in it, or "
            "make a data set: `irtwin import --robot ROBOT.urdf --out FOLDER`"
        )
    command = f"irtwin import {shown}/*{logs[0].suffix} --robot ROBOT.urdf --out FOLDER"
    words = f"a folder with {len(logs)} log{'s' if len(logs) > 1 else ''}"
    return FileKind(words, (command, "makes a data set of them, a run a file"))


def _data_set(document: dict[str, Any]) -> str:
    """Return a data set's robot and runs in words."""
    robot, runs = document.get("robot"), document.get("run")
    name = robot.get("name") if isinstance(robot, dict) else None
    listed = [run for run in runs if isinstance(run, dict)] if isinstance(runs, list) else []
    roles = Counter(str(run.get("role", "observed")) for run in listed)
    counted = ", ".join(f"{count} {role}" for role, count in roles.items())
    return f"a data set of {name or 'a robot'}, {len(listed)} runs" + (f" ({counted})" if counted else "")


def _model(path: Path, shown: str) -> FileKind:
    check_file(path)
    with path.open("rb") as file:
        head = file.read(_HEAD)
    if b"<mujoco" in head:
        command = f"irtwin diagnose DATASET --simulator {shown} --save-simulator NEW.xml"
        return FileKind(
            "a model of MuJoCo",
            (command, "says what it has otherwise than the robot, and mends it"),
            (f"irtwin diagnose DATASET --simulator {shown} --play", "how far it is from the robot, told its commands"),
        )
    return FileKind(
        "a robot's description",
        (f"irtwin import LOG --robot {shown} --out FOLDER", "makes a data set of a log of this robot"),
        (f"irtwin robot excite {shown} --seconds 20 --out motion.csv", "a motion that shows all that a twin needs"),
        (f"irtwin robot dh {shown}", "its Denavit-Hartenberg table"),
    )

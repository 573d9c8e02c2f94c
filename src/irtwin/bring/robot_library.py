"""Robots by name: those that ship, and those of the package example-robot-data where it is installed."""

from __future__ import annotations

import difflib
from functools import cache
from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path

from irtwin import resources
from irtwin.errors import InputError
from irtwin.robot.description import Robot
from irtwin.robot.urdf import read_urdf
from irtwin.signals.log import read_robot

_PACKAGE = "example-robot-data"


def robot_of(said: str) -> tuple[Robot, str]:
    """Return the robot of a URDF file, a data set, its dataset.toml, or of a name; and where it is from, in words.

    Raises InputError, with the names that are known, where there is none.
    """
    path = Path(said)
    if path.exists():
        return read_robot(path), str(path)
    known = {_plain(name): (name, file) for name, file in robots().items()}
    found = known.get(_plain(said))
    if found is not None:
        return read_urdf(found[1]), f"{found[0]} of {_home(found[1])}"
    near = difflib.get_close_matches(_plain(said), known, 5, 0.5)
    names = ", ".join(known[name][0] for name in near or sorted(known))
    more = "" if _installed() else '; pip install "irtwin[robots]" brings others, as ur10 and panda'
    raise InputError(
        f"{said}: there is no such file, and no robot of that name; there {_are(near)} {names[:500]}{more}"
    )


@cache
def robots() -> dict[str, Path]:
    """Return the URDF files of all robots that are known by a name."""
    shipped = {file.stem: file for file in sorted((resources.folder("ontology") / "robots").glob("*.urdf"))}
    others: dict[str, Path] = {}
    for file in _installed():
        name = file.stem.removesuffix("_robot")
        others[file.stem if name in others else name] = file
    return {**others, **shipped}


def _installed() -> list[Path]:
    try:
        files = distribution(_PACKAGE).files or []
    except PackageNotFoundError:
        return []
    return sorted(Path(str(file.locate())) for file in files if file.suffix == ".urdf")


def _home(file: Path) -> str:
    return "irtwin" if file.is_relative_to(resources.folder("ontology").resolve()) else _PACKAGE


def _plain(name: str) -> str:
    return "".join(sign for sign in name.lower() if sign.isalnum())


def _are(near: list[str]) -> str:
    return "are" if len(near) != 1 else "is"

"""Robots by name: those that ship, and those of the package example-robot-data where it is installed."""

from __future__ import annotations

import difflib
from collections.abc import Sequence
from dataclasses import replace
from fnmatch import fnmatchcase
from functools import cache
from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path
from xml.etree.ElementTree import tostring

from defusedxml.ElementTree import fromstring

from irtwin import resources
from irtwin.errors import InputError
from irtwin.robot.description import Robot
from irtwin.robot.urdf import parse_urdf, read_urdf
from irtwin.signals.log import read_robot

_PACKAGE = "example-robot-data"


def robot_of(source: str) -> tuple[Robot, str]:
    """Return the robot of a URDF file, a data set, its dataset.toml, or of a name; and where it is from, in words.

    Raises InputError, with the names that are known, where there is none.
    """
    path = Path(source)
    if path.exists():
        return read_robot(path), str(path)
    known = {_plain(name): (name, file) for name, file in robots().items()}
    robot = known.get(_plain(source))
    if robot is not None:
        home = "irtwin" if robot[1].is_relative_to(resources.folder("ontology")) else _PACKAGE
        return read_urdf(robot[1]), f"{robot[0]} of {home}"
    near = difflib.get_close_matches(_plain(source), known, 5, 0.5)
    names = ", ".join(known[name][0] for name in near or sorted(known))
    more = "" if _installed() else '; pip install "irtwin[robots]" brings others, as ur10 and panda'
    raise InputError(
        f"{source}: there is no such file, and no robot of that name; there {'is' if len(near) == 1 else 'are'} "
        f"{names[:500]}{more}"
    )


@cache
def robots() -> dict[str, Path]:
    """Return the URDF files of all robots that are known by a name."""
    shipped = {file.stem: file for file in sorted((resources.folder("ontology") / "robots").glob("*.urdf"))}
    files = _installed()
    whole = {file.stem.removesuffix("_robot"): file for file in files if file.stem.endswith("_robot")}
    return {**{file.stem: file for file in files}, **whole, **shipped}


def with_fixed(robot: Robot, patterns: Sequence[str]) -> Robot:
    """Return a robot some of whose joints, and those that mimic them, are fixed at zero. Raises InputError.

    patterns: names of joints, in which * stands for any letters; what mimics others is held already.
    """
    joints: set[str] = set()
    for pattern in patterns:
        named = [name for name in (*robot.joint_names, *robot.held) if name == pattern or fnmatchcase(name, pattern)]
        if not named:
            raise InputError(
                f'--fixed {pattern}: the robot has no joint "{pattern}" (it has {", ".join(robot.joint_names)})'
            )
        joints |= set(named) - set(robot.held)
    if not joints:
        return robot
    root = fromstring(robot.urdf.encode())
    for joint in root.findall("joint"):
        mimic = joint.find("mimic")
        if joint.get("name") in joints or (mimic is not None and mimic.get("joint") in joints):
            joint.set("type", "fixed")
            for part in [*joint.findall("axis"), *joint.findall("limit"), *joint.findall("mimic")]:
                joint.remove(part)
    fixed = parse_urdf(tostring(root, encoding="unicode"))
    sheets = {joint.name: joint for joint in robot.joints}
    return replace(
        fixed, name=robot.name, joints=tuple(sheets[joint.name] for joint in fixed.joints), weight=robot.weight,
        manufacturer=robot.manufacturer, type=robot.type,
    )  # fmt: skip


def _installed() -> list[Path]:
    try:
        files = distribution(_PACKAGE).files or []
    except PackageNotFoundError:
        return []
    return sorted(Path(str(file.locate())) for file in files if file.suffix == ".urdf")


def _plain(name: str) -> str:
    return "".join(sign for sign in name.lower() if sign.isalnum())

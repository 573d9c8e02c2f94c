"""Names as ROS takes them: in URDF, SRDF, parameters, topics and messages."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Collection, Iterable
from itertools import chain, count

from irtwin.robot.description import Robot

_LONGEST = 100  # characters: files are named so too
_VALID = re.compile(rf"[A-Za-z][A-Za-z0-9_]{{0,{_LONGEST - 1}}}")


def ros_names(names: Iterable[str], otherwise: str) -> dict[str, str]:
    """Return each name as ROS takes it: an ASCII letter, then letters, digits and "_"; no two become one.

    A valid name stays. Any other is cut at 100 characters, accents go and what is no letter becomes "_"; before a
    digit, or where nothing is left, comes `otherwise`.
    """
    given = list(dict.fromkeys(names))
    taken = {name for name in given if _VALID.fullmatch(name)}
    made: dict[str, str] = {}
    for name in given:
        made[name] = name if name in taken else free_name(_valid(name, otherwise), taken)
        taken.add(made[name])
    return made


def ros_joints(robot: Robot) -> dict[str, str]:
    """Return the moving joints' names as ROS takes them, by name."""
    return ros_names(robot.joint_names, "joint")


def ros_package(robot: str) -> str:
    """Return the name of a robot's ROS package: small letters, digits and single "_"."""
    return re.sub(r"_+", "_", f"{_valid(robot, 'robot')}_description".lower())


def _valid(name: str, otherwise: str) -> str:
    ascii_only = unicodedata.normalize("NFKD", name).encode("ascii", "ignore").decode()
    words = re.sub(r"[^A-Za-z0-9_]+", "_", ascii_only).strip("_")[:_LONGEST]
    if not words:
        return otherwise
    return words if words[0].isalpha() else f"{otherwise}_{words}"


def free_name(name: str, taken: Collection[str]) -> str:
    """Return a name, with the first number from 2 on that makes it one that is not taken."""
    return next(
        candidate for candidate in chain([name], (f"{name}_{number}" for number in count(2))) if candidate not in taken
    )

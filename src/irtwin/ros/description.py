"""A robot as ROS' readers take it: names made valid, and what URDF parsers insist on filled in."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

from irtwin.robot.description import Joint, Robot
from irtwin.robot.ros_names import ros_joints, ros_names
from irtwin.robot.structure import Body, Connection, Solid, Structure, structure_of
from irtwin.robot.urdf_text import robot_of

_FAR = 1000.0  # m: limits of a joint that slides without any


@dataclass(frozen=True)
class Described:
    """A robot under ROS' names, its structure, and a line for each thing that had to be changed."""

    robot: Robot
    structure: Structure
    said: tuple[str, ...]


def described(robot: Robot, packaged: Mapping[str, str] | None = None) -> Described:
    """Return a robot as ROS takes it; `packaged`: the names that ROS finds some of its meshes by.

    Raises InputError where a shape of it cannot be read.
    """
    structure = structure_of(robot)
    meshes = packaged or {}
    moving = ros_joints(robot)
    joints = _fixed(structure, moving) | moving
    links = ros_names((body.name for body in structure.bodies), "link")
    (name,) = ros_names([robot.name], "robot").values()
    limits = {joint.name: joint for joint in robot.joints}
    renamed = Structure(
        tuple(_body(body, links) for body in structure.bodies),
        tuple(
            _connection(connection, joints, links, limits.get(connection.name)) for connection in structure.connections
        ),
        tuple(_solid(solid, links, meshes) for solid in structure.solids),
    )
    moved = [_limited(replace(joint, name=joints[joint.name])) for joint in robot.joints]
    again = replace(robot_of(name, renamed, moved, f"{robot.name} for ROS"), manufacturer=robot.manufacturer)
    changed = [("robot", {robot.name: name}), ("joint", joints), ("link", links)]
    renamings = [
        f'{kind} "{old}" is {new} in ROS' for kind, names in changed for old, new in names.items() if old != new
    ]
    return Described(again, renamed, (*renamings, *_changes(robot), *_meshes(structure, meshes)))


def _fixed(structure: Structure, moving: dict[str, str]) -> dict[str, str]:
    """Return the other joints' names, which ROS does not ask for; none is that of a joint that moves."""
    return {
        connection.name: f"{connection.name}_fixed" if connection.name in moving.values() else connection.name
        for connection in structure.connections
        if connection.name not in moving
    }


def _solid(solid: Solid, links: dict[str, str], packaged: Mapping[str, str]) -> Solid:
    file = None if solid.file is None else packaged.get(solid.file, solid.file)
    return replace(solid, link=links[solid.link], file=file)


def _body(body: Body, links: dict[str, str]) -> Body:
    """Return a link whose inertia, without which readers refuse its mass, is that of a point where none is known."""
    point = (0.0,) * 6
    known = body.inertia is not None and all(map(math.isfinite, body.inertia))
    inertia = None if body.mass is None else body.inertia if known else point
    return replace(body, name=links[body.name], inertia=inertia)


def _connection(
    connection: Connection, joints: dict[str, str], links: dict[str, str], limits: Joint | None
) -> Connection:
    unlimited = limits is not None and limits.kind == "revolute" and not _has_limits(limits)
    return replace(
        connection,
        name=joints[connection.name],
        kind="continuous" if unlimited else connection.kind,
        parent=links[connection.parent],
        child=links[connection.child],
    )


def _limited(joint: Joint) -> Joint:
    return joint if joint.kind != "prismatic" or _has_limits(joint) else replace(joint, lower=-_FAR, upper=_FAR)


def _has_limits(joint: Joint) -> bool:
    return math.isfinite(joint.lower) and math.isfinite(joint.upper)


def _changes(robot: Robot) -> Iterator[str]:
    for joint in robot.joints:
        if joint.kind == "revolute" and not _has_limits(joint):
            yield f"joint {joint.name} has no limits: it is continuous in ROS"
        elif joint.kind == "prismatic" and not _has_limits(joint):
            yield f"joint {joint.name} has no limits: its URDF says {_FAR:g} m either way"
    for joint_name in robot.held:
        yield f"joint {joint_name} mimics another: it is fixed in ROS"


def _meshes(structure: Structure, packaged: Mapping[str, str]) -> Iterator[str]:
    files = sorted({solid.file or "" for solid in structure.solids if solid.kind == "mesh"} - packaged.keys())
    packages = sorted({file.split("/")[2] for file in files if file.startswith("package://") and file.count("/") > 2})
    if packages:
        yield f"its meshes are of the ROS package {', '.join(packages)}, which has to be installed"
    for file in files:
        if "://" not in file:
            yield f"ROS finds no mesh by the path {file}; name it as package://NAME/{file.lstrip('./')}"
    if any(solid.purpose == "collision" and solid.kind == "mesh" for solid in structure.solids):
        yield "collision meshes are not opened: of their links only adjacent ones are said to need no check"

"""What of a robot can be seen: its meshes and shapes, or tubes and joint housings made from its kinematics."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from irtwin.robot.description import Robot
from irtwin.robot.kinematics import joint_motions
from irtwin.robot.structure import PURPOSES, Solid, structure_of

_GREY = (0.7, 0.7, 0.72, 1.0)
_TUBE = (0.86, 0.88, 0.90, 1.0)
_HOUSING = (0.16, 0.38, 0.58, 1.0)
_FOOT = (0.35, 0.38, 0.42, 1.0)


@dataclass(frozen=True)
class Part:
    """A box, cylinder (along z), sphere or mesh, fixed to a joint's frame; `joint` is its column, -1 for the base.

    size in m as in robot.structure.Solid; of a mesh, named by `mesh`, the factors that it is stretched by. placement:
    (4, 4), in the joint's frame; colour: RGBA in 0..1.
    """

    joint: int
    kind: str
    size: tuple[float, ...]
    placement: np.ndarray
    colour: tuple[float, ...]
    mesh: str | None = None


def drawn_parts(robot: Robot, meshes: Collection[str] = ()) -> list[Part]:
    """Return the robot's visual shapes, with those of its meshes whose names are given.

    A link that lacks one is seen by its shapes against collisions, if it has any; a robot of which less than half of
    the moving bodies can be seen, by a skeleton.
    """
    parts = _own_shapes(robot, meshes)
    seen = {part.joint for part in parts if part.joint >= 0}
    return parts if 2 * len(seen) >= len(robot.joints) else _skeleton(robot)


def joint_axes(robot: Robot) -> np.ndarray:
    """Return each joint's axis in its own frame, (n, 3): the same at every position."""
    return np.asarray(joint_motions(robot.model).reshape(-1, 2, 3).sum(axis=1))  # it slides or turns


def meshes_missing(robot: Robot, meshes: Collection[str]) -> list[str]:
    """Return the names of the meshes that the robot would be seen by, other than those given."""
    named = (solid.file for solid in structure_of(robot).solids if solid.purpose == "visual")
    return [name for name in dict.fromkeys(named) if name is not None and name not in meshes]


def _own_shapes(robot: Robot, meshes: Collection[str]) -> list[Part]:
    parts = []
    solids = structure_of(robot).solids
    for link in robot.links:
        visual, collision = (
            [s for s in solids if s.link == link.name and s.purpose == purpose] for purpose in PURPOSES
        )
        whole = bool(visual) and all(_can_be_drawn(solid, meshes) for solid in visual)
        stand_in = [] if whole else [solid for solid in collision if _can_be_drawn(solid, meshes)]
        frame = robot.model.frames[robot.model.getFrameId(link.name, pin.FrameType.BODY)]
        for solid in stand_in or [solid for solid in visual if _can_be_drawn(solid, meshes)]:
            placement = frame.placement.homogeneous @ solid.origin.transform
            colour = solid.colour or _GREY
            parts.append(Part(frame.parentJoint - 1, solid.kind, solid.size, placement, colour, solid.file))
    return parts


def _can_be_drawn(solid: Solid, meshes: Collection[str]) -> bool:
    return solid.file is None or solid.file in meshes


def _skeleton(robot: Robot) -> list[Part]:
    """Return a housing around each joint's axis and a tube from joint to joint, thinner towards the flange."""
    model = robot.model
    reach = sum(float(np.linalg.norm(place.translation)) for place in model.jointPlacements)
    thick = 0.045 * max(reach, 0.1)
    radii = [thick * (1 - 0.55 * column / max(len(robot.joints) - 1, 1)) for column in range(len(robot.joints))]
    parts = [Part(-1, "cylinder", (1.7 * thick, 0.5 * thick), _at(np.array([0, 0, 0.25 * thick])), _FOOT)]
    for column, (radius, axis) in enumerate(zip(radii, joint_axes(robot), strict=True)):
        placement = model.jointPlacements[column + 1]
        parent = model.parents[column + 1] - 1
        below = 1.25 * radius - placement.translation[2] if parent < 0 else 0.0  # the floor
        lifted = placement.rotation.T @ np.array([0.0, 0.0, max(below, 0.0)])
        parts.append(Part(column, "cylinder", (1.15 * radius, 2.5 * radius), _along(axis, lifted), _HOUSING))
        parts += _tube(parent, np.array(placement.translation), radius if parent < 0 else radii[parent])
    for frame in model.frames:
        if frame.type == pin.FrameType.BODY and frame.parentJoint > 0:
            parts += _tube(frame.parentJoint - 1, np.array(frame.placement.translation), radii[frame.parentJoint - 1])
    last, radius = len(radii) - 1, radii[-1]
    return [*parts, Part(last, "sphere", (1.1 * radius,), np.eye(4), _TUBE)]


def _tube(joint: int, end: np.ndarray, radius: float) -> list[Part]:
    """Return a capsule from the joint's origin to `end`, (3,) m; nothing where they coincide."""
    length = float(np.linalg.norm(end))
    if length < 1e-6:
        return []
    tube = Part(joint, "cylinder", (0.8 * radius, length), _along(end / length, end / 2), _TUBE)
    return [tube, Part(joint, "sphere", (0.8 * radius,), _at(end), _TUBE)]


def _at(position: np.ndarray) -> np.ndarray:
    return np.asarray(pin.SE3(np.eye(3), position.astype(float)).homogeneous)


def _along(direction: np.ndarray, centre: np.ndarray) -> np.ndarray:
    """Return the placement whose z axis is `direction`, (3,) of length one."""
    turn = pin.Quaternion.FromTwoVectors(np.array([0.0, 0.0, 1.0]), direction).toRotationMatrix()
    return np.asarray(pin.SE3(turn, centre.astype(float)).homogeneous)

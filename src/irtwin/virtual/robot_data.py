"""A robot for the page: what robot.js builds it of, and the scripts that this takes."""

from __future__ import annotations

import gzip
from collections.abc import Mapping, Sequence
from functools import cache
from importlib.resources import files
from typing import Any

import numpy as np
import pinocchio as pin
from markupsafe import Markup

from irtwin.packing import base64_text, pack
from irtwin.robot.description import Robot
from irtwin.robot.kinematics import flange, link_placements
from irtwin.robot.meshes import Mesh, simplified
from irtwin.virtual.skeleton import Part, drawn_parts, joint_axes

_VIEWED = 60  # poses that the camera is fitted to
_ALL_TRIANGLES = 40_000  # of all meshes: 0.8 MB of page
_MOST_TRIANGLES, _FEWEST_TRIANGLES = 8_000, 300  # of a mesh


def robot_data(robot: Robot, q: np.ndarray, meshes: Mapping[str, Mesh] | None = None) -> dict[str, Any]:
    """Return what robot.js builds a robot of: joints, visible parts, flange, and the ball that the poses fill.

    q: (N, n) rad or m, poses that the camera is fitted to, and joints without limits; meshes: by the names that the
    robot's description gives them.
    """
    parts = drawn_parts(robot, meshes or {})
    named = list(dict.fromkeys(part.mesh for part in parts if part.mesh is not None))
    model = robot.model
    tip = model.frames[model.getFrameId(flange(robot), pin.FrameType.BODY)]
    return {
        "joints": [
            {
                "name": joint.name,
                "unit": joint.unit,
                "parent": int(model.parents[column + 1]) - 1,  # Pinocchio's joint 0 is the base
                "placement": _column_major(model.jointPlacements[column + 1].homogeneous),
                "axis": np.round(axis, 9).tolist(),
                "lower": float(max(joint.lower, q[:, column].min() - 0.1) if joint.lower < -20 else joint.lower),
                "upper": float(min(joint.upper, q[:, column].max() + 0.1) if joint.upper > 20 else joint.upper),
            }
            for column, (joint, axis) in enumerate(zip(robot.joints, joint_axes(robot), strict=True))
        ],
        "parts": [_part(part, named) for part in parts],
        "meshes": [_mesh((meshes or {})[name], len(named)) for name in named],
        "flange": {"joint": tip.parentJoint - 1, "placement": _column_major(tip.placement.homogeneous)},
        "view": _view(robot, q),
    }


def _view(robot: Robot, q: np.ndarray) -> dict[str, Any]:
    """Return centre (m) and radius of what the run fills, and the height of the floor under it."""
    shown = q[np.unique(np.linspace(0, len(q) - 1, _VIEWED).astype(int))]
    points = np.array([place[:3, 3] for sample in shown for place in link_placements(robot, sample).values()])
    centre = (points.min(axis=0) + points.max(axis=0)) / 2
    return {
        "centre": np.round(centre, 4).tolist(),
        "radius": round(max(0.05, float(np.linalg.norm(points - centre, axis=1).max())), 4),
        "floor": round(float(min(0.0, points[:, 2].min())), 4),
    }


def _part(part: Part, meshes: Sequence[str]) -> dict[str, Any]:
    return {
        "joint": part.joint,
        "kind": part.kind,
        "mesh": None if part.mesh is None else meshes.index(part.mesh),
        "size": [round(length, 5) for length in part.size],
        "placement": _column_major(part.placement),
        "colour": list(part.colour),
    }


def _mesh(mesh: Mesh, count: int) -> dict[str, Any]:
    """Return one of `count` meshes, with few enough triangles for all of them."""
    few = simplified(mesh, min(_MOST_TRIANGLES, max(_FEWEST_TRIANGLES, _ALL_TRIANGLES // count)))
    return {"points": [pack(axis) for axis in few.points.T], "faces": base64_text(few.faces.astype("<u4"))}


def _column_major(placement: np.ndarray) -> list[float]:
    return [float(value) for value in np.round(placement.T.ravel(), 7)]


def asset(name: str) -> Markup:
    """Return a script or style of this room."""
    return Markup(files("irtwin.virtual").joinpath(name).read_text(encoding="utf-8"))


@cache
def viewer_script() -> Markup:
    """Return MeshCat's bundle, which holds three.js."""
    packed = files("irtwin.virtual").joinpath("meshcat.min.js.gz").read_bytes()
    return Markup(gzip.decompress(packed).decode("utf-8"))

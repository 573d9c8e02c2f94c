"""The Denavit-Hartenberg table of a robot that is given otherwise.

A row's frame has its z on a joint's axis and its x on the common normal of that axis and the next. What a table leaves
open is chosen so that the transforms before and after it say as little as possible: the first frame lies at the base
where axis 1 allows, the last at the flange.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import pinocchio as pin

from irtwin.errors import InputError
from irtwin.robot.denavit_hartenberg import CONVENTIONS, ChainTable, Row, row_transform, screw_x, screw_z
from irtwin.robot.description import Robot
from irtwin.robot.kinematics import flange, joint_axes, link_frame, placements, ranges
from irtwin.robot.structure import six_numbers

PARALLEL = 1e-5  # rad: axes nearer to parallel than this are taken as such, because files round their angles
_POSES = 100  # at which a table is held against its robot


@dataclass(frozen=True)
class _Line:
    """A line in the base frame, m: a point on it, and its direction."""

    point: np.ndarray
    direction: np.ndarray


def table_of(robot: Robot, convention: str = "standard", tip: str | None = None) -> ChainTable:
    """Return the table of the chain from the robot's base to the link `tip`, the flange where None.

    It holds for revolute, continuous and prismatic joints with axes however they lie. Rows keep the joints' names and
    limits; links keep mass, centre of mass and inertia, with what is fixed to them. Axes within PARALLEL of parallel
    are taken as parallel; `deviation` says what that costs. Raises InputError on an unknown convention or link.
    """
    if convention not in CONVENTIONS:
        raise InputError(f'there is no Denavit-Hartenberg convention "{convention}"; use {" or ".join(CONVENTIONS)}')
    chain, end = _chain(robot, tip or flange(robot))
    directions, points = joint_axes(robot, np.zeros((1, len(robot.joints))))
    axes = [_Line(points[0, joint - 1], directions[0, joint - 1]) for joint in chain]
    kinds = [robot.joints[joint - 1].kind for joint in chain]
    base = _first_frame(axes[0])
    rows, frame = _rows(axes, kinds, base, end, convention)
    table = ChainTable(tuple(rows), convention, base, np.linalg.inv(frame) @ end)
    return replace(table, base=_tidy(table.base), tool=_tidy(table.tool), rows=tuple(_bodies(robot, chain, table)))


def deviation(robot: Robot, table: ChainTable, tip: str | None = None) -> tuple[float, float]:
    """Return by how much table and robot differ at most over poses drawn within the limits: m, and rad."""
    name = tip or flange(robot)
    chain, _ = _chain(robot, name)
    poses = np.random.default_rng(0).uniform(*ranges(robot), (_POSES, len(robot.joints)))
    by_table = np.array([table.flange(q[[joint - 1 for joint in chain]]) for q in poses])
    off = np.abs(by_table - placements(robot, poses, name)).max(axis=0)
    return float(off[:3, 3].max()), float(off[:3, :3].max())


def _chain(robot: Robot, tip: str) -> tuple[list[int], np.ndarray]:
    """Return Pinocchio's numbers of the joints on the way to a link, and the link's placement at zero."""
    model, data = robot.model, robot.model.createData()
    frame = link_frame(robot, tip)
    pin.framesForwardKinematics(model, data, np.zeros(model.nq))
    chain = list(model.supports[model.frames[frame].parentJoint])[1:]  # but for the base
    if not chain:
        raise InputError(f'{robot.name}: no joint moves the link "{tip}"; name a link further out')
    return chain, np.array(data.oMf[frame].homogeneous)


def _first_frame(axis: _Line) -> np.ndarray:
    """Return the frame on axis 1 that is nearest to the base's: its x as the base's, its origin beside the base's."""
    frame, z = np.eye(4), axis.direction
    x = np.eye(3)[1 if abs(z[0]) > 0.9 else 0]  # the base's y, where axis 1 lies along its x
    x = x - z * float(z @ x)
    frame[:3, 0] = x / np.linalg.norm(x)
    frame[:3, 1] = np.cross(z, frame[:3, 0])
    frame[:3, 2] = z
    frame[:3, 3] = axis.point - z * float(axis.point @ z)
    return frame


def _rows(
    axes: Sequence[_Line], kinds: Sequence[str], base: np.ndarray, end: np.ndarray, convention: str
) -> tuple[list[Row], np.ndarray]:
    """Return the rows (geometry and kinds only), and the last frame as they put it."""
    rows: list[Row] = []
    if convention == "standard":
        at = base
        for number, kind in enumerate(kinds):
            last = number + 1 == len(axes)
            theta, d, a, alpha = _to_end(at, end) if last else _to_next(at, axes[number + 1])
            rows.append(Row(a, alpha, d, theta, kind))
            at = at @ row_transform(rows[-1], convention)
        return rows, at
    at, before = base, (0.0, 0.0)  # the screw about x that leads to the axis
    for number, kind in enumerate(kinds):
        at = at @ screw_x(*before)
        last = number + 1 == len(axes)
        theta, d, a, alpha = _at_end(at, end) if last else _to_next(at, axes[number + 1])
        rows.append(Row(*before, d, theta, kind))
        at, before = at @ screw_z(d, theta), (a, alpha)
    return rows, at


def _to_next(at: np.ndarray, axis: _Line) -> tuple[float, float, float, float]:
    """Return theta, d, a, alpha from a frame on one axis to one whose z is on the next; theta in -pi/2 to pi/2."""
    turn = at[:3, :3].T  # the axis, seen from the frame
    point, direction = turn @ (axis.point - at[:3, 3]), turn @ axis.direction
    theta, sine = 0.0, float(np.hypot(direction[0], direction[1]))
    if sine < PARALLEL:
        distance = float(np.hypot(point[0], point[1]))
        theta = _quarter(np.arctan2(point[1], point[0])) if distance > _negligible(point) else 0.0
        a = point[0] * np.cos(theta) + point[1] * np.sin(theta)
        return theta, 0.0, float(a), 0.0 if direction[2] > 0 else float(np.pi)
    theta = _quarter(np.arctan2(direction[0], -direction[1]))  # x across both axes
    c, s = np.cos(theta), np.sin(theta)
    y = -direction[0] * s + direction[1] * c  # of the next axis, seen from the turned frame; its x is zero
    a = point[0] * c + point[1] * s
    d = point[2] - direction[2] / y * (-point[0] * s + point[1] * c)
    return float(theta), float(d), float(a), float(np.arctan2(-y, direction[2]))


def _to_end(at: np.ndarray, end: np.ndarray) -> tuple[float, float, float, float]:
    """Return a standard table's last row: to a frame on the end's z axis, and to the end itself where it can."""
    axis = _Line(end[:3, 3], end[:3, 2])
    theta, d, a, alpha = _to_next(at, axis)
    local = np.linalg.inv(at) @ end
    if alpha in (0.0, np.pi) and abs(a) <= _negligible(local[:3, 3]):  # one axis: take the end's x
        theta = float(np.arctan2(local[1, 0], local[0, 0]))
        a = 0.0
    if alpha in (0.0, np.pi):
        d = float(local[2, 3])
    return theta, d, a, alpha


def _at_end(at: np.ndarray, end: np.ndarray) -> tuple[float, float, float, float]:
    """Return a modified table's last row: level with the end, and its x turned as the end's where it can."""
    local = np.linalg.inv(at) @ end
    along = float(np.hypot(local[0, 0], local[1, 0]))
    theta = float(np.arctan2(local[1, 0], local[0, 0])) if along > PARALLEL else 0.0
    return theta, float(local[2, 3]), 0.0, 0.0


def _quarter(angle: float) -> float:
    """Return an angle, or its opposite, in -pi/2 to pi/2: the joint's zero stays near the file's."""
    if angle > np.pi / 2 + PARALLEL:
        return float(angle - np.pi)
    if angle <= -np.pi / 2 - PARALLEL:
        return float(angle + np.pi)
    return float(angle)


def _negligible(point: np.ndarray) -> float:
    """Return the distance, m, that rounding leaves of a point."""
    return 1e-14 * (1.0 + float(np.abs(point).max()))


def _tidy(place: np.ndarray) -> np.ndarray:
    """Return a transform with the dust of rounding taken to zero."""
    return np.where(np.abs(place) < 1e-15, 0.0, place)


def _bodies(robot: Robot, chain: Sequence[int], table: ChainTable) -> list[Row]:
    """Return a table's rows with names, limits and bodies of the joints of a chain."""
    model, data = robot.model, robot.model.createData()
    pin.forwardKinematics(model, data, np.zeros(model.nq))
    rows, at = [], table.base
    for joint, row in zip(chain, table.rows, strict=True):
        at = at @ row_transform(row, table.convention)
        described, inertia = robot.joints[joint - 1], model.inertias[joint]
        body = pin.SE3(at).actInv(data.oMi[joint]).act(inertia)
        rows.append(
            replace(
                row,
                lower=described.lower,
                upper=described.upper,
                velocity=described.velocity if np.isfinite(described.velocity) else 0.0,
                effort=described.effort if np.isfinite(described.effort) else 0.0,
                name=described.name,
                mass=float(body.mass),
                com=tuple(body.lever.tolist()),
                inertia=six_numbers(body.inertia),
            )
        )
    return rows

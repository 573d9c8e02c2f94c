"""Where the axes of joints lie: whether a simulator's model has the robot's, and which of its joints do."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from irtwin.robot.description import Robot
from irtwin.robot.kinematics import joint_axes, ranges
from irtwin.simulator.engine import mujoco

_SLIDES, _TURNS = 2, 3  # MuJoCo's kinds of joints of one coordinate
_POSES = 12
_ALIKE = 0.1  # rad, and of the robot's reach: two drawings of one arm differ by less, two arms by more
_PARALLEL = 1e-3  # of the largest singular value of directions: below it all axes of an arm are parallel


@dataclass(frozen=True)
class Axes:
    """Axes of n joints in P poses, in the frame of whoever drew them.

    `direction` (P, n, 3); `point` (P, n, 3) on each, m; `turns` (n,): a sliding joint's axis has no place.
    """

    direction: np.ndarray
    point: np.ndarray
    turns: np.ndarray

    def first_unlike(self, other: Axes) -> int | None:
        """Return the first joint up to which the axes of two lie otherwise, wherever their bases stand; None: none."""
        for count in range(2, len(self.turns) + 1):
            if not self._some(count)._alike(other._some(count)):
                return count - 1
        return None

    def _some(self, count: int) -> Axes:
        return Axes(self.direction[:, :count], self.point[:, :count], self.turns[:count])

    def _alike(self, other: Axes) -> bool:
        turn, shift = other.base_in(self)
        apart = np.linalg.norm(other.direction @ turn.T - self.direction, axis=2)
        gap = self.point - other.point @ turn.T - shift
        off = np.linalg.norm(np.cross(gap, self.direction)[:, self.turns], axis=2)
        reach = np.linalg.norm(self.point - self.point[:, :1], axis=2).max()
        return bool(apart.max() <= _ALIKE and off.max(initial=0.0) <= max(_ALIKE * reach, 1e-6))

    def base_in(self, other: Axes) -> tuple[np.ndarray, np.ndarray]:
        """Return how the base frame lies in that of another's drawing: its axes (3, 3) and its place (3,), m.

        By least squares; where all axes are parallel nothing says how far along them: there it stays.
        """
        turn = self._turn_to(other)
        across = np.eye(3) - other.direction[..., None] * other.direction[..., None, :]
        gap = other.point - self.point @ turn.T
        normal = across[:, other.turns].sum(axis=(0, 1))
        right = np.einsum("pnij,pnj->i", across[:, other.turns], gap[:, other.turns])
        return turn, np.linalg.lstsq(normal, right, rcond=None)[0]

    def _turn_to(self, other: Axes) -> np.ndarray:
        """Return the turn (3, 3) of its vectors to another's, by least squares (Kabsch)."""
        pairs = [(self.direction, other.direction)]
        values = np.linalg.svd(other.direction.reshape(-1, 3), compute_uv=False)
        if values[1] < _PARALLEL * values[0]:  # what turns about them shows by how they move
            pairs.append((self.point - self.point.mean(axis=0), other.point - other.point.mean(axis=0)))
        own, its = (np.concatenate([vectors.reshape(-1, 3) for vectors in some]) for some in zip(*pairs, strict=True))
        left, _, right = np.linalg.svd(own.T @ its)
        return np.asarray((left @ np.diag([1.0, 1.0, np.linalg.det(left @ right)]) @ right).T)


def poses_of(robot: Robot) -> np.ndarray:
    """Return poses (P, n) anywhere in the robot's range."""
    return np.random.default_rng(0).uniform(*ranges(robot), (_POSES, len(robot.joints)))


def robot_axes(robot: Robot, poses: np.ndarray) -> Axes:
    """Return those of the robot's description in poses (P, n)."""
    return Axes(*joint_axes(robot, poses), np.array([joint.unit == "rad" for joint in robot.joints]))


def model_axes(compiled: mujoco.MjModel, joints: Sequence[int], turns: np.ndarray, poses: np.ndarray) -> Axes:
    """Return those of a model's joints, by their places, in poses (P, n); its others stay where they begin."""
    data, at = mujoco.MjData(compiled), list(joints)
    lines = []
    for pose in poses:
        data.qpos[compiled.jnt_qposadr[at]] = pose
        mujoco.mj_kinematics(compiled, data)
        lines.append((data.xaxis[at], data.xanchor[at]))
    directions, points = np.array(lines).swapaxes(0, 1)
    return Axes(directions, points, turns)


def first_unlike(compiled: mujoco.MjModel, joints: Sequence[int], robot: Robot) -> int | None:
    """Return the first of a model's joints, as the robot's by their places, that lies otherwise to those before it."""
    poses = poses_of(robot)
    own = robot_axes(robot, poses)
    return own.first_unlike(model_axes(compiled, joints, own.turns, poses))


def alike(compiled: mujoco.MjModel, robot: Robot) -> list[tuple[str, ...]]:
    """Return the names of a model's joints, one after another on a way from its base, that lie as the robot's do."""
    poses = poses_of(robot)
    own, chains = robot_axes(robot, poses), []
    for last in range(compiled.njnt):
        chain = _chain(compiled, last, len(robot.joints))
        kinds = [_TURNS if turns else _SLIDES for turns in own.turns]
        if compiled.jnt_type[chain].tolist() != kinds:
            continue
        if own.first_unlike(model_axes(compiled, chain, own.turns, poses)) is None:
            chains.append(tuple(compiled.joint(place).name for place in chain))
    return chains


def _chain(compiled: mujoco.MjModel, last: int, count: int) -> list[int]:
    """Return the places of so many joints that move a body one after another, up to the last; fewer at the base."""
    chain, body = [last], int(compiled.jnt_bodyid[last])
    while body and len(chain) < count:
        first = int(compiled.body_jntadr[body])
        own = range(first, first + int(compiled.body_jntnum[body]))
        chain = [place for place in own if place < chain[0]] + chain
        body = int(compiled.body_parentid[body])
    return chain[-count:]

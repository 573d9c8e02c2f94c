"""Which pairs of links need no check for collision, and why: what an SRDF lists."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import combinations

import numpy as np
import pinocchio as pin

from irtwin.robot.collision import CollisionModel, joined
from irtwin.robot.description import Robot
from irtwin.robot.structure import Solid

_POSES = 10_000  # drawn at random, as many as MoveIt's setup takes


def free_pairs(robot: Robot, model: CollisionModel, solids: Sequence[Solid]) -> Iterator[tuple[str, str, str]]:
    """Yield the pairs of links with collision shapes that need no check, base to flange, each with the reason.

    In MoveIt's words that is "Adjacent", "Always" or "Never" (in contact). Never in contact are those that met at none
    of 10,000 random poses within the limits. Of links with a mesh, which is not opened, only adjacent ones are known to
    need none.
    """
    shaped = dict.fromkeys(solid.link for solid in solids if solid.purpose == "collision")
    unknown = {solid.link for solid in solids if solid.purpose == "collision" and solid.kind == "mesh"}
    carried = {name: _joint(robot, name) for name in shaped}
    checked, met = model.own_pairs, model.ever_meeting(_drawn(robot))
    for first, second in combinations(shaped, 2):
        pair = frozenset((first, second))
        if joined(robot.model.parents, carried[first], carried[second]):
            yield first, second, "Adjacent"
        elif not pair & unknown and pair not in met:
            yield first, second, "Never" if pair in checked else "Always"


def home(robot: Robot, model: CollisionModel) -> np.ndarray:
    """Return the joint positions nearest to zero, (n,) rad or m, that are within the limits and clear of contact.

    Random ones are tried where zero, put within the limits, is not clear; where none is, zero is returned.
    """
    lower, upper = _limits(robot)
    zero = np.clip(0.0, lower, upper)
    drawn = _drawn(robot)
    nearest = drawn[np.argsort(np.linalg.norm(drawn - zero, axis=1))]
    return next((q for q in (zero, *nearest) if not model.touches(q)), zero)


def _limits(robot: Robot) -> tuple[np.ndarray, np.ndarray]:
    """Return the joints' limits, (n,) rad or m; a half turn, or half a metre, either way where there are none."""
    lower, upper = robot.limits
    free = np.array([0.5 if joint.kind == "prismatic" else np.pi for joint in robot.joints])
    return np.where(np.isfinite(lower), lower, -free), np.where(np.isfinite(upper), upper, free)


def _drawn(robot: Robot) -> np.ndarray:
    lower, upper = _limits(robot)
    return np.asarray(np.random.default_rng(0).uniform(lower, upper, (_POSES, len(lower))))


def _joint(robot: Robot, link: str) -> int:
    return int(robot.model.frames[robot.model.getFrameId(link, pin.FrameType.BODY)].parentJoint)

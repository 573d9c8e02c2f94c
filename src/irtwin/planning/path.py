"""Paths of a robot from pose to pose, clear of itself and of obstacles: by OMPL in joint space, or along a line."""

from __future__ import annotations

from time import monotonic
from typing import Any

import numpy as np
import pinocchio as pin

from irtwin.errors import InputError
from irtwin.identification.motion_limits import JointLimits
from irtwin.planning.poses import follow
from irtwin.robot.collision import STEP, CollisionModel
from irtwin.robot.description import Robot
from irtwin.robot.kinematics import placements

LONGEST_SEARCH = 10.0  # s
_ROPE = 0.75  # rad (m) between points of a path at which a rope along it is held
_LINE = 5e-3  # m between poses of a straight line
_TURN = 0.02  # rad, likewise
_JUMP = 0.3  # rad: a joint that must move farther from one pose of a line to the next has changed its branch
_SEED = 1


def joint_path(
    robot: Robot, collisions: CollisionModel, start: np.ndarray, goal: np.ndarray, seconds: float = LONGEST_SEARCH
) -> np.ndarray:
    """Return corners (k, n) of a path that is straight in joint space in between and touches nothing.

    Straight to the goal where that is clear; else RRT-Connect (Kuffner and LaValle, 2000), shortened as a rope that is
    pulled. Raises InputError where none is found in `seconds`.
    """
    straight = np.array([start, goal])
    return straight if collisions.is_clear(straight) else _search(robot, collisions, start, goal, seconds)


def line_path(robot: Robot, collisions: CollisionModel, start: np.ndarray, goal: np.ndarray) -> np.ndarray:
    """Return poses (k, n), near one another, that lead the flange along a straight line, turning evenly.

    It goes to where the flange is at `goal`. Raises InputError where the line is out of reach, passes a singular pose
    or leads into a collision, and says where.
    """
    limits = JointLimits.of(robot)
    first, last = (pin.SE3(pose) for pose in placements(robot, np.array([start, goal])))
    length = float(np.linalg.norm(last.translation - first.translation))
    turn = pin.log3(first.rotation.T @ last.rotation)
    count = max(10, int(np.ceil(length / _LINE)), int(np.ceil(np.linalg.norm(turn) / _TURN)))
    poses = [start]
    for share in np.linspace(0, 1, count + 1)[1:]:
        place = first.translation + share * (last.translation - first.translation)
        q, away, turned = follow(robot, pin.SE3(first.rotation @ pin.exp3(share * turn), place), poses[-1], limits)
        where = f"{1000 * share * length:.0f} mm along the line of {1000 * length:.0f} mm"
        if away > 1e-5 or turned > 1e-5:
            raise InputError(f"the straight line leaves what the robot reaches {where}; plan without --line")
        if np.abs(q - poses[-1]).max() > _JUMP:
            raise InputError(f"the straight line passes a singular pose {where}; plan without --line")
        if (pair := collisions.meeting(q)) is not None:
            raise InputError(f"the straight line is blocked: {pair[0]} touches {pair[1]} {where}")
        poses.append(q)
    return np.array(poses)


def way_along(corners: np.ndarray) -> np.ndarray:
    """Return how far each corner (k, n) lies along the straight lines between them, (k,)."""
    return np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(corners, axis=0), axis=1))])


def _search(
    robot: Robot, collisions: CollisionModel, start: np.ndarray, goal: np.ndarray, seconds: float
) -> np.ndarray:
    base, geometric, util = _ompl()
    util.setLogLevel(util.LOG_NONE)
    util.RNG.setSeed(_SEED)
    limits = JointLimits.of(robot)
    n = len(start)
    space = base.RealVectorStateSpace(n)
    bounds = base.RealVectorBounds(n)
    for joint in range(n):
        bounds.setLow(joint, float(limits.lower[joint]))
        bounds.setHigh(joint, float(limits.upper[joint]))
    space.setBounds(bounds)
    setup = geometric.SimpleSetup(space)

    def is_clear(state: Any) -> bool:
        return not collisions.touches(np.array([state[joint] for joint in range(n)]))

    information = setup.getSpaceInformation()
    setup.setStateValidityChecker(is_clear)
    # between two checks no point moves farther than 10 mm; the whole path is checked again below
    farthest = float(collisions.travel((limits.upper - limits.lower)[None])[0])
    information.setStateValidityCheckingResolution(min(0.01, 10 * STEP / max(farthest, STEP)))
    first, last = space.allocState(), space.allocState()
    for joint in range(n):
        first[joint], last[joint] = float(start[joint]), float(goal[joint])
    setup.setStartAndGoalStates(first, last)
    setup.setPlanner(geometric.RRTConnect(information))
    until = monotonic() + seconds
    while monotonic() < until:
        setup.solve(max(0.01, until - monotonic()))
        if not setup.haveExactSolutionPath():
            break
        solution = setup.getSolutionPath()
        setup.getPathSimplifier().ropeShortcutPath(solution, _ROPE)
        corners = np.array([[state[joint] for joint in range(n)] for state in solution.getStates()])
        if collisions.is_clear(corners):
            return corners
        setup.clear()  # something thin was missed
    raise InputError(
        f"found no path in {seconds:g} s that touches nothing; move the boxes, give another goal, or search longer "
        "with --search"
    )


def _ompl() -> tuple[Any, Any, Any]:
    try:
        from ompl import base, geometric, util
    except ImportError as error:
        raise InputError('planning needs OMPL and TOPP-RA; install them with pip install "irtwin[plan]"') from error
    return base, geometric, util

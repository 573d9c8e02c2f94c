"""Where the shapes of a robot meet one another, or an obstacle: by Pinocchio and coal."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import coal
import numpy as np
import pinocchio as pin

from irtwin.errors import InputError
from irtwin.robot.description import Robot
from irtwin.robot.kinematics import levers
from irtwin.robot.structure import PRIMITIVES, Solid, structure_of

STEP = 1e-3  # m: how far the fastest point moves between two checks, at most
_PROBES = 300  # random poses at which pairs that always touch are found
_DIFFERENCE = 1e-4  # rad or m: for slopes
_MOST_SHAPES = 500  # every two of them are a pair
_SMALLEST, _LARGEST = 1e-6, 1e3  # m: of a shape or an obstacle


@dataclass(frozen=True)
class Obstacle:
    """A box that stands still, its sides along the axes of the base frame: centre and side lengths, (3,) m each."""

    centre: tuple[float, float, float]
    size: tuple[float, float, float]

    def __post_init__(self) -> None:
        if not all(_SMALLEST <= side <= _LARGEST for side in self.size):
            shown = " ".join(f"{side:g}" for side in self.size)
            raise InputError(f"a box of {shown} m is no obstacle; give three side lengths above zero, in metres")


@dataclass(frozen=True)
class Meeting:
    """Two bodies that touch, by name, and when: s since the motion's start."""

    time: float
    first: str
    second: str

    def __str__(self) -> str:
        return f"{self.first} meets {self.second}"


class CollisionModel:
    """The collision shapes of a robot of n joints, and boxes about it.

    Pairs of links that are fixed to one another or joined by one joint are left out, as are those that touch at each
    of many random poses: their shapes overlap by design. A robot without collision shapes has no pairs to check.
    """

    def __init__(self, robot: Robot, obstacles: Sequence[Obstacle] = ()) -> None:
        """Raise InputError on a shape of no size, on too many, or where obstacles have no shape to keep off them."""
        self._robot = robot
        self._model = robot.model
        self._data = robot.model.createData()
        self._geometry = pin.GeometryModel()
        self._names: list[str] = []
        self._margin = 0.0
        self._nearest = 0  # pair
        solids = [
            solid for solid in structure_of(robot).solids if solid.purpose == "collision" and solid.kind in PRIMITIVES
        ]
        shapes = len(solids) + len(obstacles)
        if shapes > _MOST_SHAPES:
            raise InputError(
                f"{robot.name}: {shapes} collision shapes and boxes cannot be checked; give at most "
                f"{_MOST_SHAPES}, coarser ones"
            )
        self._add_links(solids)
        if obstacles and not self._names:
            raise InputError(
                f"{robot.name}: its URDF has no collision shapes, so nothing can be kept off a box; "
                "give its links <collision> elements of boxes, cylinders or spheres"
            )
        self._pair_links()
        self._add_obstacles(obstacles)
        self._results = pin.GeometryData(self._geometry)
        names = [str(shape.name) for shape in self._geometry.geometryObjects]
        names[: len(self._names)] = self._names
        self._pairs = [(names[pair.first], names[pair.second]) for pair in self._geometry.collisionPairs]

    @property
    def checks_itself(self) -> bool:
        """Whether there are pairs of the robot's own links to check."""
        return self._own > 0

    @property
    def shaped(self) -> tuple[str, ...]:
        """The links with collision shapes."""
        return tuple(dict.fromkeys(self._names))

    @property
    def unchecked(self) -> tuple[str, ...]:
        """The links with mass but without collision shapes, which nothing is kept off."""
        return tuple(link.name for link in self._robot.links if link.mass > 0 and link.name not in self._names)

    @property
    def own_pairs(self) -> frozenset[frozenset[str]]:
        """The pairs of the robot's own links that are checked, by name."""
        return frozenset(map(frozenset, self._pairs[: self._own]))

    def ever_meeting(self, poses: np.ndarray) -> set[frozenset[str]]:
        """Return the pairs that touch at any of the joint positions, (N, n), by name."""
        results = pin.GeometryData(self._geometry)
        left: dict[frozenset[str], list[int]] = {}
        for pair, names in enumerate(self._pairs):
            left.setdefault(frozenset(names), []).append(pair)
        met: set[frozenset[str]] = set()
        for q in poses:
            if not pin.computeCollisions(self._model, self._data, self._geometry, results, q, False):
                continue
            touching = {
                name for name, own in left.items() if any(results.collisionResults[k].isCollision() for k in own)
            }
            for pair in (pair for name in touching for pair in left.pop(name)):
                results.deactivateCollisionPair(pair)  # known: the next poses are searched for the others
            met |= touching
        return met

    def meeting(self, q: np.ndarray) -> tuple[str, str] | None:
        """Return the first pair that touches at the joint positions `q`: (n,); None where none does."""
        if not self.touches(q):
            return None
        return next(
            self._pairs[pair] for pair, result in enumerate(self._results.collisionResults) if result.isCollision()
        )

    def keep_off(self, margin: float) -> None:
        """Count what is nearer than `margin`, m, as touching from now on."""
        self._margin = margin
        for request in self._results.collisionRequests:
            request.security_margin = margin

    def touches(self, q: np.ndarray) -> bool:
        """Return whether any pair touches at the joint positions `q`: (n,)."""
        return bool(pin.computeCollisions(self._model, self._data, self._geometry, self._results, q, True))

    def clearance(self, q: np.ndarray) -> float:
        """Return the least distance of any pair at the joint positions `q`, m; negative inside; inf without pairs."""
        if not self._geometry.collisionPairs:
            return float(np.inf)
        self._nearest = pin.computeDistances(self._model, self._data, self._geometry, self._results, q)
        return float(self._results.distanceResults[self._nearest].min_distance)

    def clearance_slope(self, q: np.ndarray) -> tuple[float, np.ndarray]:
        """Return the least distance of any pair at the joint positions `q`: (n,), m, and that pair's slope, (n,)."""
        value, slope = self.clearance(q), np.zeros(len(q))
        if not self._pairs:
            return value, slope
        for joint in range(len(q)):
            moved = q.copy()
            moved[joint] += _DIFFERENCE
            pin.updateGeometryPlacements(self._model, self._data, self._geometry, self._results, moved)
            away = pin.computeDistance(self._geometry, self._results, self._nearest).min_distance
            slope[joint] = (away - value) / _DIFFERENCE
        return value, slope

    def first_meeting(self, time: np.ndarray, q: np.ndarray) -> tuple[Meeting | None, float]:
        """Return the first meeting along a motion, and the least distance of any pair until then, m.

        time: (N,) s; q: (N, n), straight in between. No point of the robot moves farther than STEP between two
        checks, but over what the distance to everything proves to be free.
        """
        if not self._geometry.collisionPairs:
            return None, float(np.inf)
        way = np.concatenate([[0.0], np.cumsum(self.travel(np.diff(q, axis=0)))])
        least, at = np.inf, 0.0
        while True:
            moment = float(np.interp(at, way, time))
            pose = np.array([np.interp(moment, time, joint) for joint in q.T])
            clearance = self.clearance(pose)
            least = min(least, clearance)
            if clearance <= self._margin and (pair := self.meeting(pose)) is not None:
                return Meeting(moment, *pair), clearance
            if at >= way[-1]:
                return None, least
            at = min(at + max(STEP, (clearance - self._margin) / 2), way[-1])  # both of a pair may move

    def is_clear(self, q: np.ndarray) -> bool:
        """Return whether nothing touches along joint positions, (N, n), and straight in between; as `first_meeting`."""
        return self.first_meeting(np.arange(float(len(q))), q)[0] is None

    def travel(self, steps: np.ndarray) -> np.ndarray:
        """Return how far any point of the robot moves at most in steps of the joints, (N, n): (N,) m."""
        if not len(self._levers):
            return np.zeros(len(steps))
        return np.asarray((np.abs(steps) @ self._levers.T).max(axis=1))

    @cached_property
    def _levers(self) -> np.ndarray:
        """How far, (shapes, n) m, any point of a shape can be from each joint; 1 for joints that slide."""
        every = []
        for shape in list(self._geometry.geometryObjects)[: len(self._names)]:
            distance = float(np.linalg.norm(shape.placement.translation)) + _radius(shape.geometry)
            every.append(levers(self._robot, shape.parentJoint, distance, *self._robot.limits))
        return np.array(every)

    def _add_links(self, solids: Sequence[Solid]) -> None:
        for number, solid in enumerate(solids):
            frame = self._model.frames[self._model.getFrameId(solid.link, pin.FrameType.BODY)]
            place = frame.placement * pin.SE3(solid.origin.transform)
            shape = _shape(solid, f'{self._robot.name}: collision shape of link "{solid.link}"')
            self._names.append(solid.link)
            self._geometry.addGeometryObject(
                pin.GeometryObject(f"{solid.link} {number}", frame.parentJoint, place, shape)
            )

    def _pair_links(self) -> None:
        parents, objects = self._model.parents, list(self._geometry.geometryObjects)
        joints = [shape.parentJoint for shape in objects]
        for second in range(len(objects)):
            for first in range(second):
                if joined(parents, joints[second], joints[first]):
                    continue
                self._geometry.addCollisionPair(pin.CollisionPair(first, second))
        self._leave_out_those_that_always_touch()
        self._own = len(self._geometry.collisionPairs)

    def _leave_out_those_that_always_touch(self) -> None:
        pairs = list(self._geometry.collisionPairs)
        always = set(range(len(pairs)))
        results = pin.GeometryData(self._geometry)
        lower, upper = self._robot.limits
        lower, upper = np.where(np.isfinite(lower), lower, -np.pi), np.where(np.isfinite(upper), upper, np.pi)
        for q in np.random.default_rng(0).uniform(lower, upper, (_PROBES, len(lower))):
            if not always:
                return
            pin.updateGeometryPlacements(self._model, self._data, self._geometry, results, q)
            always = {pair for pair in always if pin.computeCollision(self._geometry, results, pair)}
        for pair in always:
            self._geometry.removeCollisionPair(pairs[pair])

    def _add_obstacles(self, obstacles: Sequence[Obstacle]) -> None:
        """Pair each obstacle with what moves; the base may stand on it."""
        moving = [place for place in range(len(self._names)) if self._geometry.geometryObjects[place].parentJoint > 0]
        for number, obstacle in enumerate(obstacles, 1):
            place = pin.SE3(np.eye(3), np.array(obstacle.centre, dtype=float))
            name = f"box {number}" if len(obstacles) > 1 else "the box"
            index = self._geometry.addGeometryObject(pin.GeometryObject(name, 0, place, coal.Box(*obstacle.size)))
            for shape in moving:
                self._geometry.addCollisionPair(pin.CollisionPair(shape, index))


def joined(parents: Sequence[int], first: int, second: int) -> bool:
    """Whether bodies that two joints carry, 0 the base, are one, or have one joint between them.

    parents: of each joint, by number, as in Pinocchio's model.
    """
    return first == second or parents[first] == second or parents[second] == first


def _shape(solid: Solid, where: str) -> coal.ShapeBase:
    if not all(_SMALLEST <= length <= _LARGEST for length in solid.size):
        raise InputError(f"{where}: a {solid.kind} of {' '.join(f'{length:g}' for length in solid.size)} m has no size")
    if solid.kind == "box":
        return coal.Box(*solid.size)
    return coal.Cylinder(*solid.size) if solid.kind == "cylinder" else coal.Sphere(*solid.size)


def _radius(solid: coal.ShapeBase) -> float:
    """Return the distance of the solid's farthest point from its centre, m."""
    if isinstance(solid, coal.Box):
        return float(np.linalg.norm(solid.halfSide))
    return float(np.hypot(solid.radius, solid.halfLength)) if isinstance(solid, coal.Cylinder) else float(solid.radius)

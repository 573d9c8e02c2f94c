"""The KUKA KR6 R700 that ships: its frames, and shapes by which it can be kept from hitting itself."""

from __future__ import annotations

import coal
import numpy as np
import pinocchio as pin
import pytest

from irtwin import resources
from irtwin.robot.kinematics import flange, placements
from irtwin.robot.urdf import read_urdf

FILE = resources.folder("ontology") / "robots" / "kuka_kr6_r700.urdf"
ROBOT = read_urdf(FILE)
HOME = [0.0, -np.pi / 2, np.pi / 2, 0.0, 0.0, 0.0]
PROTRUDES = 0.003  # m: the locating pin in the flange


@pytest.fixture(scope="module")
def shapes() -> pin.GeometryModel:
    """The collision shapes, with a pair for each two that are on links that are no neighbours: those always touch."""
    geometry = pin.buildGeomFromUrdf(ROBOT.model, str(FILE), pin.GeometryType.COLLISION)
    for one, first in enumerate(geometry.geometryObjects):
        for other, second in enumerate(geometry.geometryObjects[:one]):
            if abs(first.parentJoint - second.parentJoint) > 1:
                geometry.addCollisionPair(pin.CollisionPair(other, one))
    return geometry


def hits(geometry: pin.GeometryModel, q: list[float] | np.ndarray) -> bool:
    return bool(
        pin.computeCollisions(ROBOT.model, ROBOT.model.createData(), geometry, geometry.createData(), np.array(q), True)
    )


def test_frames_are_those_of_the_makers_driver():
    assert flange(ROBOT) == "flange"
    q = np.array([[0.3, -1.0, 1.2, 0.4, 0.5, -0.6]])
    at = {name: placements(ROBOT, q, name)[0] for name in ("base_link", "base", "link_6", "flange", "tool0")}
    assert np.array_equal(at["base"], at["base_link"])
    assert np.array_equal(at["flange"], at["link_6"])
    assert at["tool0"][:3, 3] == pytest.approx(at["flange"][:3, 3], abs=1e-15)
    assert at["tool0"][:3, 2] == pytest.approx(at["flange"][:3, 0], abs=1e-12)  # z where the flange has x
    assert at["tool0"][:3, 1] == pytest.approx(at["flange"][:3, 1], abs=1e-12)


def test_every_link_has_shapes_that_hold_its_visible_ones():
    visible = pin.buildGeomFromUrdf(ROBOT.model, str(FILE), pin.GeometryType.VISUAL)
    hulls = pin.buildGeomFromUrdf(ROBOT.model, str(FILE), pin.GeometryType.COLLISION)
    assert {each.parentJoint for each in hulls.geometryObjects} == set(range(7))
    assert len(hulls.geometryObjects) < len(visible.geometryObjects) / 1.5
    for each in visible.geometryObjects:
        own = [hull for hull in hulls.geometryObjects if hull.parentJoint == each.parentJoint]
        for point in surface(each.geometry):
            assert min(outside(hull, each.placement.act(point)) for hull in own) < PROTRUDES, each.name


def surface(shape: coal.ShapeBase) -> list[np.ndarray]:
    if isinstance(shape, coal.Sphere):
        return [shape.radius * axis for axis in (*np.eye(3), *-np.eye(3))]
    grid = np.linspace(-1.0, 1.0, 5)
    if isinstance(shape, coal.Box):
        cube = [np.array([x, y, z]) for x in grid for y in grid for z in grid]
        return [point * shape.halfSide for point in cube if np.abs(point).max() == 1.0]
    turns = np.linspace(0.0, 2 * np.pi, 16)
    rim = [(shape.radius * np.cos(turn), shape.radius * np.sin(turn)) for turn in turns]
    return [np.array([x, y, z * shape.halfLength]) for x, y in rim for z in grid]


def outside(hull: pin.GeometryObject, point: np.ndarray) -> float:
    """How far a point of the link's frame is out of a shape, m."""
    x, y, z = hull.placement.actInv(point)
    shape = hull.geometry
    if isinstance(shape, coal.Box):
        return float(np.linalg.norm(np.maximum(np.abs([x, y, z]) - shape.halfSide, 0.0)))
    return float(np.hypot(max(np.hypot(x, y) - shape.radius, 0.0), max(abs(z) - shape.halfLength, 0.0)))


@pytest.mark.parametrize(
    ("q", "hit"),
    [
        (np.zeros(6), False),
        (HOME, False),
        (np.radians([0, -90, 156, 0, 0, 0]), False),
        ([2.0, -1.2, 1.8, 1.0, 1.0, 3.0], False),
        ([0, -1.57, 2.2, 0, 0.9, 0], False),
        (np.radians([0, 20, 120, 0, 0, 0]), True),  # the hand in the base
        (np.radians([0, 43, 145, 113, 100, 0]), True),  # the elbow low, the hand in the shoulder
    ],
)
def test_poses_of_work_are_free_and_those_in_which_it_hits_itself_are_not(shapes, q, hit):
    assert hits(shapes, q) == hit


def test_few_of_all_poses_hit(shapes):
    draws = np.random.default_rng(0).uniform(ROBOT.model.lowerPositionLimit, ROBOT.model.upperPositionLimit, (500, 6))
    assert 0.02 < np.mean([hits(shapes, q) for q in draws]) < 0.15

"""Links and joints, as SDF and USD tell them, made into a model of MuJoCo."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
import scipy

from irtwin.robot.structure import six_numbers
from irtwin.simulator.engine import mujoco

WORLD = "world"
_SERVO = " by its servo"
_MOST = 500  # links, base to flange: MuJoCo goes down the tree by recursion


@dataclass(frozen=True)
class ModelLink:
    """A body: kg, its centre (3,), m, and the inertia (3, 3) about that, kg m^2, in its own axes.

    `place` (4, 4): where it is in the world, if no joint moves it. `frames`: points (3,) of it that have a name.
    """

    name: str
    place: np.ndarray
    mass: float = 0.0
    centre: np.ndarray = field(default_factory=lambda: np.zeros(3))
    inertia: np.ndarray = field(default_factory=lambda: np.zeros((3, 3)))
    frames: Mapping[str, np.ndarray] = field(default_factory=dict)


@dataclass(frozen=True)
class ModelJoint:
    """A joint: "revolute", "prismatic" or "fixed"; rad, N m and the like, or m and N.

    `origin` (4, 4): the child in its parent, the joint at zero; `anchor` and `axis` (3,) in the child. `numbers`: those
    of a joint that MJCF calls so. `effort`: the most that drives it. `servo`: its gains; None where it has none.
    """

    name: str
    kind: str
    parent: str
    child: str
    origin: np.ndarray
    anchor: np.ndarray
    axis: np.ndarray
    limits: tuple[float, float] = (-np.inf, np.inf)
    effort: float = np.inf
    numbers: Mapping[str, float] = field(default_factory=dict)
    servo: tuple[float, float] | None = None


def assembled(links: Iterable[ModelLink], connections: Sequence[ModelJoint], gravity: np.ndarray) -> mujoco.MjSpec:
    """Return the specification of links; those that no joint connects to another stand fixed in the world.

    gravity: (3,) m/s^2. Raises ValueError, saying why, where joints make no tree, or a number is not finite.
    """
    spec = mujoco.MjSpec()
    spec.compiler.degree = False
    spec.option.gravity = gravity
    above: dict[str, ModelJoint] = {}
    for joint in connections:
        own = (*joint.numbers.values(), *(joint.servo or ()))
        _check_finite(f'joint "{joint.name}"', joint.origin, joint.anchor, joint.axis, *own)
        if joint.child in above:
            raise ValueError(
                f'link "{joint.child}" is the child of two joints, {above[joint.child].name} and {joint.name}'
            )
        above[joint.child] = joint
    below: dict[str, list[ModelLink]] = {}
    for link in links:
        _check_finite(f'link "{link.name}"', link.place, link.mass, link.centre, link.inertia)
        below.setdefault(above[link.name].parent if link.name in above else WORLD, []).append(link)
    todo = [(WORLD, spec.worldbody, 0)]
    while todo:
        parent, body, depth = todo.pop()
        for link in below.pop(parent, ()):
            todo.append((link.name, _body(body, link, above.get(link.name)), depth + 1))
        if depth > _MOST:
            raise ValueError(f"a chain of more than {_MOST} links cannot be modelled")
    if below:
        raise ValueError(f'the joints about link "{next(iter(below.values()))[0].name}" form a loop, or lead nowhere')
    for joint in connections:
        if joint.servo is not None:
            add_servo(spec, joint.name, joint.servo)
    return spec


def _check_finite(owner: str, *values: np.ndarray | float) -> None:
    if not all(np.isfinite(value).all() for value in values):
        raise ValueError(f"{owner} has a number that is not finite")


def _body(parent: mujoco.MjsBody, link: ModelLink, joint: ModelJoint | None) -> mujoco.MjsBody:
    place = link.place if joint is None else joint.origin
    turn = scipy.spatial.transform.Rotation.from_matrix(place[:3, :3])
    body = parent.add_body(name=link.name, pos=place[:3, 3], quat=turn.as_quat(scalar_first=True))
    if link.mass:
        body.mass, body.ipos, body.explicitinertial = link.mass, link.centre, True
        body.fullinertia = six_numbers(link.inertia)
    for name, at in link.frames.items():
        body.add_site(name=name, pos=at)
    if joint is not None and joint.kind != "fixed":
        _joint(body, joint)
    return body


def _joint(body: mujoco.MjsBody, connection: ModelJoint) -> None:
    kind = mujoco.mjtJoint.mjJNT_SLIDE if connection.kind == "prismatic" else mujoco.mjtJoint.mjJNT_HINGE
    joint = body.add_joint(name=connection.name, type=kind, pos=connection.anchor, axis=connection.axis)
    if np.isfinite(connection.limits).all():
        joint.limited, joint.range = True, connection.limits
    if np.isfinite(connection.effort):
        joint.actfrclimited, joint.actfrcrange = True, (-connection.effort, connection.effort)
    joint.armature = connection.numbers.get("armature", 0.0)
    joint.frictionloss = connection.numbers.get("frictionloss", 0.0)
    joint.damping[0] = connection.numbers.get("damping", 0.0)
    joint.stiffness[0] = connection.numbers.get("stiffness", 0.0)
    joint.springref = connection.numbers.get("springref", 0.0)


def add_servo(spec: mujoco.MjSpec, joint: str, gains: tuple[float, float]) -> bool:
    """Give a joint a position servo in place of its motors; return whether it has none of its own."""
    own, drives = spec.joint(joint), [actuator for actuator in spec.actuators if actuator.target == joint]
    if own is None or any(drive.biastype == mujoco.mjtBias.mjBIAS_AFFINE for drive in drives):
        return False
    for drive in drives:
        spec.delete(drive)
    servo = spec.add_actuator(name=f"{joint}{_SERVO}", target=joint, trntype=mujoco.mjtTrn.mjTRN_JOINT)
    servo.gaintype, servo.biastype = mujoco.mjtGain.mjGAIN_FIXED, mujoco.mjtBias.mjBIAS_AFFINE
    servo.gainprm[0], servo.biasprm[:3] = gains[0], (0.0, -gains[0], -gains[1])
    servo.forcelimited, servo.forcerange = own.actfrclimited, own.actfrcrange
    own.actfrclimited = mujoco.mjtLimited.mjLIMITED_FALSE  # the servo has it now
    return True

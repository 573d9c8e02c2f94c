"""A twin as descriptions of robots have it: bodies and numbers of joints; and what a format has no place for."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pinocchio as pin

from irtwin.effects.catalogue import catalogue
from irtwin.effects.effect import Effect
from irtwin.errors import InputError
from irtwin.robot.description import Robot
from irtwin.robot.mjcf_text import mjcf_text
from irtwin.robot.pseudo_inertia import consistent
from irtwin.robot.sdf_text import sdf_text
from irtwin.robot.structure import Structure, structure_of
from irtwin.robot.urdf import parse_urdf
from irtwin.robot.urdf_text import with_numbers
from irtwin.robot.usd_text import usd_text
from irtwin.twin.twin import Twin

_URDF = {"damping": "damping", "frictionloss": "friction"}  # what MJCF's numbers are called
_MJCF = {name: name for name in (*_URDF, "armature")}
NUMBERS = {"urdf": _URDF, "mjcf": _MJCF, "sdf": _URDF, "usd": _URDF | {"armature": "armature"}}
_SAME = 1e-12  # of a body's numbers


def text_of(twin: Twin, form: str) -> str:
    """Return the twin's robot in a format of NUMBERS. Raises InputError as `described` does."""
    robot = described(twin, twin.robot)
    if form in ("mjcf", "usd"):
        armature = {joint: numbers.get("armature", 0.0) for joint, numbers in _numbers(twin).items()}
        return mjcf_text(robot, armature) if form == "mjcf" else usd_text(robot, armature)
    return sdf_text(robot) if form == "sdf" else robot.urdf


def places(twin: Twin, form: str) -> tuple[tuple[str, str | None], ...]:
    """Return the twin's effects by id, each with what holds it in a format; None: nothing does."""
    return tuple((effect, _place(catalogue()[effect], form)) for effect in twin.effect_ids)


def described(twin: Twin, robot: Robot) -> Robot:
    """Return a robot of the twin's links and joints whose URDF has the twin's bodies, damping and dry friction.

    All else of the URDF stays as it is, and so does what the twin does not know or says alike. Raises InputError where
    a body of the twin is not physically consistent: readers refuse it.
    """
    dynamics = {
        joint: {_URDF[name]: value for name, value in numbers.items() if name in _URDF}
        for joint, numbers in _numbers(twin).items()
    }
    structure = structure_of(robot)
    stand = {
        connection.name: {"damping": connection.damping, "friction": connection.friction}
        for connection in structure.connections
    }
    changed = {joint: numbers for joint, numbers in dynamics.items() if stand[joint] != stand[joint] | numbers}
    text = with_numbers(robot.urdf, _bodies(twin, robot, structure), changed)
    return replace(robot, urdf=text, links=parse_urdf(text).links)


def _place(effect: Effect, form: str) -> str | None:
    if effect.bodies:
        return "inertia"
    held = [NUMBERS[form].get(name) for name in effect.in_mjcf.values()]
    return held[0] if held else None


def _numbers(twin: Twin) -> dict[str, dict[str, float]]:
    """Return what MJCF calls a joint's numbers, by joint."""
    standing = {effect.id: effect.in_mjcf for effect in twin.standing}
    numbers: dict[str, dict[str, float]] = {}
    for parameter in twin.parameters:
        name = standing.get(parameter.effect, {}).get(parameter.name)
        if name is not None and parameter.joint is not None:
            numbers.setdefault(parameter.joint, {})[name] = parameter.value
    return numbers


def _bodies(twin: Twin, robot: Robot, structure: Structure) -> dict[str, pin.Inertia]:
    """Return the bodies of links that are not those of the robot's URDF, each in its link's frame.

    A body stands at the link that its joint moves, less what is fixed to that; all where the rest is not consistent.
    """
    bodies: dict[str, pin.Inertia] = {}
    ids = {effect.id for effect in twin.standing if effect.bodies}
    own = [parameter.value for parameter in twin.parameters if parameter.effect in ids]
    moved = {connection.name: connection.child for connection in structure.connections}
    for joint, values in zip(robot.joint_names, np.reshape(own, (-1, 10)), strict=False):
        index = robot.model.getJointId(joint)
        before = robot.model.inertias[index].toDynamicParameters()
        if np.allclose(values, before, rtol=0.0, atol=_SAME * np.abs(before).max()):
            continue
        if not consistent(values[None])[0]:
            raise InputError(
                f"{robot.name}: the body that {joint} moves is not physically consistent; identify the twin again"
            )
        fixed = _fixed(robot, structure, index, moved[joint])
        rest = values - sum((body.toDynamicParameters() for body in fixed.values()), np.zeros(10))
        if not consistent(rest[None])[0]:
            rest = values
            bodies |= dict.fromkeys(fixed, pin.Inertia.Zero())
        bodies[moved[joint]] = pin.Inertia.FromDynamicParameters(rest)
    return bodies


def _fixed(robot: Robot, structure: Structure, joint: int, moved: str) -> dict[str, pin.Inertia]:
    """Return the bodies of links that are fixed to the one that a joint moves, in that one's frame."""
    inertias = {}
    for link in structure.bodies:
        frame = robot.model.frames[robot.model.getFrameId(link.name, pin.FrameType.BODY)]
        if frame.parentJoint == joint and link.name != moved and link.mass:
            inertias[link.name] = frame.placement.act(link.spatial)
    return inertias

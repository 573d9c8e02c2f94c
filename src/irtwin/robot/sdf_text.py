"""SDF text of a robot: what Gazebo and Drake need to move it."""

from __future__ import annotations

from xml.etree.ElementTree import Element, SubElement, indent, tostring

import numpy as np
import pinocchio as pin

from irtwin.robot.description import Joint, Robot
from irtwin.robot.structure import MOMENTS, Connection, Origin, Solid, six_numbers, structure_of
from irtwin.robot.xml_elements import words


def sdf_text(robot: Robot) -> str:
    """Return a robot as SDF text, its base fixed to the world, numbers to their last digit.

    Links that are fixed to another are frames of it, as SDF has no link without mass; the inertia of all stands at the
    link that moves.
    """
    structure = structure_of(robot)
    joints = {joint.name: joint for joint in robot.joints}
    root = Element("sdf", version="1.7")
    model = SubElement(root, "model", name=robot.name)
    base = structure.bodies[0].name
    links = {base: SubElement(model, "link", name=base)}  # by the link that each belongs to
    fixed = SubElement(model, "joint", name=f"world_to_{base}", type="fixed")
    _say(fixed, parent="world", child=base)
    for connection in structure.connections:
        if connection.axis is None:
            frame = SubElement(model, "frame", {"name": connection.child, "attached_to": connection.parent})
            _pose(frame, connection.origin)
            links[connection.child] = links[connection.parent]
            continue
        link = links[connection.child] = SubElement(model, "link", name=connection.child)
        _pose(link, connection.origin, connection.parent)
        link.append(inertial(robot.model.inertias[1 + robot.index(connection.name)]))
        _joint(model, connection, joints[connection.name])
    for number, solid in enumerate(structure.solids):
        _shape(links[solid.link], solid, number)
    indent(root)
    return tostring(root, encoding="unicode") + "\n"


def _joint(model: Element, connection: Connection, limits: Joint) -> None:
    joint = SubElement(model, "joint", name=connection.name, type=connection.kind)
    _say(joint, parent=connection.parent, child=connection.child)
    axis = SubElement(joint, "axis")
    assert connection.axis is not None
    _say(axis, xyz=words(*connection.axis))
    known = {name: getattr(limits, name) for name in ("lower", "upper", "effort", "velocity")}
    _say(SubElement(axis, "limit"), **{name: repr(value) for name, value in known.items() if np.isfinite(value)})
    _say(SubElement(axis, "dynamics"), damping=repr(connection.damping), friction=repr(connection.friction))


def inertial(body: pin.Inertia) -> Element:
    """Return a body's element, in its link's frame."""
    element = Element("inertial")
    _say(element, pose=words(*body.lever, 0, 0, 0), mass=repr(float(body.mass)))
    _say(SubElement(element, "inertia"), **dict(zip(MOMENTS, map(repr, six_numbers(body.inertia)), strict=True)))
    return element


def _shape(link: Element, solid: Solid, number: int) -> None:
    shape = SubElement(link, solid.purpose, name=f"{solid.purpose}_{number}")
    _pose(shape, solid.origin, solid.link)
    kind = SubElement(SubElement(shape, "geometry"), solid.kind)
    if solid.kind == "mesh":
        _say(kind, uri=solid.file or "", scale=words(*solid.size))
    elif solid.kind == "box":
        _say(kind, size=words(*solid.size))
    else:
        _say(kind, **dict(zip(("radius", "length"), map(repr, solid.size), strict=False)))  # a sphere has no length
    if solid.colour is not None and solid.purpose == "visual":
        _say(SubElement(shape, "material"), ambient=words(*solid.colour), diffuse=words(*solid.colour))


def _pose(element: Element, origin: Origin, beside: str | None = None) -> None:
    pose = SubElement(element, "pose", {} if beside is None else {"relative_to": beside})
    pose.text = words(*origin.xyz, *origin.rpy)


def _say(element: Element, **texts: str) -> None:
    for name, text in texts.items():
        SubElement(element, name).text = text

"""URDF text: of a structure, or another one with single numbers changed."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from xml.etree.ElementTree import Element, SubElement, indent, tostring
from xml.sax.saxutils import quoteattr

import numpy as np
import pinocchio as pin

from irtwin.robot.description import Joint, Robot
from irtwin.robot.structure import MOMENTS, Body, Connection, Origin, Solid, Structure, six_numbers
from irtwin.robot.urdf import parse_urdf
from irtwin.robot.xml_elements import outermost, with_child, words


def urdf_text(name: str, structure: Structure, joints: Iterable[Joint]) -> str:
    """Return a structure as URDF text, numbers to their last digit; `joints` give the limits of those that move."""
    limits = {joint.name: joint for joint in joints}
    root = Element("robot", name=name)
    for body in structure.bodies:
        _link(root, body, [solid for solid in structure.solids if solid.link == body.name])
    for connection in structure.connections:
        _joint(root, connection, limits.get(connection.name))
    indent(root)
    return tostring(root, encoding="unicode") + "\n"


def robot_of(name: str, structure: Structure, joints: Iterable[Joint], source: str) -> Robot:
    """Return the robot of a structure with its moving joints; `source` names it in messages. Raises InputError."""
    moving = list(joints)
    robot = parse_urdf(urdf_text(name, structure, moving), source)
    accelerations = {joint.name: joint.acceleration for joint in moving}  # of these a URDF has no word
    return replace(
        robot, joints=tuple(replace(joint, acceleration=accelerations[joint.name]) for joint in robot.joints)
    )


def _link(root: Element, body: Body, solids: Sequence[Solid]) -> None:
    link = SubElement(root, "link", name=body.name)
    if body.mass is not None:
        inertial = SubElement(link, "inertial")
        SubElement(inertial, "mass", value=repr(body.mass))
        if body.com is not None:
            SubElement(inertial, "origin", xyz=words(*body.com))
        if body.inertia is not None:
            SubElement(inertial, "inertia", dict(zip(MOMENTS, map(repr, body.inertia), strict=True)))
    for solid in solids:
        shape = SubElement(link, solid.purpose)
        _origin(shape, solid.origin)
        SubElement(SubElement(shape, "geometry"), solid.kind, _sizes(solid))
        if solid.colour is not None:
            rgba = words(*solid.colour)  # its name too: readers take two materials of one name for the same
            SubElement(SubElement(shape, "material", name=f"rgba {rgba}"), "color", rgba=rgba)


def _sizes(solid: Solid) -> dict[str, str]:
    if solid.kind == "box":
        return {"size": words(*solid.size)}
    if solid.kind == "mesh":
        return {"filename": solid.file or "", "scale": words(*solid.size)}
    return dict(zip(("radius", "length"), map(repr, solid.size), strict=False))  # a sphere has no length


def _joint(root: Element, connection: Connection, limits: Joint | None) -> None:
    joint = SubElement(root, "joint", name=connection.name, type=connection.kind)
    _origin(joint, connection.origin)
    SubElement(joint, "parent", link=connection.parent)
    SubElement(joint, "child", link=connection.child)
    if connection.axis is not None:
        SubElement(joint, "axis", xyz=words(*connection.axis))
    if connection.damping or connection.friction:
        SubElement(joint, "dynamics", damping=repr(connection.damping), friction=repr(connection.friction))
    if limits is not None:
        values = {name: getattr(limits, name) for name in ("lower", "upper", "velocity", "effort")}
        known = {name: repr(value) for name, value in values.items() if np.isfinite(value)}
        if known:  # the format asks for speed and effort too: 0 is no limit
            SubElement(joint, "limit", {"velocity": "0.0", "effort": "0.0"} | known)


def _origin(element: Element, origin: Origin) -> None:
    SubElement(element, "origin", xyz=words(*origin.xyz), rpy=words(*origin.rpy))


def with_numbers(urdf: str, bodies: Mapping[str, pin.Inertia], dynamics: Mapping[str, Mapping[str, float]]) -> str:
    """Return checked URDF text with these bodies of links, in the links' frames, and numbers of joints' <dynamics>."""
    content = urdf.encode("utf-8")
    for element in reversed(outermost(content).children):  # from behind: places before stay right
        name = element.attributes.get("name", "")
        if element.tag == "link" and name in bodies:
            content = with_child(content, element, "inertial", _inertial(bodies[name]))
        elif element.tag == "joint" and dynamics.get(name):
            present = next((child.attributes for child in element.children if child.tag == "dynamics"), {})
            words = present | {key: repr(value) for key, value in dynamics[name].items()}
            tag = " ".join(["<dynamics", *(f"{key}={quoteattr(value)}" for key, value in words.items())])
            content = with_child(content, element, "dynamics", f"{tag}/>")
    return content.decode("utf-8")


def _inertial(body: pin.Inertia) -> str:
    centre = " ".join(map(repr, body.lever.tolist()))
    moments = " ".join(f'{name}="{value!r}"' for name, value in zip(MOMENTS, six_numbers(body.inertia), strict=True))
    return f'<inertial><origin xyz="{centre}"/><mass value="{float(body.mass)!r}"/><inertia {moments}/></inertial>'

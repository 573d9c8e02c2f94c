"""MJCF text of a robot: what MuJoCo needs to move it."""

from __future__ import annotations

from collections.abc import Mapping
from xml.etree.ElementTree import Element, SubElement, indent, tostring

import numpy as np
import pinocchio as pin

from irtwin.robot.description import Joint, Robot
from irtwin.robot.structure import Connection, Origin, Solid, six_numbers, structure_of
from irtwin.robot.xml_elements import words


def mjcf_text(robot: Robot, armature: Mapping[str, float]) -> str:
    """Return a robot as MJCF text, numbers to their last digit; `armature`, kg m^2 (kg), of joints by name.

    Links that are fixed together are one body's, whose inertia stands at the link that moves. Shapes collide with the
    surroundings, not with one another; meshes are left out. A motor drives each joint.
    """
    structure = structure_of(robot)
    root = Element("mujoco", model=robot.name)
    SubElement(root, "compiler", angle="radian", inertiafromgeom="false")
    world = SubElement(root, "worldbody")
    joints = {joint.name: joint for joint in robot.joints}
    above = {connection.child: connection for connection in structure.connections}
    bodies: dict[str, Element] = {}
    for link in structure.bodies:
        connection = above.get(link.name)
        parent = world if connection is None else bodies[connection.parent]
        placed = {} if connection is None else _place(connection.origin)
        body = bodies[link.name] = SubElement(parent, "body", {"name": link.name} | placed)
        if connection is not None and connection.axis is not None:
            _joint(body, connection, joints[connection.name], armature.get(connection.name))
            SubElement(body, "inertial", inertial(robot.model.inertias[1 + robot.index(connection.name)]))
        for solid in structure.solids:
            if solid.link == link.name and solid.kind != "mesh":
                _geom(body, solid)
    motors = SubElement(root, "actuator")
    for joint in robot.joints:
        limits = {"ctrlrange": words(-joint.effort, joint.effort)} if np.isfinite(joint.effort) else {}
        SubElement(motors, "motor", {"name": joint.name, "joint": joint.name} | limits)
    indent(root)
    return tostring(root, encoding="unicode") + "\n"


def _joint(body: Element, connection: Connection, limits: Joint, armature: float | None) -> None:
    kind = "slide" if connection.kind == "prismatic" else "hinge"
    assert connection.axis is not None
    attributes = {"name": connection.name, "type": kind, "axis": words(*connection.axis)}
    if np.isfinite(limits.lower) and np.isfinite(limits.upper):
        attributes["range"] = words(limits.lower, limits.upper)
    numbers = {"damping": connection.damping, "frictionloss": connection.friction, "armature": armature}
    SubElement(body, "joint", attributes | {name: repr(value) for name, value in numbers.items() if value})


def inertial(body: pin.Inertia) -> dict[str, str]:
    """Return the attributes of a body's <inertial>."""
    if not body.mass:  # MuJoCo takes no six zeros
        return {"pos": "0 0 0", "mass": "0", "diaginertia": "0 0 0"}
    moments = words(*six_numbers(body.inertia))
    return {"pos": words(*body.lever), "mass": repr(float(body.mass)), "fullinertia": moments}


def _geom(body: Element, solid: Solid) -> None:
    half = [0.5 * size for size in solid.size]
    sizes = {"box": half, "cylinder": [solid.size[0], *half[1:]], "sphere": solid.size}[solid.kind]
    geom = {"type": solid.kind, "size": words(*sizes), "conaffinity": "0"} | _place(solid.origin)
    if solid.purpose == "visual":
        geom |= {"contype": "0", "group": "2"}
    if solid.colour is not None:
        geom["rgba"] = words(*solid.colour)
    SubElement(body, "geom", geom)


def _place(origin: Origin) -> dict[str, str]:
    x, y, z, w = pin.Quaternion(origin.transform[:3, :3]).coeffs()
    return {"pos": words(*origin.xyz), "quat": words(w, x, y, z)}

"""Robots from URDF text, read as hostile input: no DTD, no entity, no outside file."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from xml.etree.ElementTree import Element, ParseError

import numpy as np
import pinocchio as pin
from defusedxml import DefusedXmlException
from defusedxml import ElementTree as SafeXml

from irtwin.errors import InputError
from irtwin.input_file import read_text
from irtwin.robot.description import Joint, Link, Robot, Shape

_MOVING = ("revolute", "continuous", "prismatic")
_LARGEST = 20_000_000  # bytes
_MOST_LINKS = 5000
_DEEPEST = 500  # links, base to flange: Pinocchio goes down the tree by recursion, and 5000 take the whole stack
_MOST_JOINTS = 100  # that move
_GREY = (0.7, 0.7, 0.72, 1.0)


def read_urdf(path: Path | str) -> Robot:
    """Read a robot from a URDF file.

    Raises InputError where the file cannot be read, does not parse, or describes no robot that can be modelled.
    """
    return parse_urdf(read_text(Path(path), _LARGEST), source=str(path))


def parse_urdf(text: str, source: str = "URDF") -> Robot:
    """Make a robot of URDF text; `source` names it in messages. Meshes are never opened. Raises InputError."""
    root = _parse(text, source)
    links = _links(root, source)
    held = _held(root, source)
    joints = _joints(root, links, source)
    _check_tree(root, links, source)
    robot = Robot(name=root.get("name") or "robot", joints=(), links=tuple(links.values()), urdf=text, held=held)
    try:
        order = list(robot.model.names)[1:]
    except (ValueError, RuntimeError) as error:
        raise InputError(f"{source}: Pinocchio cannot build this robot: {_first_line(error)}") from error
    return replace(robot, joints=tuple(joints[name] for name in order))


def _first_line(error: Exception) -> str:
    return str(error).strip().splitlines()[0] if str(error).strip() else type(error).__name__


def _parse(text: str, source: str) -> Element:
    try:
        # as bytes: a declared encoding is then no contradiction to text that is already decoded
        root: Element = SafeXml.fromstring(text.encode("utf-8"), forbid_dtd=True)
    except ParseError as error:
        line, column = error.position
        raise InputError(
            f"{source}, line {line}, column {column + 1}: not well-formed XML ({error.msg}); give a URDF"
        ) from error
    except DefusedXmlException as error:
        raise InputError(f"{source}: contains a DTD or an entity; remove the <!DOCTYPE ...>") from error
    except (LookupError, ValueError) as error:
        raise InputError(f"{source}: not readable as XML ({_first_line(error)}); save the URDF as UTF-8") from error
    if root.tag != "robot":
        raise InputError(f"{source}: the outermost element is <{root.tag}>, not <robot>; expand xacro files first")
    return root


def _links(root: Element, source: str) -> dict[str, Link]:
    materials = {m.get("name"): m for m in root.findall("material") if m.find("color") is not None}
    links: dict[str, Link] = {}
    for element in root.findall("link"):
        name = _attribute(element, "name", source, "a link")
        if name in links:
            raise InputError(f'{source}: two links are named "{name}"; give each its own name')
        mass = element.find("inertial/mass")
        value = 0.0 if mass is None else _number(mass.get("value"), f'{source}: mass of link "{name}"')
        if value < 0:
            raise InputError(f'{source}: link "{name}" has the negative mass {value} kg')
        _check_inertia(element, f'{source}: inertia of link "{name}"')
        shapes, collisions = (_shapes(element, kind, materials, source) for kind in ("visual", "collision"))
        links[name] = Link(name, value, shapes, collisions)
    if len(links) > _MOST_LINKS:
        raise InputError(f"{source}: has {len(links)} links; a robot of more than {_MOST_LINKS} cannot be modelled")
    if not links:
        raise InputError(f"{source}: has no link; a robot needs <link> and <joint> elements")
    return links


def _check_inertia(link: Element, where: str) -> None:
    """Hold an inertia to be six numbers, none of its moments negative: Pinocchio would take anything for zero."""
    _placement(link.find("inertial/origin"), where)
    inertia = link.find("inertial/inertia")
    if inertia is None:
        return
    values = {key: _number(inertia.get(key, "0"), where) for key in ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")}
    negative = [key for key in ("ixx", "iyy", "izz") if values[key] < 0]
    if negative:
        raise InputError(f"{where}: {negative[0]} is negative, {values[negative[0]]} kg m^2")


def _shapes(link: Element, kind: str, materials: dict[str | None, Element], source: str) -> tuple[Shape, ...]:
    where = f'{source}: {kind} of link "{link.get("name")}"'
    shapes = (_shape(element, materials, where) for element in link.findall(kind))
    return tuple(shape for shape in shapes if shape is not None)


def _shape(visual: Element, materials: dict[str | None, Element], where: str) -> Shape | None:
    """Return the primitive of a <visual> or <collision>; None for a mesh, which is never opened."""
    geometry = visual.find("geometry")
    kind = geometry[0] if geometry is not None and len(geometry) else None
    if kind is None or kind.tag == "mesh":
        return None
    if kind.tag == "box":
        size = numbers(kind.get("size"), 3, where)
    elif kind.tag == "cylinder":
        size = (_number(kind.get("radius"), where), _number(kind.get("length"), where))
    elif kind.tag == "sphere":
        size = (_number(kind.get("radius"), where),)
    else:
        return None
    material = visual.find("material")
    if material is not None and material.find("color") is None:
        material = materials.get(material.get("name"))
    colour = None if material is None else material.find("color")
    rgba = _GREY if colour is None else numbers(colour.get("rgba"), 4, where)
    return Shape(kind.tag, size, _placement(visual.find("origin"), where), (rgba[0], rgba[1], rgba[2], rgba[3]))


def _placement(origin: Element | None, where: str) -> np.ndarray:
    if origin is None:
        return np.eye(4)
    rpy = numbers(origin.get("rpy", "0 0 0"), 3, where)
    xyz = numbers(origin.get("xyz", "0 0 0"), 3, where)
    return np.asarray(pin.SE3(pin.rpy.rpyToMatrix(np.array(rpy)), np.array(xyz)).homogeneous)


def _joints(root: Element, links: dict[str, Link], source: str) -> dict[str, Joint]:
    joints: dict[str, Joint] = {}
    seen: set[str] = set()
    for element in root.findall("joint"):
        name = _attribute(element, "name", source, "a joint")
        where = f'{source}: joint "{name}"'
        if name in seen:
            raise InputError(f"{where} is defined twice; give each joint its own name")
        seen.add(name)
        for end in ("parent", "child"):
            child = element.find(end)
            link = None if child is None else child.get("link")
            if link not in links:
                raise InputError(f'{where}: its {end} link "{link}" is not defined')
        _placement(element.find("origin"), where)
        kind = element.get("type")
        if kind == "fixed":
            continue
        if kind not in _MOVING:
            raise InputError(f'{where}: type "{kind}" cannot be modelled; use revolute, continuous, prismatic or fixed')
        if element.find("mimic") is not None:
            continue
        joints[name] = _joint(element, name, kind, where)
    if not joints:
        raise InputError(f"{source}: no joint moves; a robot needs at least one revolute or prismatic joint")
    if len(joints) > _MOST_JOINTS:
        raise InputError(f"{source}: {len(joints)} joints move; a robot of more than {_MOST_JOINTS} cannot be modelled")
    return joints


def _held(root: Element, source: str) -> tuple[str, ...]:
    """Return the names of the joints that mimic others, which stand still in the model."""
    names = [joint.get("name") for joint in root.findall("joint")]
    held = []
    for joint in root.findall("joint"):
        mimic = joint.find("mimic")
        if mimic is None or joint.get("type") == "fixed":
            continue
        name, other = str(joint.get("name")), mimic.get("joint")
        if other not in names or other == name:
            raise InputError(f'{source}: joint "{name}": mimics "{other}", which is no other joint of this robot')
        held.append(name)
    return tuple(held)


def _joint(element: Element, name: str, kind: str, where: str) -> Joint:
    axis = element.find("axis")
    if axis is not None and not any(numbers(axis.get("xyz"), 3, where)):
        raise InputError(f"{where}: its axis is zero; give a direction")
    limit = element.find("limit")

    def value(key: str, otherwise: float) -> float:
        text = None if limit is None else limit.get(key)
        return otherwise if text is None else _number(text, f"{where}: limit {key}")

    bounded = kind != "continuous" and limit is not None
    lower, upper = (value("lower", 0.0), value("upper", 0.0)) if bounded else (-math.inf, math.inf)
    if lower > upper:
        raise InputError(f"{where}: its lower limit {lower} lies above its upper limit {upper}")
    # 0 is how many files say "not known"
    return Joint(name, kind, lower, upper, value("velocity", 0.0) or math.inf, value("effort", 0.0) or math.inf)


def _check_tree(root: Element, links: dict[str, Link], source: str) -> None:
    parents: dict[str, str] = {}
    for element in root.findall("joint"):
        parent, child = (str(element.find(end).get("link")) for end in ("parent", "child"))  # type: ignore[union-attr]
        if child in parents:
            raise InputError(f'{source}: link "{child}" is the child of two joints; a URDF is a tree')
        parents[child] = parent
    roots = [link for link in links if link not in parents]
    if len(roots) != 1:
        what = "no link is the base (the joints form a loop)" if not roots else f"several bases: {', '.join(roots)}"
        raise InputError(f"{source}: {what}; all links must be connected to one base")
    depths = {roots[0]: 0}
    for link in links:
        way: list[str] = []
        at = link
        while at not in depths and len(way) <= len(links):
            way.append(at)
            at = parents[at]
        if len(way) > len(links):
            raise InputError(f'{source}: the joints around link "{link}" form a loop; a URDF is a tree')
        for below in reversed(way):
            depths[below] = depths[parents[below]] + 1
    if max(depths.values()) > _DEEPEST:
        raise InputError(f"{source}: a chain of more than {_DEEPEST} links cannot be modelled")


def _attribute(element: Element, key: str, source: str, what: str) -> str:
    value = element.get(key)
    if not value:
        raise InputError(f'{source}: {what} has no "{key}"')
    return value


def _number(text: str | None, where: str) -> float:
    return numbers(text, 1, where)[0]


def numbers(text: str | None, count: int, where: str) -> tuple[float, ...]:
    """Return so many finite numbers of an attribute. Raises InputError, naming `where`, on anything else."""
    try:
        values = tuple(float(word) for word in (text or "").split())
    except ValueError:
        values = ()
    if len(values) != count or not all(math.isfinite(value) for value in values):
        shown = text if text is None or len(text) < 60 else f"{text[:60]}..."
        raise InputError(f'{where}: "{shown}" should be {count} finite number{"s" if count > 1 else ""}')
    return values

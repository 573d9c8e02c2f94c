"""Robots from URDF text, read as hostile input: no DTD, no entity, no outside file."""

from __future__ import annotations

import math
import re
from collections import Counter
from dataclasses import replace
from graphlib import CycleError, TopologicalSorter
from pathlib import Path
from xml.etree.ElementTree import Element, ParseError

from defusedxml import DefusedXmlException
from defusedxml import ElementTree as SafeXml

from irtwin.errors import InputError, first_line
from irtwin.input_file import read_text
from irtwin.robot.description import Joint, Link, Robot
from irtwin.robot.structure import MOMENTS, PRIMITIVES, colours_of, origin_of, solids_of
from irtwin.robot.xml_elements import numbers

_MOVING = ("revolute", "continuous", "prismatic")
_LARGEST = 20_000_000  # bytes
_MOST_LINKS = 5000
_DEEPEST = 500  # links, base to flange: Pinocchio goes down the tree by recursion, and 5000 take the whole stack
_MOST_JOINTS = 100  # that move
_PREFIX = re.compile(r"[<\s]([A-Za-z_][\w.-]*):[A-Za-z_][\w.-]*\s*[=\s/>]")  # of an element or an attribute


def read_urdf(path: Path | str) -> Robot:
    """Read a robot from a URDF file.

    Raises InputError where the file cannot be read, does not parse, or describes no robot that can be modelled.
    """
    return parse_urdf(read_text(Path(path), _LARGEST), source=str(path))


def parse_urdf(text: str, source: str = "URDF") -> Robot:
    """Make a robot of URDF text; `source` names it in messages. Meshes are never opened. Raises InputError."""
    text = _declared(text)
    root = _parse(text, source)
    links = _links(root, source)
    joints, held = _joints(root, links, source)
    _check_tree(root, links, source)
    robot = Robot(name=root.get("name") or "robot", joints=(), links=tuple(links.values()), urdf=text, held=tuple(held))
    try:
        order = list(robot.model.names)[1:]
    except (ValueError, RuntimeError) as error:
        raise InputError(f"{source}: Pinocchio cannot build this robot: {first_line(error)}") from error
    return replace(robot, joints=tuple(joints[name] for name in order))


def _declared(text: str) -> str:
    """Declare the prefixes that a URDF uses only (drake:acceleration): readers of URDF know no namespaces."""
    lacking = sorted(set(_PREFIX.findall(text)) - {"xml", "xmlns", *re.findall(r"xmlns:([\w.-]+)", text)})
    return re.sub(r"<robot\b", "<robot" + "".join(f' xmlns:{prefix}="{prefix}"' for prefix in lacking), text, count=1)


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
        raise InputError(f"{source}: not readable as XML ({first_line(error)}); save the URDF as UTF-8") from error
    if root.tag != "robot":
        raise InputError(f"{source}: the outermost element is <{root.tag}>, not <robot>; expand xacro files first")
    return root


def _links(root: Element, source: str) -> dict[str, Link]:
    colours = colours_of(root)
    links: dict[str, Link] = {}
    for element in root.findall("link"):
        name = _attribute(element, "name", source, "a link")
        if name in links:
            raise InputError(f'{source}: two links are named "{name}"; give each its own name')
        mass = element.find("inertial/mass")
        (value,) = (0.0,) if mass is None else numbers(mass.get("value"), 1, f'{source}: mass of link "{name}"')
        if value < 0:
            raise InputError(f'{source}: link "{name}" has the negative mass {value} kg')
        _check_inertia(element, f'{source}: inertia of link "{name}"')
        list(solids_of(element, colours, source, PRIMITIVES))  # for their faults; meshes are read where they are opened
        links[name] = Link(name, value)
    if len(links) > _MOST_LINKS:
        raise InputError(f"{source}: has {len(links)} links; a robot of more than {_MOST_LINKS} cannot be modelled")
    if not links:
        raise InputError(f"{source}: has no link; a robot needs <link> and <joint> elements")
    return links


def _check_inertia(link: Element, where: str) -> None:
    """Hold an inertia to be six numbers, none of its moments negative: Pinocchio would take anything for zero."""
    inertial = link.find("inertial")
    if inertial is not None:
        origin_of(inertial, where)
    inertia = link.find("inertial/inertia")
    if inertia is None:
        return
    values = {key: numbers(inertia.get(key, "0"), 1, where)[0] for key in MOMENTS}
    negative = [key for key in MOMENTS[:3] if values[key] < 0]
    if negative:
        raise InputError(f"{where}: {negative[0]} is negative, {values[negative[0]]} kg m^2")


def _joints(root: Element, links: dict[str, Link], source: str) -> tuple[dict[str, Joint], list[str]]:
    """Return the joints that move by name, and the names of those that mimic others, which stand still in the model."""
    joints: dict[str, Joint] = {}
    held: list[str] = []
    named = Counter(joint.get("name") for joint in root.findall("joint"))
    for element in root.findall("joint"):
        name = _attribute(element, "name", source, "a joint")
        where = f'{source}: joint "{name}"'
        if named[name] > 1:
            raise InputError(f"{where} is defined twice; give each joint its own name")
        _check_ends(element, links, where)
        kind, mimic = element.get("type"), element.find("mimic")
        if kind == "fixed":
            continue
        if kind not in _MOVING:
            raise InputError(f'{where}: type "{kind}" cannot be modelled; use revolute, continuous, prismatic or fixed')
        if mimic is None:
            joints[name] = _joint(element, name, kind, where)
        elif mimic.get("joint") in named and mimic.get("joint") != name:
            held.append(name)
        else:
            raise InputError(f'{where}: mimics "{mimic.get("joint")}", which is no other joint of this robot')
    if not joints:
        raise InputError(f"{source}: no joint moves; a robot needs at least one revolute or prismatic joint")
    if len(joints) > _MOST_JOINTS:
        raise InputError(f"{source}: {len(joints)} joints move; a robot of more than {_MOST_JOINTS} cannot be modelled")
    return joints, held


def _check_ends(joint: Element, links: dict[str, Link], where: str) -> None:
    for end in ("parent", "child"):
        element = joint.find(end)
        link = None if element is None else element.get("link")
        if link not in links:
            raise InputError(f'{where}: its {end} link "{link}" is not defined')
    origin_of(joint, where)


def _joint(element: Element, name: str, kind: str, where: str) -> Joint:
    axis = element.find("axis")
    if axis is not None and not any(numbers(axis.get("xyz"), 3, where)):
        raise InputError(f"{where}: its axis is zero; give a direction")
    limit = element.find("limit")

    def value(key: str, otherwise: float) -> float:
        text = None if limit is None else limit.get(key)
        return otherwise if text is None else numbers(text, 1, f"{where}: limit {key}")[0]

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
        fault = "no link is the base (the joints form a loop)" if not roots else f"several bases: {', '.join(roots)}"
        raise InputError(f"{source}: {fault}; all links must be connected to one base")
    depths = {roots[0]: 0}
    try:
        for link in TopologicalSorter({child: [parent] for child, parent in parents.items()}).static_order():
            if link in parents:
                depths[link] = depths[parents[link]] + 1
    except CycleError as error:
        raise InputError(
            f'{source}: the joints around link "{error.args[1][0]}" form a loop; a URDF is a tree'
        ) from None
    if max(depths.values()) > _DEEPEST:
        raise InputError(f"{source}: a chain of more than {_DEEPEST} links cannot be modelled")


def _attribute(element: Element, key: str, source: str, owner: str) -> str:
    value = element.get(key)
    if not value:
        raise InputError(f'{source}: {owner} has no "{key}"')
    return value

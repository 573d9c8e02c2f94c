"""What a URDF says of a robot beside its moving joints: every link and joint, their places, and the shapes of links.

Meshes are named, never opened.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from xml.etree.ElementTree import Element

import numpy as np
import pinocchio as pin
from defusedxml import ElementTree as SafeXml

from irtwin.robot.description import Robot
from irtwin.robot.xml_elements import numbers

Three = tuple[float, float, float]
Colours = Mapping[str | None, Element | None]
_SIZES = {"box": ("size",), "cylinder": ("radius", "length"), "sphere": ("radius",), "mesh": ()}
_COUNTS = {"size": 3, "radius": 1, "length": 1}  # numbers of each
PRIMITIVES = ("box", "cylinder", "sphere")
PURPOSES = ("visual", "collision")
_SIX = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))  # of an inertia: xx, yy, zz, xy, xz, yz
MOMENTS = ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")  # what URDF and SDF call them


def six_numbers(inertia: np.ndarray) -> tuple[float, float, float, float, float, float]:
    """Return the numbers xx, yy, zz, xy, xz, yz of an inertia (3, 3)."""
    xx, yy, zz, xy, xz, yz = (float(inertia[place]) for place in _SIX)
    return xx, yy, zz, xy, xz, yz


def inertia_of(six: Sequence[float]) -> np.ndarray:
    """Return the inertia (3, 3) of the numbers xx, yy, zz, xy, xz, yz."""
    xx, yy, zz, xy, xz, yz = six
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def principal(inertia: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the principal moments (3,) of an inertia (3, 3), and a right-handed frame of its axes (3, 3)."""
    moments, axes = np.linalg.eigh(inertia)
    axes[:, 2] *= np.linalg.det(axes)
    return moments, axes


@dataclass(frozen=True)
class Origin:
    """Where a frame lies in another: xyz in m, rpy in rad (turned about fixed x, then y, then z)."""

    xyz: Three = (0.0, 0.0, 0.0)
    rpy: Three = (0.0, 0.0, 0.0)

    @classmethod
    def of(cls, transform: np.ndarray) -> Origin:
        """Return the origin of a (4, 4) transform."""
        angles = pin.rpy.matrixToRpy(transform[:3, :3])
        return cls(_three(transform[:3, 3] + 0.0), _three(angles + 0.0))  # no -0.0

    @property
    def transform(self) -> np.ndarray:
        """The (4, 4) transform from the frame to the one that it lies in, m."""
        return np.asarray(pin.SE3(pin.rpy.rpyToMatrix(*self.rpy), np.array(self.xyz)).homogeneous)


@dataclass(frozen=True)
class Body:
    """A link: mass in kg, centre of mass `com` in m, `inertia` xx, yy, zz, xy, xz, yz about it in kg m^2.

    All in the link's own axes; None where the URDF gives the link no inertia.
    """

    name: str
    mass: float | None
    com: Three | None
    inertia: tuple[float, ...] | None

    @property
    def spatial(self) -> pin.Inertia:
        """Its spatial inertia; zero where it has none."""
        return pin.Inertia(self.mass or 0.0, np.array(self.com or (0.0,) * 3), inertia_of(self.inertia or (0.0,) * 6))


@dataclass(frozen=True)
class Connection:
    """A joint between two links, at zero at `origin` in the parent's frame; `axis`, of length one, in its own.

    kind: "revolute", "continuous", "prismatic", or "fixed", which a joint that mimics another is too; a fixed one has
    no axis. `damping` (N m s/rad, N s/m) and dry `friction` (N m, N): 0 where none is said.
    """

    name: str
    kind: str
    parent: str
    child: str
    origin: Origin
    axis: Three | None
    damping: float = 0.0
    friction: float = 0.0


@dataclass(frozen=True)
class Solid:
    """A shape of a link, for the eye or against collisions: "box" (x, y, z), "cylinder" (radius, length), "sphere"
    (radius), m.

    Of a "mesh", `file` is its path as the URDF writes it, and `size` the factors that it is stretched by. `colour` is
    RGBA in 0..1, None where none is given.
    """

    link: str
    purpose: str  # one of PURPOSES
    kind: str
    size: tuple[float, ...]
    origin: Origin
    colour: tuple[float, ...] | None = None
    file: str | None = None


@dataclass(frozen=True)
class Structure:
    """Links, the base first and each after its parent; the joints in between; the links' shapes."""

    bodies: tuple[Body, ...]
    connections: tuple[Connection, ...]
    solids: tuple[Solid, ...]


def structure_of(robot: Robot) -> Structure:
    """Return the structure of a robot. Raises InputError where a shape against collisions cannot be read."""
    root = SafeXml.fromstring(robot.urdf.encode("utf-8"), forbid_dtd=True)
    moving = set(robot.joint_names)
    links = {str(link.get("name")): link for link in root.findall("link")}
    joints = {str(joint.find("child").get("link")): joint for joint in root.findall("joint")}
    children: dict[str, list[str]] = {}
    for child, joint in joints.items():
        children.setdefault(_parent(joint), []).append(child)
    order: list[str] = []
    todo = [name for name in links if name not in joints]
    while todo:
        order.append(todo.pop())
        todo += reversed(children.get(order[-1], []))
    colours, source = colours_of(root), f"URDF of {robot.name}"
    return Structure(
        tuple(_body(name, links[name]) for name in order),
        tuple(_connection(joints[name], name, moving) for name in order if name in joints),
        tuple(solid for name in order for solid in solids_of(links[name], colours, source)),
    )


def colours_of(root: Element) -> Colours:
    """Return the colours that shapes of a URDF have by name."""
    return {material.get("name"): material.find("color") for material in root.findall("material")}


def solids_of(link: Element, colours: Colours, source: str, kinds: Collection[str] = tuple(_SIZES)) -> Iterator[Solid]:
    """Yield a link's shapes of some kinds. Raises InputError, naming `source` and link, where one cannot be read."""
    name = str(link.get("name"))
    for purpose in PURPOSES:
        where = f'{source}: {purpose} of link "{name}"'
        for element in link.findall(purpose):
            geometry = element.find("geometry")
            shape = geometry[0] if geometry is not None and len(geometry) else None
            if shape is None or shape.tag not in kinds:
                continue
            size = tuple(number for key in _SIZES[shape.tag] for number in numbers(shape.get(key), _COUNTS[key], where))
            file = None
            if shape.tag == "mesh":
                file, size = shape.get("filename", ""), numbers(shape.get("scale", "1 1 1"), 3, where)
            colour = _colour(element, colours, where) if purpose == "visual" else None
            yield Solid(name, purpose, shape.tag, size, origin_of(element, where), colour, file)


def origin_of(element: Element, where: str = "URDF") -> Origin:
    """Return an element's <origin>. Raises InputError, naming `where`, where it cannot be read."""
    origin = element.find("origin")
    if origin is None:
        return Origin()
    xyz, rpy = (numbers(origin.get(key, "0 0 0"), 3, where) for key in ("xyz", "rpy"))
    return Origin(_three(xyz), _three(rpy))


def _parent(joint: Element) -> str:
    return str(joint.find("parent").get("link"))  # type: ignore[union-attr]


def _body(name: str, link: Element) -> Body:
    inertial = link.find("inertial")
    mass = None if inertial is None else inertial.find("mass")
    if inertial is None or mass is None:
        return Body(name, None, None, None)
    origin = origin_of(inertial)
    moments = inertial.find("inertia")
    turned = None
    if moments is not None:
        tensor = inertia_of([float(moments.get(key, "0")) for key in MOMENTS])
        turn = origin.transform[:3, :3]
        turned = six_numbers(turn @ tensor @ turn.T)
    return Body(name, float(mass.get("value", "0")), origin.xyz, turned)


def _connection(joint: Element, child: str, moving: set[str]) -> Connection:
    name = str(joint.get("name"))
    axis = None
    if name in moving:
        element = joint.find("axis")
        along = np.array([1.0, 0.0, 0.0] if element is None else numbers(element.get("xyz"), 3, name))
        along = along / np.abs(along).max()  # else the squares of huge numbers would be infinite
        axis = _three(along / np.linalg.norm(along))
    kind = str(joint.get("type")) if name in moving else "fixed"
    dynamics = joint.find("dynamics") if name in moving else None
    coefficients = [
        numbers("0" if dynamics is None else dynamics.get(key, "0"), 1, name)[0] for key in ("damping", "friction")
    ]
    return Connection(name, kind, _parent(joint), child, origin_of(joint), axis, *coefficients)


def _colour(visual: Element, colours: Colours, where: str) -> tuple[float, ...] | None:
    material = visual.find("material")
    if material is None:
        return None
    colour = material.find("color")
    colour = colours.get(material.get("name")) if colour is None else colour
    return None if colour is None else tuple(numbers(colour.get("rgba"), 4, where))


def _three(values: Sequence[float] | np.ndarray) -> Three:
    x, y, z = (float(value) for value in values)
    return x, y, z

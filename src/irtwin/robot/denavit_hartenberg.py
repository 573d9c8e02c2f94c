"""Denavit-Hartenberg tables, standard and modified, and the robots that they describe."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from xml.etree.ElementTree import Element, SubElement, indent, tostring

import numpy as np
import pinocchio as pin

from irtwin.errors import InputError
from irtwin.robot.description import Robot
from irtwin.robot.urdf import parse_urdf

CONVENTIONS = ("standard", "modified")
_NOMINAL = (0.01, 0.01, 0.01, 0.0, 0.0, 0.0)  # kg m^2, of a link whose inertia nobody gave


@dataclass(frozen=True)
class Row:
    """One joint of a table: a, d in m; alpha, theta in rad; theta (d, if the joint slides) at the joint's zero.

    Limits are in rad (m), rad/s (m/s) and N m (N), 0 where not known. `mass` in kg, `com` in m and `inertia`
    (xx, yy, zz, xy, xz, yz about the centre of mass, kg m^2) are of the link that the joint moves, in the row's frame.
    """

    a: float
    alpha: float
    d: float
    theta: float = 0.0
    kind: str = "revolute"
    lower: float = -np.pi
    upper: float = np.pi
    velocity: float = 0.0
    effort: float = 0.0
    name: str | None = None
    mass: float = 1.0
    com: tuple[float, float, float] = (0.0, 0.0, 0.0)
    inertia: tuple[float, float, float, float, float, float] = _NOMINAL


@dataclass(frozen=True)
class ChainTable:
    """The rows of a chain, base to flange, and the (4, 4) transforms before the first and after the last of them.

    `standard` (Denavit and Hartenberg 1955) is T_i = Rot_z(theta) Trans_z(d) Trans_x(a) Rot_x(alpha); `modified`
    (Craig 1986) puts Trans_x(a) Rot_x(alpha) first. The flange is at base T_1 ... T_n tool.
    """

    rows: tuple[Row, ...]
    convention: str = "standard"
    base: np.ndarray = field(default_factory=lambda: np.eye(4))
    tool: np.ndarray = field(default_factory=lambda: np.eye(4))

    @property
    def joint_names(self) -> tuple[str, ...]:
        """Names of the joints: those of the rows, joint_1, joint_2, ... where they have none."""
        return tuple(row.name or f"joint_{number}" for number, row in enumerate(self.rows, start=1))

    def flange(self, q: Sequence[float] | np.ndarray) -> np.ndarray:
        """Return the flange's (4, 4) placement in the base frame, m, at the joint positions `q`: (n,) rad or m."""
        place = self.base
        for row, position in zip(self.rows, q, strict=True):
            place = place @ row_transform(row, self.convention, float(position))
        return np.asarray(place @ self.tool)


def row_transform(row: Row, convention: str, position: float = 0.0) -> np.ndarray:
    """Return a row's (4, 4) transform at a joint position, rad or m."""
    along_x, along_z = screw_x(row.a, row.alpha), _moved(row, position)
    return np.asarray(along_x @ along_z if convention == "modified" else along_z @ along_x)


def screw_x(a: float, alpha: float) -> np.ndarray:
    """Return Trans_x(a) Rot_x(alpha), (4, 4)."""
    c, s = np.cos(alpha), np.sin(alpha)
    return np.array([[1.0, 0.0, 0.0, a], [0.0, c, -s, 0.0], [0.0, s, c, 0.0], [0.0, 0.0, 0.0, 1.0]])


def screw_z(d: float, theta: float) -> np.ndarray:
    """Return Trans_z(d) Rot_z(theta), (4, 4)."""
    c, s = np.cos(theta), np.sin(theta)
    return np.array([[c, -s, 0.0, 0.0], [s, c, 0.0, 0.0], [0.0, 0.0, 1.0, d], [0.0, 0.0, 0.0, 1.0]])


def _moved(row: Row, position: float) -> np.ndarray:
    if row.kind == "prismatic":
        return screw_z(row.d + position, row.theta)
    return screw_z(row.d, row.theta + position)


def from_table(name: str, table: ChainTable) -> Robot:
    """Make a robot of n joints from its table: links base_link, link_1 to link_n and flange.

    Raises InputError on an empty table, and where the robot cannot be modelled.
    """
    return parse_urdf(to_urdf(name, table), source=f'Denavit-Hartenberg table of "{name}"')


def to_urdf(name: str, table: ChainTable) -> str:
    """Return a table as URDF text; the joints' zeros are those of the table. Raises InputError on an empty table."""
    if not table.rows:
        raise InputError(f'robot "{name}": its Denavit-Hartenberg table has no row; give one for each joint')
    modified = table.convention == "modified"
    along_x = [screw_x(row.a, row.alpha) for row in table.rows]
    before = along_x if modified else [np.eye(4), *along_x[:-1]]
    after = np.eye(4) if modified else along_x[-1]
    root = Element("robot", name=name)
    SubElement(root, "link", name="base_link")
    parent, start = "base_link", table.base
    names = table.joint_names
    for number, row in enumerate(table.rows, start=1):
        link = f"link_{number}"
        _link(root, link, row, np.eye(4) if modified else along_x[number - 1])
        origin = start @ before[number - 1] @ screw_z(row.d, row.theta)
        bounded = bool(np.isfinite(row.lower) and np.isfinite(row.upper))
        kind = "continuous" if row.kind == "revolute" and not bounded else row.kind
        joint = _joint(root, names[number - 1], kind, parent, link, origin)
        SubElement(joint, "axis", xyz="0 0 1")
        if bounded or kind == "continuous":  # a joint that slides has all limits or none
            limit = {"lower": row.lower, "upper": row.upper} if kind != "continuous" else {}
            limit |= {"velocity": row.velocity, "effort": row.effort}
            SubElement(joint, "limit", {key: repr(float(value)) for key, value in limit.items()})
        parent, start = link, np.eye(4)
    SubElement(root, "link", name="flange")
    _joint(root, _free("flange_joint", names), "fixed", parent, "flange", after @ table.tool)
    indent(root)
    return tostring(root, encoding="unicode") + "\n"


def _free(name: str, taken: Sequence[str]) -> str:
    """Return the name with as many underscores as make it free."""
    return name if name not in taken else _free(f"{name}_", taken)


def _joint(root: Element, name: str, kind: str, parent: str, child: str, origin: np.ndarray) -> Element:
    joint = SubElement(root, "joint", name=name, type=kind)
    SubElement(joint, "origin", _origin(origin))
    SubElement(joint, "parent", link=parent)
    SubElement(joint, "child", link=child)
    return joint


def _origin(place: np.ndarray) -> dict[str, str]:
    return {"xyz": _words(place[:3, 3]), "rpy": _words(pin.rpy.matrixToRpy(place[:3, :3]))}


def _words(values: np.ndarray) -> str:
    return " ".join(repr(value + 0.0) for value in values.tolist())  # no -0.0


def _link(root: Element, name: str, row: Row, frame: np.ndarray) -> None:
    """Add a link whose row's frame lies at `frame` in the link's own, which turns with the joint."""
    inertial = SubElement(SubElement(root, "link", name=name), "inertial")
    place = frame.copy()
    place[:3, 3] = frame[:3, :3] @ np.array(row.com) + frame[:3, 3]
    SubElement(inertial, "origin", _origin(place))
    SubElement(inertial, "mass", value=repr(float(row.mass)))
    keys = ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")
    SubElement(inertial, "inertia", {key: repr(float(value)) for key, value in zip(keys, row.inertia, strict=True)})

"""Denavit-Hartenberg tables, standard and modified, and the robots that they describe."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from irtwin.errors import InputError
from irtwin.robot.description import Joint, Robot
from irtwin.robot.structure import Body, Connection, Origin, Structure, inertia_of, six_numbers
from irtwin.robot.urdf import parse_urdf
from irtwin.robot.urdf_text import urdf_text

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
    slid, turned = (position, 0.0) if row.kind == "prismatic" else (0.0, position)
    along_x, along_z = screw_x(row.a, row.alpha), screw_z(row.d + slid, row.theta + turned)
    return np.asarray(along_x @ along_z if convention == "modified" else along_z @ along_x)


def screw_x(a: float, alpha: float) -> np.ndarray:
    """Return Trans_x(a) Rot_x(alpha), (4, 4)."""
    c, s = np.cos(alpha), np.sin(alpha)
    return np.array([[1.0, 0.0, 0.0, a], [0.0, c, -s, 0.0], [0.0, s, c, 0.0], [0.0, 0.0, 0.0, 1.0]])


def screw_z(d: float, theta: float) -> np.ndarray:
    """Return Trans_z(d) Rot_z(theta), (4, 4)."""
    c, s = np.cos(theta), np.sin(theta)
    return np.array([[c, -s, 0.0, 0.0], [s, c, 0.0, 0.0], [0.0, 0.0, 1.0, d], [0.0, 0.0, 0.0, 1.0]])


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
    names = table.joint_names
    bodies, connections = [Body("base_link", None, None, None)], []
    start = table.base
    for number, row in enumerate(table.rows, start=1):
        bodies.append(_body(f"link_{number}", row, np.eye(4) if modified else along_x[number - 1]))
        origin = Origin.of(start @ before[number - 1] @ screw_z(row.d, row.theta))
        kind = "continuous" if row.kind == "revolute" and not _bounded(row) else row.kind
        connections.append(
            Connection(names[number - 1], kind, bodies[-2].name, bodies[-1].name, origin, (0.0, 0.0, 1.0))
        )
        start = np.eye(4)
    end = Origin.of((start if modified else along_x[-1]) @ table.tool)
    connections.append(Connection(_free("flange_joint", names), "fixed", bodies[-1].name, "flange", end, None))
    bodies.append(Body("flange", None, None, None))
    limits = (_limits(joint, row) for joint, row in zip(names, table.rows, strict=True))
    return urdf_text(name, Structure(tuple(bodies), tuple(connections), ()), limits)


def _free(name: str, taken: Sequence[str]) -> str:
    """Return the name with as many underscores as make it free."""
    return name if name not in taken else _free(f"{name}_", taken)


def _bounded(row: Row) -> bool:
    return bool(np.isfinite(row.lower) and np.isfinite(row.upper))


def _limits(name: str, row: Row) -> Joint:
    """Return a joint with a row's limits; one that slides has all of them or none."""
    if row.kind == "prismatic" and not _bounded(row):
        return Joint(name, row.kind)
    lower, upper = (row.lower, row.upper) if _bounded(row) else (-np.inf, np.inf)
    return Joint(name, row.kind, lower, upper, row.velocity or np.inf, row.effort or np.inf)


def _body(name: str, row: Row, frame: np.ndarray) -> Body:
    """Return a link whose row's frame lies at `frame` in the link's own, which turns with the joint."""
    turn = frame[:3, :3]
    x, y, z = (turn @ np.array(row.com) + frame[:3, 3]).tolist()
    return Body(name, float(row.mass), (x, y, z), six_numbers(turn @ inertia_of(row.inertia) @ turn.T))

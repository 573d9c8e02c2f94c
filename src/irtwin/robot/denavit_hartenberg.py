"""Robots from a Denavit-Hartenberg table, for those whose maker publishes no URDF."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from xml.etree.ElementTree import Element, SubElement, tostring

import numpy as np
import pinocchio as pin

from irtwin.errors import InputError
from irtwin.robot.description import Robot
from irtwin.robot.urdf import parse_urdf


@dataclass(frozen=True)
class Row:
    """One joint of the table: a, d in m; alpha, theta (the joint's zero offset) in rad; limits in rad (m), rad/s."""

    a: float
    alpha: float
    d: float
    theta: float = 0.0
    kind: str = "revolute"
    lower: float = -np.pi
    upper: float = np.pi
    velocity: float = 0.0


def from_table(name: str, rows: Sequence[Row], *, modified: bool = False) -> Robot:
    """Make a robot of n joints from its table; links carry nominal inertias of 1 kg.

    The standard convention (Denavit and Hartenberg 1955) is T_i = Rot_z(theta) Trans_z(d) Trans_x(a) Rot_x(alpha);
    `modified` (Craig 1986) puts Trans_x(a) Rot_x(alpha) first. Raises InputError on an empty table.
    """
    if not rows:
        raise InputError(f'robot "{name}": its Denavit-Hartenberg table has no row; give one for each joint')
    along_x = [_screw_x(row) for row in rows]
    before = along_x if modified else [pin.SE3.Identity(), *along_x[:-1]]
    after = pin.SE3.Identity() if modified else along_x[-1]
    root = Element("robot", name=name)
    SubElement(root, "link", name="base_link")
    parent = "base_link"
    for number, (row, screw) in enumerate(zip(rows, before, strict=True), start=1):
        link = f"link_{number}"
        _nominal_link(root, link)
        joint = _joint(root, f"joint_{number}", row.kind, parent, link, screw * _screw_z(row))
        SubElement(joint, "axis", xyz="0 0 1")
        SubElement(
            joint,
            "limit",
            lower=f"{row.lower!r}",
            upper=f"{row.upper!r}",
            velocity=f"{row.velocity!r}",
            effort="0",
        )
        parent = link
    SubElement(root, "link", name="flange")
    _joint(root, "flange_joint", "fixed", parent, "flange", after)
    return parse_urdf(tostring(root, encoding="unicode"), source=f'Denavit-Hartenberg table of "{name}"')


def _screw_x(row: Row) -> pin.SE3:
    return pin.SE3(pin.rpy.rpyToMatrix(row.alpha, 0.0, 0.0), np.array([row.a, 0.0, 0.0]))


def _screw_z(row: Row) -> pin.SE3:
    return pin.SE3(pin.rpy.rpyToMatrix(0.0, 0.0, row.theta), np.array([0.0, 0.0, row.d]))


def _joint(root: Element, name: str, kind: str, parent: str, child: str, origin: pin.SE3) -> Element:
    joint = SubElement(root, "joint", name=name, type=kind)
    xyz, rpy = origin.translation, pin.rpy.matrixToRpy(origin.rotation)
    SubElement(joint, "origin", xyz=" ".join(map(repr, xyz.tolist())), rpy=" ".join(map(repr, rpy.tolist())))
    SubElement(joint, "parent", link=parent)
    SubElement(joint, "child", link=child)
    return joint


def _nominal_link(root: Element, name: str) -> None:
    inertial = SubElement(SubElement(root, "link", name=name), "inertial")
    SubElement(inertial, "mass", value="1.0")
    SubElement(inertial, "inertia", ixx="0.01", ixy="0", ixz="0", iyy="0.01", iyz="0", izz="0.01")

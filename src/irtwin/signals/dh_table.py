"""The table [robot.dh] of dataset.toml: a robot by its Denavit-Hartenberg parameters instead of a URDF."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pinocchio as pin

from irtwin.errors import InputError
from irtwin.robot.denavit_hartenberg import CONVENTIONS, Row, from_table
from irtwin.robot.denavit_hartenberg import ChainTable as DhTable
from irtwin.robot.description import Robot
from irtwin.toml_file import TomlTable, shown

DH_KEYS = ("convention", "base", "tool", "row")
ROW_KEYS = (
    "name", "type", "a", "alpha", "d", "theta", "lower", "upper", "velocity", "effort", "mass", "com", "inertia",
)  # fmt: skip
_TYPES = ("revolute", "continuous", "prismatic")
_FARTHEST = 1e3  # m, or rad
_MOST_ROWS = 100


def robot_of_table(name: str, robot: TomlTable) -> Robot:
    """Make the robot of the key `dh` of [robot]. Raises InputError, naming file, table and key, on what is wrong."""
    values = robot.values["dh"]
    if not isinstance(values, dict):
        raise InputError(f"{robot.file}: [robot.dh] should be a table, with convention and [[robot.dh.row]]")
    table = TomlTable(robot.file, "[robot.dh]", values)
    table.check_keys(DH_KEYS)
    convention = table.text("convention")
    if convention not in CONVENTIONS:
        given = "is missing" if convention is None else f'= "{convention}"'
        raise table.fault("convention", f"{given}; use {' or '.join(CONVENTIONS)} (Craig's)")
    rows = values.get("row")
    if not isinstance(rows, list) or not rows:
        raise InputError(f"{robot.file}: [[robot.dh.row]] is missing; give one for each joint, base to flange")
    if len(rows) > _MOST_ROWS:
        raise InputError(f"{robot.file}: [[robot.dh.row]]: {len(rows)} rows; a robot has at most {_MOST_ROWS}")
    read = [_row(robot, number, row) for number, row in enumerate(rows, start=1)]
    described = DhTable(tuple(read), convention, _placement(table, "base"), _placement(table, "tool"))
    twice = [joint for joint in described.joint_names if described.joint_names.count(joint) > 1]
    if twice:
        raise InputError(f'{robot.file}: [[robot.dh.row]]: two joints are named "{twice[0]}"; give each its own name')
    return from_table(name, described)


def _row(robot: TomlTable, number: int, values: Any) -> Row:
    if not isinstance(values, dict):
        raise InputError(f"{robot.file}: [[robot.dh.row]] {number} should be a table, not {shown(values)}")
    table = TomlTable(robot.file, f"[[robot.dh.row]] {number}", values)
    table.check_keys(ROW_KEYS)
    kind = table.choice("type", _TYPES, "revolute")
    lower, upper = _limits(table, kind)
    sizes: dict[str, Any] = {key: _within(table, key) for key in ("a", "alpha", "d", "theta")}
    sizes |= {key: table.number(key, least=0.0) or 0.0 for key in ("velocity", "effort")}
    row = Row(kind=kind, lower=lower, upper=upper, name=table.text("name"), **sizes)
    mass, com = table.number("mass", least=0.0), table.numbers("com", 3, "3 numbers (m: x, y, z in the row's frame)")
    about = "kg m^2: xx, yy, zz, xy, xz, yz about the centre of mass"
    inertia = table.numbers("inertia", 6, f"6 numbers ({about})")
    if mass is None and (com or inertia):
        raise table.fault("mass", "is missing; com and inertia say nothing without it")
    if inertia and min(inertia[:3]) < 0:
        raise InputError(f"{table.file}: {table.name} inertia: a moment of inertia cannot be negative")
    if mass is not None:
        row = replace(row, mass=mass, com=com or row.com, inertia=inertia or (0.0,) * 6)
    return row


def _limits(table: TomlTable, kind: str) -> tuple[float, float]:
    lower, upper = table.number("lower"), table.number("upper")
    if kind == "continuous" and (lower, upper) != (None, None):
        raise InputError(f"{table.file}: {table.name}: a continuous joint has no lower or upper limit; remove it")
    if (lower is None) != (upper is None):
        raise table.fault("lower" if lower is None else "upper", "is missing")
    if lower is None or upper is None:
        return -math.inf, math.inf
    if lower > upper:
        raise table.fault("lower", f"= {lower:g} lies above upper = {upper:g}")
    return lower, upper


def _within(table: TomlTable, key: str) -> float:
    """Return a length or an angle: 0 where it is absent, refused where no robot has it, as degrees or millimetres."""
    value = table.number(key) or 0.0
    angle = key in ("alpha", "theta")
    greatest, unit = (4 * math.pi, "rad") if angle else (_FARTHEST, "m")
    if abs(value) > greatest:
        raise table.fault(key, f"= {value:g} {unit} is beyond {greatest:.3g} {unit}")
    return value


def _placement(table: TomlTable, key: str) -> np.ndarray:
    """Return the (4, 4) transform of six numbers x, y, z, roll, pitch, yaw; the identity where they are absent."""
    six = table.numbers(key, 6, "6 numbers (x, y, z in m and roll, pitch, yaw in rad)")
    if six is None:
        return np.eye(4)
    return np.asarray(pin.SE3(pin.rpy.rpyToMatrix(np.array(six[3:])), np.array(six[:3])).homogeneous)

"""Robots and runs for the tests of the scene."""

from __future__ import annotations

import base64
import json
import re
from typing import Any

import numpy as np

from irtwin import resources
from irtwin.packing import Fragment, Packed
from irtwin.robot.description import Robot
from irtwin.robot.urdf import parse_urdf, read_urdf
from irtwin.virtual.performance import Performance

HOSTILE = "</script><script>window.hacked=1</script>&lt;<img src=x onerror=hacked=1>"


def kr6() -> Robot:
    return read_urdf(resources.folder("ontology") / "robots" / "kuka_kr6_r700.urdf")


def bare(first: str = "turn", kind: str = "revolute") -> Robot:
    """Two joints without any shape, the second one turned about x, and a fixed tip."""
    escaped = first.replace("&", "&amp;").replace("<", "&lt;").replace(">", "&gt;")
    limit = '<limit lower="-2" upper="2" velocity="3" effort="9"/>'
    return parse_urdf(
        f'<robot name="{escaped}"><link name="base"/><link name="upper"/><link name="fore"/><link name="tip"/>'
        f'<joint name="{escaped}" type="{kind}"><parent link="base"/><child link="upper"/>'
        f'<origin xyz="0 0 0.4"/><axis xyz="0 0 -1"/>{limit}</joint>'
        '<joint name="lift" type="revolute"><parent link="upper"/><child link="fore"/>'
        f'<origin xyz="0.2 0 0" rpy="1.2 0 0.3"/><axis xyz="0 0.6 0.8"/>{limit}</joint>'
        '<joint name="tip" type="fixed"><parent link="fore"/><child link="tip"/><origin xyz="0.1 0 0.3"/></joint>'
        "</robot>"
    )


def run(robot: Robot, seconds: float = 8.0, rate: float = 100.0, name: str = "sweep") -> Performance:
    time = 3.0 + np.arange(round(seconds * rate) + 1) / rate
    phase = np.outer(time - 3.0, 1 + 0.2 * np.arange(len(robot.joints)))
    power = 200 + 150 * np.sin(2 * time) ** 2
    energy = np.concatenate([[0.0], np.cumsum((power[1:] + power[:-1]) / 2 / rate)])
    return Performance(name, time, 0.9 * np.sin(phase), energy, power, 20.0 * np.cos(phase))


def unpack(packed: Packed) -> np.ndarray:
    levels = np.frombuffer(base64.b64decode(packed["data"]), dtype="<i2").astype(float)
    return np.where(levels == -32768, np.nan, packed["offset"] + packed["scale"] * levels)


def embedded(fragment: Fragment) -> dict[str, Any]:
    """Read the data that the fragment carries, signals decoded: q and torque (frames, n), energy, power (frames,)."""
    found = re.search(r'<script type="application/json">(.*?)</script>', fragment.html, re.DOTALL)
    data: dict[str, Any] = json.loads(found.group(1))
    for one in data["runs"]:
        one["energy"] = np.frombuffer(base64.b64decode(one["energy"]), dtype="<f4")
        one["power"] = unpack(one["power"])
        for name in ("q", "torque"):
            one[name] = None if one[name] is None else np.column_stack([unpack(column) for column in one[name]])
    return data

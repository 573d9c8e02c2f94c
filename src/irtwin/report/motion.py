"""The page of a motion that is to be carried out: the robot that performs it, its curves, and how near its limits."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import cycle
from pathlib import Path
from typing import Any

import numpy as np
from scipy.integrate import cumulative_trapezoid

from irtwin.effects.effect import force_unit
from irtwin.report.colours import PALETTE
from irtwin.report.page import report_page
from irtwin.report.traces import TIME, Figure, axis, plain, trace
from irtwin.report.wording import angle, angular_speed
from irtwin.resources import shipped
from irtwin.robot.description import Joint
from irtwin.signals.motion import Motion
from irtwin.storage.files import write
from irtwin.twin.twin import Twin
from irtwin.virtual.performance import Performance
from irtwin.virtual.scene import scene_html

_MOST_POINTS = 4000  # of a curve: more than a screen shows


def write_page(twin: Twin, motion: Motion, name: str, facts: Sequence[tuple[str, str]], out: Path) -> None:
    """Write a page that opens offline: the twin's robot performs a motion of n joints, with curves and limits.

    facts: what else is known of the motion, a heading and words each. Raises InputError where there is no place to
    write.
    """
    torque = twin.joint_torque(motion)
    power = twin.power(motion) if twin.knows_power else np.sum(torque * motion.dq, axis=1)
    energy = cumulative_trapezoid(power, motion.time, initial=0.0)
    scene = scene_html(twin.robot, [Performance(name, motion.time, motion.q, energy, power, torque)])
    page = report_page(
        shipped(),
        "motion",
        {},
        {},
        _figures(twin, motion, torque, power),
        fragment=scene,
        name=name,
        robot=twin.robot.name,
        seconds=float(motion.time[-1] - motion.time[0]),
        facts=list(facts),
        uses=[_use(*of) for of in zip(twin.robot.joints, motion.q.T, motion.dq.T, torque.T, strict=True)],
        electrical=twin.knows_power,
        bodies_alone=not twin.fitted,
        scene=scene.html,
    )
    write(out, page.encode())


def _use(joint: Joint, q: np.ndarray, dq: np.ndarray, torque: np.ndarray) -> dict[str, Any]:
    """Say in words what a motion asks of a joint, with its torque (N m or N), and which share of its limits, if any."""
    speed, most = float(np.abs(dq).max()), float(np.abs(torque).max())
    return {
        "joint": joint.name,
        "range": f"{angle(float(q.min()), joint.kind)} … {angle(float(q.max()), joint.kind)}",
        "limits": f"{angle(joint.lower, joint.kind)} … {angle(joint.upper, joint.kind)}",
        "speed": angular_speed(speed, joint.kind),
        "speed_share": _share(speed, joint.velocity),
        "torque": most,
        "torque_share": _share(most, joint.effort),
        "unit": force_unit(joint),
    }


def _share(most: float, limit: float) -> float | None:
    return most / limit if 0 < limit < np.inf else None


def _figures(twin: Twin, motion: Motion, torque: np.ndarray, power: np.ndarray) -> dict[str, Figure]:
    drawn = {"position": motion.q, "speed": motion.dq, "acceleration": motion.ddq}
    units = {"position": ("°", "mm"), "speed": ("°/s", "mm/s"), "acceleration": ("°/s²", "mm/s²")}
    scales = [1000.0 if joint.kind == "prismatic" else math.degrees(1.0) for joint in twin.robot.joints]
    figures = {
        name: _curves(twin.robot.joints, motion.time, values * scales, name, units[name])
        for name, values in drawn.items()
    }
    line = trace("power", _short(motion.time), _short(power), "W", line={"color": PALETTE[0], "width": 2})
    return figures | {
        "torque": _curves(twin.robot.joints, motion.time, torque, "torque", ("N m", "N")),
        "power": {"data": [line], "layout": {"xaxis": TIME, "yaxis": axis("power", "W")}},
    }


def _curves(
    joints: Sequence[Joint], time: np.ndarray, values: np.ndarray, quantity: str, units: tuple[str, str]
) -> Figure:
    """Draw a line for each joint; units: of a joint that turns, and of one that slides."""
    own = [units[joint.kind == "prismatic"] for joint in joints]
    data = [
        trace(plain(joint.name), _short(time), _short(column), unit, line={"color": colour, "width": 2})
        for colour, joint, column, unit in zip(cycle(PALETTE), joints, values.T, own, strict=False)
    ]
    title = f"{quantity}, {' or '.join(dict.fromkeys(own))}"
    return {"data": data, "layout": {"xaxis": TIME, "yaxis": {"title": {"text": title}}}}


def _short(values: np.ndarray) -> list[float]:
    return [float(f"{value:.5g}") for value in values[:: 1 + len(values) // _MOST_POINTS]]

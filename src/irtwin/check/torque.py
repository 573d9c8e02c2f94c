"""Does each torque act in the direction of its joint? Gravity, inertia and friction decide.

Gravity and inertia of the URDF need not be right in size to say in which direction they act, and friction takes energy
from the motion. A torque whose signs of both are reversed has the wrong sign; one whose friction drives the joint while
its gravity is right is no torque of the joint.
"""

from __future__ import annotations

import numpy as np

from irtwin.check.moving import Moving
from irtwin.check.rigid_body import Rows, friction, rows_of
from irtwin.check.robust_fit import Fit, fit
from irtwin.robot.description import Robot
from irtwin.signals.channels import CHANNELS
from irtwin.signals.finding import Finding

_ROWS = 1500  # over all runs
_FEWEST = 300  # samples; fewer, and regressors of chance explain everything
_SURE = 4.0  # standard deviations
_LIKELY = 2.0
_LATE, _LATEST = 0.008, 0.1  # s of a delay
_SURE_DELAY = 10.0  # standard deviations: friction near a reversal looks like a delay, too
_SCALED = 1.6  # times the other joints' gain, or its inverse
_SURE_SCALE = 10.0  # standard deviations of a gain
_OTHERS = 3  # gains that tell the usual one
_EXPLAINED = 0.4  # of a torque's variance by its own joint's motion, without which a sign means nothing


def torque_findings(robot: Robot, moving: Moving) -> list[Finding]:
    """Return the torque channels that are reversed, or no torque of their joint."""
    rows = rows_of(robot, moving, _ROWS)
    if rows is None or len(rows.q) < _FEWEST:
        return []
    nominal = rows.nominal()
    joints = np.flatnonzero(moving.joints).tolist()
    found = [_direction(robot, moving, rows, nominal, joint) or _delay(robot, moving, rows, joint) for joint in joints]
    return [finding for finding in found if finding is not None] or _scales(robot, moving, rows, nominal)


def _direction(robot: Robot, moving: Moving, rows: Rows, nominal: np.ndarray, joint: int) -> Finding | None:
    """Return what is wrong with the direction of a joint's torque."""
    torque, speed = rows.torque[:, joint], rows.dq[:, joint]
    if np.ptp(torque) == 0:
        return None
    losses = friction(speed)
    columns = np.column_stack([nominal[:, joint], rows.ddq[:, joint], losses])
    found = fit(columns, torque)
    residual = torque - columns @ found.coefficients
    if np.var(residual) > (1 - _EXPLAINED) * np.var(torque):
        return None
    body = found.t(np.eye(5)[0])
    dry, viscous = (losses[:, :2] * speed[:, None]).mean(axis=0)  # what they take from the motion
    lost = found.t(np.array([0.0, 0.0, dry, viscous, 0.0]))
    evidence = {"gravity_t": round(body, 1), "friction_t": round(lost, 1)}
    name = CHANNELS["torque"].column(robot.joints[joint].name)
    drives = _drives(found, dry, viscous) or (lost < -_SURE and body > _SURE)
    if not drives and ((lost < -_SURE and body < _LIKELY) or (body < -_SURE and lost < _LIKELY)):
        return _wrong_sign(robot, moving, joint, evidence, _reversed(body, lost))
    if drives:
        return Finding(
            "not_joint_torque", name, moving.names, certain=False, mended=False, evidence=evidence,
            say=f"{name} is not the torque of its joint alone: gravity and inertia have the right direction in it, but "
            "friction would drive the joint; log the torque on the joint side, or leave the column out",
        )  # fmt: skip
    return None


def _drives(found: Fit, dry: float, viscous: float) -> bool:
    """Return whether friction takes energy by one of its parts and gives more by the other, as no friction does."""
    parts = np.array([[0.0, 0.0, dry, 0.0, 0.0], [0.0, 0.0, 0.0, viscous, 0.0]])
    t_dry, t_viscous = (found.t(part) for part in parts)
    power = np.abs(parts @ found.coefficients)
    return min(abs(t_dry), abs(t_viscous)) > _SURE and t_dry * t_viscous < 0 and bool(power[1] > power[0])


def _wrong_sign(robot: Robot, moving: Moving, joint: int, evidence: dict[str, float], why: str) -> Finding:
    name = CHANNELS["torque"].column(robot.joints[joint].name)
    return Finding(
        "sign", name, moving.names, certain=True, mended=True, evidence=evidence,
        say=f"{name} has the wrong sign: {why}; its sign is changed here, change it in the log",
    )  # fmt: skip


def _reversed(body: float, lost: float) -> str:
    reasons = (
        ("friction would drive the joint", lost < -_LIKELY),
        ("gravity and inertia act in the other direction", body < -_LIKELY),
    )
    return " and ".join(reason for reason, holds in reasons if holds)


def _delay(robot: Robot, moving: Moving, rows: Rows, joint: int) -> Finding | None:
    """Return the finding where a torque comes late: by a short delay d, it lacks d times its own rate."""
    torque, basis = rows.torque[:, joint], rows.explained(joint)
    explained = basis @ (basis.T @ torque)
    steps = np.diff(rows.time, append=rows.time[-1])
    rate = np.where(steps > 0, np.diff(explained, append=explained[-1]) / np.where(steps > 0, steps, 1.0), 0.0)
    found = fit(np.column_stack([basis, rate]), torque)
    late = float(-found.coefficients[-1])
    if not _LATE < late < _LATEST or found.t(np.eye(len(found.coefficients))[-1]) > -_SURE_DELAY:
        return None
    name = CHANNELS["torque"].column(robot.joints[joint].name)
    say = f"{name} comes about {1000 * late:.2g} ms after the motion that it explains; log both at one time"
    return Finding("delay", name, moving.names, False, False, {"delay_ms": round(1000 * late, 1)}, say)


def _scales(robot: Robot, moving: Moving, rows: Rows, nominal: np.ndarray) -> list[Finding]:
    """Return torques whose gravity and inertia are of another size, against the URDF's, than those of the others."""
    gains = {}
    for joint in np.flatnonzero(moving.joints).tolist():
        columns = [nominal[:, joint], rows.ddq[:, joint], friction(rows.dq[:, joint])]
        found = fit(np.column_stack(columns), rows.torque[:, joint])
        if found.t(np.eye(5)[0]) > _SURE_SCALE:
            gains[joint] = float(found.coefficients[0])
    usual = float(np.median(list(gains.values()))) if len(gains) >= _OTHERS else 0.0
    return [
        _scale(CHANNELS["torque"].column(robot.joints[joint].name), gain / usual, moving)
        for joint, gain in gains.items()
        if usual > 0 and not 1 / _SCALED < gain / usual < _SCALED
    ]


def _scale(name: str, ratio: float, moving: Moving) -> Finding:
    say = f"{name} is {ratio:.2g} times as large, by the URDF's bodies, as the torques of other joints; check its gain"
    evidence = {"ratio": round(ratio, 2)}
    return Finding("scale", name, moving.names, certain=False, mended=False, evidence=evidence, say=say)

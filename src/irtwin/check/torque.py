"""Does each torque act in the direction of its joint? Gravity, inertia and friction decide.

Gravity and inertia of the URDF need not be right in size to say in which direction they act, and friction takes energy
from the motion. A torque whose signs of both are reversed has the wrong sign; one whose friction drives the joint while
its gravity is right is no torque of the joint.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from irtwin.check.arrangement import says_position
from irtwin.check.moving import Moving
from irtwin.check.rigid_body import MANY_ROWS, RigidBodyRows, friction, rows_of
from irtwin.check.robust_fit import RobustFit, fit
from irtwin.robot.description import Robot
from irtwin.signals.channels import CHANNELS
from irtwin.signals.finding import LogFinding

_SEVERAL = 2  # joints, from which torques without sign are no chance of their loads
_SURE = 4.0  # standard deviations
_LIKELY = 2.0
_SCALED = 1.6  # times the other joints' gain, or its inverse
_SURE_SCALE = 10.0  # standard deviations of a gain
_OTHERS = 3  # gains that tell the usual one
_EXPLAINED = 0.4  # of a torque's variance by its own joint's motion, without which a sign means nothing


def torque_findings(robot: Robot, moving: Moving) -> list[LogFinding]:
    """Return the torque channels that are reversed, or no torque of their joint."""
    rows = rows_of(robot, moving, MANY_ROWS)
    if rows is None:
        return []
    nominal = rows.nominal()
    joints = np.flatnonzero(moving.joints).tolist()
    told = {joint: answer for joint in joints if (answer := _told(rows, nominal, joint)) is not None}
    findings = [direction for joint in told if (direction := _direction(robot, moving, joint, told[joint])) is not None]
    reversed_ = [finding for finding in findings if finding.fault == "sign" and finding.mended]
    right = any(max(each.body, each.lost) > _LIKELY for each in told.values())
    still = [CHANNELS["torque"].column(robot.joints[joint].name) for joint in joints if joint not in told]
    if len(reversed_) < _SEVERAL or right or not still:
        return findings
    say = (
        f"{reversed_[-1].say}; that of {', '.join(still)} this motion does not tell: change it too if all are reversed"
    )
    return [replace(finding, say=say) if finding is reversed_[-1] else finding for finding in findings]


def unsigned_findings(robot: Robot, moving: Moving) -> list[LogFinding]:
    """Return that torque has no sign, where no joint of several has any below zero though all move both ways."""
    torques = [run.signals.torque for run in moving.runs if run.signals.torque is not None]
    if len(torques) < len(moving.runs) or moving.joints.sum() < _SEVERAL:
        return []
    own = [torque[:, moving.joints] for torque in torques]
    size = all((of_run >= 0).all() and (np.ptp(of_run, axis=0) > 0).all() for of_run in own)
    q = [np.diff(run.signals.q[:, moving.joints], axis=0) for run in moving.runs]
    both_ways = np.any([(of_run > 0).any(axis=0) & (of_run < 0).any(axis=0) for of_run in q], axis=0).all()
    if not size or not both_ways:
        return []
    say = (
        "tau_JOINT has no sign: it is never below zero, though each joint moves both ways; log it with its sign, "
        "or leave it out: commands (cmd_JOINT) can be held against a simulator's model without it"
    )
    name = CHANNELS["torque"].column(robot.joints[int(np.flatnonzero(moving.joints)[0])].name)
    return [LogFinding("unsigned", name, moving.names, certain=True, mended=False, evidence={}, say=say)]


def scale_findings(robot: Robot, moving: Moving) -> list[LogFinding]:
    """Return torques whose gravity and inertia are of another size, against the URDF's, than those of the others."""
    rows = rows_of(robot, moving, MANY_ROWS)
    if rows is None:
        return []
    nominal, gains = rows.nominal(), dict[int, float]()
    for joint in np.flatnonzero(moving.joints).tolist():
        columns = [nominal[:, joint], rows.ddq[:, joint], friction(rows.dq[:, joint])]
        scale_fit = fit(np.column_stack(columns), rows.torque[:, joint])
        if scale_fit.t(np.eye(5)[0]) > _SURE_SCALE:
            gains[joint] = float(scale_fit.coefficients[0])
    usual = float(np.median(list(gains.values()))) if len(gains) >= _OTHERS else 0.0
    return [
        _scale(CHANNELS["torque"].column(robot.joints[joint].name), gain / usual, moving)
        for joint, gain in gains.items()
        if usual > 0 and not 1 / _SCALED < gain / usual < _SCALED
    ]


@dataclass(frozen=True)
class _Direction:
    """How many standard deviations gravity and inertia of the URDF, and what friction takes, are above zero."""

    body: float
    lost: float
    drives: bool  # friction drives the joint by one of its parts


def _told(rows: RigidBodyRows, nominal: np.ndarray, joint: int) -> _Direction | None:
    """Return what a joint's torque says of its direction; None where its own motion explains too little of it."""
    torque, speed = rows.torque[:, joint], rows.dq[:, joint]
    if np.ptp(torque) == 0:
        return None
    losses = friction(speed)
    columns = np.column_stack([nominal[:, joint], rows.ddq[:, joint], losses])
    friction_fit = fit(columns, torque)
    residual = torque - columns @ friction_fit.coefficients
    if np.var(residual) > (1 - _EXPLAINED) * np.var(torque):
        return None
    body = friction_fit.t(np.eye(5)[0])
    dry, viscous = (losses[:, :2] * speed[:, None]).mean(axis=0)  # what they take from the motion
    lost = friction_fit.t(np.array([0.0, 0.0, dry, viscous, 0.0]))
    return _Direction(body, lost, _drives(friction_fit, dry, viscous) or (lost < -_SURE and body > _SURE))


def _direction(robot: Robot, moving: Moving, joint: int, told: _Direction) -> LogFinding | None:
    """Return what is wrong with the direction of a joint's torque."""
    body, lost = told.body, told.lost
    evidence = {"gravity_t": round(body, 1), "friction_t": round(lost, 1)}
    name = CHANNELS["torque"].column(robot.joints[joint].name)
    if not told.drives and ((lost < -_SURE and body < _LIKELY) or (body < -_SURE and lost < _LIKELY)):
        return _wrong_sign(robot, moving, joint, evidence, _reversed(body, lost))
    if told.drives:
        return LogFinding(
            "not_joint_torque", name, moving.names, certain=False, mended=False, evidence=evidence,
            say=f"{name} is not the torque of its joint alone: gravity and inertia have the right direction in it, but "
            "friction would drive the joint; log the torque on the joint side, or leave the column out",
        )  # fmt: skip
    return None


def _drives(friction_fit: RobustFit, dry: float, viscous: float) -> bool:
    """Return whether friction takes energy by one of its parts and gives more by the other, as no friction does."""
    parts = np.array([[0.0, 0.0, dry, 0.0, 0.0], [0.0, 0.0, 0.0, viscous, 0.0]])
    t_dry, t_viscous = (friction_fit.t(part) for part in parts)
    power = np.abs(parts @ friction_fit.coefficients)
    return min(abs(t_dry), abs(t_viscous)) > _SURE and t_dry * t_viscous < 0 and bool(power[1] > power[0])


def _wrong_sign(robot: Robot, moving: Moving, joint: int, evidence: dict[str, float], why: str) -> LogFinding:
    """Return the finding, of the position where that explains the torques of the other joints as well."""
    names = {field: CHANNELS[field].column(robot.joints[joint].name) for field in ("torque", "q")}
    position = says_position(robot, moving, joint)
    evidence = {**evidence, "position_t": round(position, 1)}
    if position > _SURE:
        return LogFinding(
            "sign", names["q"], moving.names, certain=True, mended=False, evidence=evidence,
            say=f"{names['q']} has the wrong sign: {why}, and the torques of other joints fit the motion reversed; "
            "change it, and that of the speed",
        )  # fmt: skip
    alternative = f" (or {names['q']}: the torques cannot tell which)" if position > -_LIKELY else ""
    return LogFinding(
        "sign", names["torque"], moving.names, certain=True, mended=True, evidence=evidence,
        say=f"{names['torque']} has the wrong sign{alternative}: {why}; its sign is changed here, change it in the log",
    )  # fmt: skip


def _reversed(body: float, lost: float) -> str:
    reasons = (
        ("friction would drive the joint", lost < -_LIKELY),
        ("gravity and inertia act in the other direction", body < -_LIKELY),
    )
    return " and ".join(reason for reason, holds in reasons if holds)


def _scale(name: str, ratio: float, moving: Moving) -> LogFinding:
    say = f"{name} is {ratio:.2g} times as large, by the URDF's bodies, as the torques of other joints; check its gain"
    evidence = {"ratio": round(ratio, 2)}
    return LogFinding("scale", name, moving.names, certain=False, mended=False, evidence=evidence, say=say)

"""How late a torque is, what its scale is, and where a position's zero is: estimated beside bodies and friction.

Each is a number of one channel that the data give with its deviation. It is said where it is large and sure; where the
motions do not show it, it is not sure, and nothing is said. The thresholds' origin: docs/decisions/log-format.md.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from irtwin.check.moving import Moving
from irtwin.check.rigid_body import MANY_ROWS, MOST_JOINTS, RigidBodyRows, rows_of, tilted
from irtwin.check.torque import scale_findings
from irtwin.check.whole_body import Fitted, WholeBody
from irtwin.robot.description import Robot
from irtwin.signals.channels import CHANNELS
from irtwin.signals.finding import LogFinding

_SURE = 4.0  # standard deviations of a number from none
_BEYOND = 2.0  # standard deviations by which a number exceeds what is tolerated
_LATE, _LATEST = 0.008, 0.1  # s of a delay; drives filter their currents by a few ms
_CLEAR = 0.01  # s: deviation below which a joint tells how late friction looks
_EXACT = 1e-5  # s; no deviation is less
_ALIKE = 0.003  # s by which that differs between joints at least
_STEP = 0.005  # s over which the rate of a torque is taken
_SCALED = 1.6  # times, or its inverse; torque constants are nominal, friction grows with load
_TELLS = 0.2  # of a scale: deviation below which a joint tells what is usual
_OTHERS = 3  # joints, beside the one that differs, that tell what is usual
_MAJORITY = 2  # of a scale, where they agree
_AGREE = 1.2  # times: scales that agree differ by less
_TURNS = 4  # of a scale far from one
_ZERO = 0.03  # rad; links and gears give way by as much
_SHOWN = 0.015  # rad: half of it; a deviation beyond means that the motions do not show where the zero is
_NEARER = 2  # looks at a delay, or at a zero that seems to be off
_TURN = 1e-3  # rad over which a torque's change with a position is taken


def estimate_findings(robot: Robot, moving: Moving) -> list[LogFinding]:
    """Return torques that are late or of another scale than the others', and positions whose zero is off."""
    rows = rows_of(robot, moving, MANY_ROWS)
    if rows is None or len(robot.joint_names) > MOST_JOINTS:
        return []
    fitted = _fit(rows)
    return _scales(robot, moving, fitted) or _delays(robot, moving, rows, fitted) or _zeros(robot, moving, rows, fitted)


def _delays(robot: Robot, moving: Moving, rows: RigidBodyRows, fitted: Fitted) -> list[LogFinding]:
    after, before = (rows_of(robot, moving, MANY_ROWS, later) for later in (_STEP, -_STEP))
    if after is None or before is None:
        return []
    slopes = (after.columns() - before.columns()) / (2 * _STEP)
    rates = fitted.parts(slopes)
    joints = np.flatnonzero(moving.joints).tolist()
    late = {joint: _lateness(fitted, rates, joint) for joint in joints}
    names = CHANNELS["torque"].columns(robot.joint_names)
    delays = []
    for joint in joints:
        others = [late[other].friction for other in joints if other != joint]
        number, deviation = late[joint].beside(others)
        if number < _STEP or number < _BEYOND * deviation:
            continue
        for _ in range(_NEARER):  # a rate tells small delays alone
            earlier = fitted.body.fit(_earlier(robot, moving, rows, joint, number))
            more, deviation = _lateness(earlier, earlier.parts(slopes), joint).beside(others)
            number += more
            if not 0 < number < _LATEST:
                break
        if _LATE < number < _LATEST and _beyond(number, deviation, _LATE):
            delays.append(_delay(names[joint], number, deviation, moving))
    return delays


@dataclass(frozen=True)
class Lateness:
    """By how much (s) what bodies do, and what friction does, comes late in a torque, each with its deviation."""

    bodies: tuple[float, float]
    friction: tuple[float, float]

    def beside(self, others: list[tuple[float, float]]) -> tuple[float, float]:
        """Return the delay of the torque and its deviation.

        Near a reversal friction looks late by itself; by how much, that of the other joints tells.
        """
        clear = [late for late, deviation in others if deviation < _CLEAR]
        if len(clear) < _OTHERS:
            return self.bodies
        spread = max(float(np.std(clear, ddof=1)), _ALIKE)
        known = [self.bodies, (self.friction[0] - float(np.median(clear)), float(np.hypot(self.friction[1], spread)))]
        weights = np.array([max(deviation, _EXACT) ** -2 for _, deviation in known])
        if not weights.any():
            return 0.0, np.inf
        return float(weights @ [late for late, _ in known] / weights.sum()), float(weights.sum() ** -0.5)


def _earlier(robot: Robot, moving: Moving, rows: RigidBodyRows, joint: int, by: float) -> np.ndarray:
    """Return the torques (N, n), that of the joint as it is logged so much later."""
    later = rows_of(robot, moving, MANY_ROWS, of_torque=by)
    return rows.torque if later is None else np.where(np.arange(len(robot.joints)) == joint, later.torque, rows.torque)


def _lateness(fitted: Fitted, rates: tuple[np.ndarray, np.ndarray], joint: int) -> Lateness:
    body, rubbed = (_only(-rate, joint) for rate in rates)
    return Lateness(fitted.estimate(body, (rubbed,)), fitted.estimate(rubbed, (body,)))


def _delay(name: str, late: float, deviation: float, moving: Moving) -> LogFinding:
    evidence = {"delay_ms": round(1000 * late, 1), "deviation_ms": round(1000 * deviation, 1)}
    say = (
        f"{name} comes about {1000 * late:.2g} ms (± {1000 * deviation:.2g}) after the motion that it explains, beyond "
        "what friction does; log both at one time"
    )
    return LogFinding("delay", name, moving.names, False, False, evidence, say)


def _scales(robot: Robot, moving: Moving, fitted: Fitted) -> list[LogFinding]:
    joints = np.flatnonzero(moving.joints).tolist()
    scales = {joint: _scale(fitted, joint) for joint in joints}
    names = CHANNELS["torque"].columns(robot.joint_names)
    telling = {joint for joint, (_, deviation) in scales.items() if deviation < _TELLS}
    differing = [
        (_rescaled(fitted, joint, np.exp(log)).left, joint)
        for joint, (log, deviation) in scales.items()
        if len(telling - {joint}) >= _MAJORITY and _beyond(abs(log), deviation, np.log(_SCALED))
    ]
    _, joint = min(differing, default=(0.0, -1))  # of one that differs, others seem to differ as well
    alike = _rescaled(fitted, joint, np.exp(scales[joint][0])) if differing else fitted
    if not differing or not _agree(alike, telling - {joint}) or fitted.held_out().t(alike.held_out()) < _SURE:
        open_to_it = {names[joint] for joint in telling if abs(scales[joint][0]) > np.log(_SCALED) + scales[joint][1]}
        return [finding for finding in scale_findings(robot, moving) if finding.channel in open_to_it]
    log, deviation = scales[joint]
    evidence = {"ratio": round(float(np.exp(log)), 3), "deviation": round(float(np.exp(log)) * deviation, 3)}
    say = (
        f"{names[joint]} is {np.exp(log):.2g} times (± {deviation:.0%}) as large as the bodies that it carries are by "
        "the torques of other joints; check its unit, torque constant and gear ratio"
    )
    return [LogFinding("scale", names[joint], moving.names, False, False, evidence, say)]


def _agree(fitted: Fitted, telling: set[int]) -> bool:
    """Return whether joints that tell what scale is usual say the same; of three or more, most do."""
    return len(telling) >= _OTHERS or all(abs(_scale(fitted, joint)[0]) < np.log(_AGREE) for joint in telling)


def _scale(fitted: Fitted, joint: int) -> tuple[float, float]:
    """Return the logarithm of a torque's scale beside the others' and its deviation, infinite where vague."""
    scale = 1.0
    for _ in range(_TURNS):
        now = fitted if scale == 1.0 else _rescaled(fitted, joint, scale)
        more, deviation = now.estimate(_only(now.explained, joint))
        if not np.isfinite(deviation) or more <= -1 or deviation > 1:
            return 0.0, np.inf
        scale *= 1 + more
        if abs(more) < 0.1:
            break
    return float(np.log(scale)), deviation


def _rescaled(fitted: Fitted, joint: int, scale: float) -> Fitted:
    return fitted.body.fit(fitted.torque / np.where(np.arange(fitted.torque.shape[1]) == joint, scale, 1.0))


def _zeros(robot: Robot, moving: Moving, rows: RigidBodyRows, fitted: Fitted) -> list[LogFinding]:
    """Return the position whose zero is off; what a tilted base or a spring at the joint does is no such thing."""
    tilts = _tilts(rows, fitted)
    zeros = []
    for joint in np.flatnonzero(moving.joints).tolist():
        if robot.joints[joint].kind == "prismatic":
            continue
        off, deviation = _zero(rows, fitted, tilts, joint)
        if abs(off) < _SURE * deviation:
            continue
        for _ in range(_NEARER):
            turned = _turned(rows, joint, -off)
            again = _fit(turned)
            more, deviation = _zero(turned, again, _tilts(turned, again), joint)
            off += more
        if deviation < _SHOWN and _beyond(abs(off), deviation, _ZERO):
            zeros.append((_fit(_turned(rows, joint, -off)).left, joint, off, deviation))
    if not zeros:
        return []
    _, joint, off, deviation = min(zeros)  # of one that is off, others seem to be off as well
    if fitted.held_out().t(_fit(_turned(rows, joint, -off)).held_out()) < _SURE:
        return []
    name = CHANNELS["q"].column(robot.joints[joint].name)
    evidence = {"offset_rad": round(off, 4), "deviation_rad": round(deviation, 4)}
    say = (
        f"{name} reads about {off:+.3f} rad (± {deviation:.2g}) beside where gravity and inertia put the joint; "
        "compare its zero with the URDF's"
    )
    return [LogFinding("zero_offset", name, moving.names, False, False, evidence, say)]


def _zero(rows: RigidBodyRows, fitted: Fitted, tilts: tuple[np.ndarray, ...], joint: int) -> tuple[float, float]:
    """Return by how much (rad) a position reads too much, and its deviation."""
    shapes = (rows.q, np.cos(rows.q), np.sin(rows.q))  # of a hose, of a balancer
    springs = tuple(_only(shape - shape.mean(axis=0), joint) for shape in shapes)
    return fitted.estimate(-_change(_turned(rows, joint, _TURN), fitted), (*tilts, *springs))


def _tilts(rows: RigidBodyRows, fitted: Fitted) -> tuple[np.ndarray, ...]:
    """Return how the torques change as the base tilts about x and y."""
    return tuple(
        _change(replace(rows, model=tilted(rows.model, by)), fitted) for by in ((_TURN, 0.0, 0.0), (0.0, _TURN, 0.0))
    )


def _change(turned: RigidBodyRows, fitted: Fitted) -> np.ndarray:
    """Return the rate at which what bodies do changes as something turns by 1 mrad, N m/rad (N, n)."""
    return np.asarray((fitted.parts(turned.columns())[0] - fitted.of_bodies) / _TURN)


def _fit(rows: RigidBodyRows) -> Fitted:
    return WholeBody.of(rows).fit(rows.torque)


def _turned(rows: RigidBodyRows, joint: int, by: float) -> RigidBodyRows:
    return replace(rows, q=rows.q + _only(np.full_like(rows.q, by), joint))


def _only(torque: np.ndarray, joint: int) -> np.ndarray:
    """Return a torque (N, n) at one joint alone."""
    return np.where(np.arange(torque.shape[1]) == joint, torque, 0.0)


def _beyond(number: float, deviation: float, tolerated: float) -> bool:
    return number > _SURE * deviation and number > tolerated + _BEYOND * deviation

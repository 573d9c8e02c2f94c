"""Do positions and torques stand in the columns of their joints, with the right sign and scale, and of this robot?

A reversed, exchanged or wrongly geared position, a reversed or exchanged torque, or the description of another robot,
spoils what one set of bodies explains of all torques, whatever the bodies' parameters are. Each such fault is undone in
turn; the one without which torques that were held out are far better predicted is there. Of another robot an axis that
is turned tells: the own robot's bodies are explained no better by any.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import dataclass, replace
from itertools import combinations, starmap

import numpy as np
import pinocchio as pin
import scipy

from irtwin.check.moving import Moving
from irtwin.check.rigid_body import FEW_ROWS, MOST_JOINTS, RigidBodyRows, rows_of, turned_axes
from irtwin.check.whole_body import Fitted, WholeBody
from irtwin.robot.description import Robot
from irtwin.signals.channels import CHANNELS
from irtwin.signals.finding import LogFinding

_GAIN = 2.0  # in the product of all residuals that undoing a fault has to bring
_SURE = 4.0  # standard deviations between stretches of time, of 20: one in 50 faults tried in 2,500 healthy logs
_ALIKE = 2.0  # standard deviations: a rival that is no further behind explains the torques as well
_FACTORS = (2.0, 0.5)
_FITTED = 0.8  # of a torque's deviation: an exchange must leave less at each joint
_ALL_PAIRS = 8  # joints; of more, neighbours alone

_SAID = {
    "sign": "has the wrong sign",
    "swap": "stand in each other's columns",
    "order": "stand in each other's columns",
}
_CURE = {
    ("sign", "q"): "change it, and that of the speed, or give the URDF of the robot that was logged",
    ("sign", "tau"): "its sign is changed here, change it in the log",
    ("scale", "q"): "correct the gear ratio that was assumed",
}


@dataclass(frozen=True, eq=False)
class _Fault:
    """A fault undone: factors (n,) of a field's columns, and in which of them those of each joint stand, (n,)."""

    fault: str
    field: str
    joints: tuple[int, ...]
    factors: np.ndarray
    order: np.ndarray

    def cured(self, rows: RigidBodyRows) -> RigidBodyRows:
        if self.field == "torque":
            return replace(rows, torque=self._undone(rows.torque))
        q, dq, ddq = map(self._undone, (rows.q, rows.dq, rows.ddq))
        return replace(rows, q=q, dq=dq, ddq=ddq)

    def _undone(self, values: np.ndarray) -> np.ndarray:
        return np.asarray((values * self.factors)[:, self.order])

    def columns(self, robot: Robot) -> str:
        names = CHANNELS[self.field].columns(robot.joint_names)
        return " <-> ".join(names[joint] for joint in self.joints)

    def mirrors(self, other: _Fault) -> bool:
        """Whether the other is the same fault of the same joints, of the other field."""
        return (self.fault, self.joints) == (other.fault, other.joints) and self.field != other.field


@dataclass(frozen=True, eq=False)
class _Axis:
    """The description of another robot: an axis of it, turned."""

    joint: int
    model: pin.Model

    def cured(self, rows: RigidBodyRows) -> RigidBodyRows:
        return replace(rows, model=self.model)


def arrangement_findings(robot: Robot, moving: Moving, reversed_torques: Collection[str] = ()) -> list[LogFinding]:
    """Return the clearest such fault alone: others are seen once it is cured.

    `reversed_torques`: columns that are known to have the wrong sign.
    """
    rows = _rows(robot, moving, reversed_torques)
    if rows is None:
        return []
    body = WholeBody.of(rows)
    fitted = body.fit(rows.torque)
    faults: list[_Fault | _Axis] = [*_faults(rows, moving.joints), *starmap(_Axis, turned_axes(rows.model))]
    left = {fault: _cured(rows, body, fault).left for fault in faults}
    fault = min(left, key=lambda candidate: left[candidate])
    if fitted.left < left[fault]:
        return []
    own, held = fitted.held_out(), _cured(rows, body, fault).held_out()
    if own.gain(held) < np.log(_GAIN) or own.t(held) < _SURE:
        return []
    if isinstance(fault, _Axis):
        return [_of_another_robot(fault, own.gain(held), own.t(held), robot, moving)]
    if fault.field == "torque" and fault.fault == "scale":
        return []  # is found where its size is estimated
    mirrors = [candidate for candidate in left if isinstance(candidate, _Fault) and candidate.mirrors(fault)]
    rivals = [mirror for mirror in mirrors if _cured(rows, body, mirror).held_out().t(held) < _ALIKE]
    return [_finding(fault, rivals, own.gain(held), own.t(held), robot, moving)]


def says_position(robot: Robot, moving: Moving, joint: int) -> float:
    """Return by how many standard deviations a reversed position explains the torques better than a reversed torque."""
    rows = _rows(robot, moving, ())
    if rows is None:
        return 0.0
    body, sign = WholeBody.of(rows), np.where(np.arange(len(robot.joints)) == joint, -1.0, 1.0)
    own = np.arange(len(robot.joints))
    of_torque, of_position = (
        _cured(rows, body, _Fault("sign", field, (joint,), sign, own)).held_out() for field in ("torque", "q")
    )
    return of_torque.t(of_position)


def _rows(robot: Robot, moving: Moving, reversed_torques: Collection[str]) -> RigidBodyRows | None:
    """Return the rows that show such a fault; None where there are too few."""
    rows = rows_of(robot, moving, FEW_ROWS) if len(robot.joint_names) <= MOST_JOINTS else None
    if rows is None:
        return None
    names = CHANNELS["torque"].columns(robot.joint_names)
    return replace(rows, torque=rows.torque * np.where([name in reversed_torques for name in names], -1.0, 1.0))


def _cured(rows: RigidBodyRows, body: WholeBody, fault: _Fault | _Axis) -> Fitted:
    """Return the cured torques of rows, whose motion `body` is of, as bodies and friction explain them."""
    cured = fault.cured(rows)
    unmoved = cured.q is rows.q and cured.model is rows.model
    return (body if unmoved else WholeBody.of(cured)).fit(cured.torque)


def _of_another_robot(axis: _Axis, gain: float, t: float, robot: Robot, moving: Moving) -> LogFinding:
    ratio, name = float(np.exp(gain)), robot.joints[axis.joint].name
    return LogFinding(
        "other_robot", "robot.urdf", moving.names, certain=True, mended=False,
        evidence={"residual_ratio": ratio, "t": round(t, 1)},
        say=f"robot.urdf is not of the robot that was logged: were the axis of {name} turned by 90 degrees, one set of "
        f"bodies would explain all torques {ratio:.3g} times better; give the description of that robot, or correct "
        "the axis",
    )  # fmt: skip


def _finding(fault: _Fault, rivals: list[_Fault], gain: float, t: float, robot: Robot, moving: Moving) -> LogFinding:
    ratio, named = float(np.exp(gain)), fault.columns(robot)
    prefix = CHANNELS[fault.field].prefix
    mended = fault.fault == "sign" and fault.field == "torque"
    problem = _SAID.get(fault.fault) or f"is {1 / fault.factors[fault.joints[0]]:g} times what the joint turns"
    cure = _CURE.get((fault.fault, prefix), "name them by their joints")
    alternative = f" (or {rivals[0].columns(robot)}: the torques cannot tell which)" if rivals else ""
    return LogFinding(
        fault.fault, named, moving.names, certain=True, mended=mended,
        evidence={"residual_ratio": ratio, "t": round(t, 1)},
        say=f"{named} {problem}{alternative}: without that, one set of bodies explains all torques {ratio:.3g} times "
        f"better; {cure}",
    )  # fmt: skip


def _faults(rows: RigidBodyRows, joints: np.ndarray) -> Iterator[_Fault]:
    for field in ("torque", "q"):
        yield from _singles(field, joints)
        yield from _pairs(field, joints)
    if (order := _assigned(rows, joints)) is not None:
        moved = tuple(np.flatnonzero(order != np.arange(len(order))).tolist())
        if len(moved) > 2:
            yield _Fault("order", "torque", moved, np.ones(len(order)), order)


def _singles(field: str, joints: np.ndarray) -> Iterator[_Fault]:
    own = np.arange(len(joints))
    for joint in np.flatnonzero(joints).tolist():
        for factor in (-1.0, *_FACTORS):
            kind = "sign" if factor < 0 else "scale"
            yield _Fault(kind, field, (joint,), np.where(own == joint, factor, 1.0), own)


def _pairs(field: str, joints: np.ndarray) -> Iterator[_Fault]:
    for a, b in combinations(np.flatnonzero(joints).tolist(), 2):
        if len(joints) <= _ALL_PAIRS or b == a + 1:
            order = np.arange(len(joints))
            order[[a, b]] = b, a
            yield _Fault("swap", field, (a, b), np.ones(len(joints)), order)


def _assigned(rows: RigidBodyRows, joints: np.ndarray) -> np.ndarray | None:
    """Return in which column each joint's torque stands, by what its motion alone explains; None where vague."""
    shares = np.log(rows.unexplained(joints))
    own, order = scipy.optimize.linear_sum_assignment(shares)
    moved = order != own
    return None if (shares[own, order][moved] > np.log(_FITTED)).any() else np.asarray(order)

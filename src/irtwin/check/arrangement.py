"""Do positions and torques stand in the columns of their joints, with the right sign and scale?

A reversed, exchanged or wrongly geared position, or a reversed or exchanged torque, spoils what one set of bodies
explains of all torques, whatever the bodies' parameters are. Each such fault is undone in turn; the one without which
torques that were held out are far better predicted is there.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
from scipy.optimize import linear_sum_assignment

from irtwin.check.moving import Moving
from irtwin.check.rigid_body import Rows, rows_of
from irtwin.check.whole_body import Fitted, Held, WholeBody
from irtwin.robot.description import Robot
from irtwin.signals.channels import CHANNELS
from irtwin.signals.finding import Finding

_ROWS = 900  # over all runs
_FEWEST = 300  # samples; fewer, and regressors of chance explain everything
_GAIN = 2.0  # in the product of all residuals that undoing a fault has to bring
_SURE = 4.0  # standard deviations between stretches of time, of 20: one in 50 faults tried in 2,500 healthy logs
_ALIKE = 2.0  # standard deviations: a rival that is no further behind explains the torques as well
_FACTORS = (2.0, 0.5)
_FITTED = 0.8  # of a torque's deviation: an exchange must leave less at each joint
_ALL_PAIRS = 8  # joints; of more, neighbours alone
_MOST_JOINTS = 12  # of more, no fault is looked for: one takes a fit, and there are four faults a joint

_SAID = {
    "sign": "has the wrong sign",
    "swap": "stand in each other's columns",
    "order": "stand in each other's columns",
}
_CURE = {
    ("sign", "q"): "change it, and that of the speed",
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

    def undone(self, values: np.ndarray) -> np.ndarray:
        return np.asarray((values * self.factors)[:, self.order])

    def columns(self, robot: Robot) -> str:
        names = CHANNELS[self.field].columns(robot.joint_names)
        return " <-> ".join(names[joint] for joint in self.joints)

    def mirrors(self, other: _Fault) -> bool:
        """Whether the other is the same fault of the same joints, of the other field."""
        return (self.fault, self.joints) == (other.fault, other.joints) and self.field != other.field


def arrangement_findings(robot: Robot, moving: Moving, reversed_torques: Collection[str] = ()) -> list[Finding]:
    """Return the clearest such fault alone: others are seen once it is cured.

    `reversed_torques`: columns that are known to have the wrong sign.
    """
    rows = _rows(robot, moving, reversed_torques)
    if rows is None:
        return []
    body = WholeBody.of(rows)
    own = body.held_out(rows.torque)
    left = {fault: _undone(rows, body, fault).left for fault in _faults(rows, moving.joints)}
    fault = min(left, key=lambda each: left[each], default=None)
    if fault is None or body.fit(rows.torque).left < left[fault]:
        return []
    held = _held(rows, body, fault)
    if own.gain(held) < np.log(_GAIN) or own.t(held) < _SURE:
        return []
    if fault.field == "torque" and fault.fault == "scale":
        return []  # is found where its size is estimated
    rivals = [each for each in left if each.mirrors(fault) and _held(rows, body, each).t(held) < _ALIKE]
    return [_finding(fault, rivals, own.gain(held), own.t(held), robot, moving)]


def says_position(robot: Robot, moving: Moving, joint: int) -> float:
    """Return by how many standard deviations a reversed position explains the torques better than a reversed torque."""
    rows = _rows(robot, moving, ())
    if rows is None:
        return 0.0
    body, sign = WholeBody.of(rows), np.where(np.arange(len(robot.joints)) == joint, -1.0, 1.0)
    own = np.arange(len(robot.joints))
    of_torque, of_position = (
        _held(rows, body, _Fault("sign", field, (joint,), sign, own)) for field in ("torque", "q")
    )
    return of_torque.t(of_position)


def _rows(robot: Robot, moving: Moving, reversed_torques: Collection[str]) -> Rows | None:
    """Return the rows that show such a fault; None where there are too few."""
    rows = rows_of(robot, moving, _ROWS) if len(robot.joint_names) <= _MOST_JOINTS else None
    if rows is None or len(rows.q) < _FEWEST:
        return None
    names = CHANNELS["torque"].columns(robot.joint_names)
    return replace(rows, torque=rows.torque * np.where([name in reversed_torques for name in names], -1.0, 1.0))


def _undone(rows: Rows, body: WholeBody, fault: _Fault) -> Fitted:
    return body.fit(fault.undone(rows.torque)) if fault.field == "torque" else _moved(rows, fault).fit(rows.torque)


def _held(rows: Rows, body: WholeBody, fault: _Fault) -> Held:
    if fault.field == "torque":
        return body.held_out(fault.undone(rows.torque))
    return _moved(rows, fault).held_out(rows.torque)


def _finding(fault: _Fault, rivals: list[_Fault], gain: float, t: float, robot: Robot, moving: Moving) -> Finding:
    ratio, named = float(np.exp(gain)), fault.columns(robot)
    prefix = CHANNELS[fault.field].prefix
    mended = fault.fault == "sign" and fault.field == "torque"
    said = _SAID.get(fault.fault) or f"is {1 / fault.factors[fault.joints[0]]:g} times what the joint turns"
    cure = _CURE.get((fault.fault, prefix), "name them by their joints")
    other = f" (or {rivals[0].columns(robot)}: the torques cannot tell which)" if rivals else ""
    return Finding(
        fault.fault, named, moving.names, certain=True, mended=mended,
        evidence={"residual_ratio": ratio, "t": round(t, 1)},
        say=f"{named} {said}{other}: without that, one set of bodies explains all torques {ratio:.3g} times better; "
        f"{cure}",
    )  # fmt: skip


def _moved(rows: Rows, fault: _Fault) -> WholeBody:
    q, dq, ddq = (fault.undone(values) for values in (rows.q, rows.dq, rows.ddq))
    return WholeBody.of(replace(rows, q=q, dq=dq, ddq=ddq))


def _faults(rows: Rows, joints: np.ndarray) -> Iterator[_Fault]:
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


def _assigned(rows: Rows, joints: np.ndarray) -> np.ndarray | None:
    """Return in which column each joint's torque stands, by what its motion alone explains; None where vague."""
    shares = np.log(rows.unexplained(joints))
    own, order = linear_sum_assignment(shares)
    moved = order != own
    return None if (shares[own, order][moved] > np.log(_FITTED)).any() else np.asarray(order)

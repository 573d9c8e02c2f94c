"""Do positions and torques stand in the columns of their joints, positions with the right sign and gear ratio?

A reversed, exchanged or wrongly geared position, or an exchanged torque, spoils what the rigid body explains of the
torques, whatever the bodies' parameters are. Each such fault is undone in turn; the one without which the torques are
far better explained is there.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations

import numpy as np
from scipy.optimize import linear_sum_assignment

from irtwin.check.moving import Moving
from irtwin.check.rigid_body import rows_of
from irtwin.robot.description import Robot
from irtwin.signals.channels import CHANNELS
from irtwin.signals.finding import Finding

_ROWS = 900  # over all runs
_FEWEST = 300  # samples; fewer, and regressors of chance explain everything
_GAIN = 2.0  # in the product of all residuals that undoing a fault has to bring, for two columns
_FACTORS = (2.0, 0.5)
_FITTED = 0.8  # of a torque's deviation: an exchange must leave less at each joint
_EXCHANGED = "stand in each other's columns: name them by their joints"
_ALL_PAIRS = 8  # joints; of more, neighbours alone
_MOST_JOINTS = 12  # of more, no fault is looked for: one takes a fit a joint, and there are four faults a joint


@dataclass(frozen=True)
class _Fault:
    """A fault undone: factors (n,) of the positions, and in which columns those of each joint stand, (n,)."""

    fault: str
    columns: tuple[str, ...]
    factors: np.ndarray
    order: np.ndarray

    @property
    def say(self) -> str:
        if self.fault == "swap":
            return _EXCHANGED
        if self.fault == "sign":
            return "has the wrong sign: change it, and that of the speed"
        factor = float(self.factors[self.factors != 1.0][0])
        return f"is {1 / factor:g} times what the joint turns: correct the gear ratio that was assumed"


def arrangement_findings(robot: Robot, moving: Moving) -> list[Finding]:
    """Return the clearest such fault alone: others are seen once it is cured."""
    if len(robot.joint_names) > _MOST_JOINTS:
        return []
    rows = rows_of(robot, moving, _ROWS)
    if rows is None or len(rows.q) < _FEWEST:
        return []
    shares = np.log(rows.unexplained(moving.joints))
    by_torque = _exchanged_torques(robot, moving, shares)
    own = float(np.trace(shares))
    gains = [
        (own - float(np.log(np.diag(rows.changed(fault.factors, fault.order).unexplained(moving.joints))).sum()), fault)
        for fault in _faults(robot, moving.joints)
    ]
    gain, fault = max(gains, key=lambda entry: entry[0], default=(0.0, None))
    if by_torque is not None and by_torque.evidence["residual_ratio"] >= np.exp(gain):
        return [by_torque]
    if fault is None or gain < np.log(_GAIN):
        return []
    return [_finding(fault.fault, fault.columns, fault.say, moving, gain)]


def _finding(fault: str, columns: tuple[str, ...], say: str, moving: Moving, gain: float) -> Finding:
    named = " <-> ".join(columns)
    return Finding(
        fault, named, moving.names, certain=True, mended=False, evidence={"residual_ratio": float(np.exp(gain))},
        say=f"{named} {say}; the rigid body then explains the torques {np.exp(gain):.3g} times better",
    )  # fmt: skip


def _exchanged_torques(robot: Robot, moving: Moving, shares: np.ndarray) -> Finding | None:
    """`shares[a, b]`: logarithm of what the motion of joint a leaves of the torque in column b."""
    own = np.arange(len(shares))
    _, order = linear_sum_assignment(shares)
    moved = np.flatnonzero(order != own)
    gain = float((shares[own, own] - shares[own, order]).sum())
    if gain < np.log(_GAIN) * len(moved) / 2 or not len(moved) or (shares[own, order][moved] > np.log(_FITTED)).any():
        return None
    names = CHANNELS["torque"].columns(robot.joint_names)
    columns = tuple(names[joint] for joint in moved)
    return _finding("swap" if len(moved) == 2 else "order", columns, _EXCHANGED, moving, gain)


def _faults(robot: Robot, joints: np.ndarray) -> list[_Fault]:
    names = CHANNELS["q"].columns(robot.joint_names)
    n, own = len(names), np.arange(len(names))
    found = []
    for joint in np.flatnonzero(joints):
        chosen = own == joint
        found.append(_Fault("sign", (names[joint],), np.where(chosen, -1.0, 1.0), own))
        found += [_Fault("scale", (names[joint],), np.where(chosen, factor, 1.0), own) for factor in _FACTORS]
    for a, b in combinations(np.flatnonzero(joints).tolist(), 2):
        if n <= _ALL_PAIRS or b == a + 1:
            order = own.copy()
            order[[a, b]] = b, a
            found.append(_Fault("swap", (names[a], names[b]), np.ones(n), order))
    return found

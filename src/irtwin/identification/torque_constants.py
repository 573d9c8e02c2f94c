"""Torque constants from the balance of electrical power, where currents were measured and no torque."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from irtwin.effects.catalogue import catalogue
from irtwin.effects.effect import Effect, Term, force_unit
from irtwin.errors import InputError
from irtwin.identification.accumulate import Rows
from irtwin.identification.estimators import Estimate, estimate_one
from irtwin.robot.description import Robot
from irtwin.signals.motion import Motion


@dataclass(frozen=True)
class TorqueConstants:
    """`constants` (n,) N m/A reflected to the joints; `terms` and `estimate` are theirs, for the record."""

    constants: np.ndarray
    terms: tuple[tuple[Effect, Term], ...]
    estimate: Estimate


def torque_constants(robot: Robot, motions: Sequence[Motion]) -> TorqueConstants:
    """Find each joint's torque constant from P = P0 + sum_j (kt_j i_j dq_j + R_j i_j^2).

    Linear in P0, kt and R, all of them positive. One common kt and R for all joints are found first; these are then
    what each joint's own are expected to be, give or take as much: a joint that hardly draws power keeps the common
    value. Raises InputError where power does not rise with current times speed.
    """
    joints = robot.joints
    standby = Term("P0", "W", spread=600.0, lowest=0.0)
    common = [standby, Term("kt", "N m/A", spread=50.0, lowest=0.0), Term("R", "ohm", spread=20.0, lowest=0.0)]
    pooled = _balance(motions, common, pooled=True)
    _, constant, resistance = pooled.values
    if constant <= np.sqrt(pooled.covariance[1, 1]):
        raise InputError(
            "power does not rise with current times speed, so that the two do not tell the torque constants; "
            "give torque_constant for each joint, or log tau_"
        )
    units = [f"{force_unit(joint)}/A" for joint in joints]
    own = [
        Term("kt", unit, joint=joint.name, expected=constant, spread=constant, lowest=0.0)
        for joint, unit in zip(joints, units, strict=True)
    ]
    wide = resistance or common[2].spread
    heat = [Term("R", "ohm", joint=joint.name, expected=resistance, spread=wide, lowest=0.0) for joint in joints]
    fit = _balance(motions, [standby, *own, *heat], pooled=False)
    mechanical = next(effect for effect in catalogue().values() if effect.carries_torque)
    kept = fit.of(range(1, 1 + len(joints)))
    return TorqueConstants(kept.values, tuple((mechanical, term) for term in own), kept)


def torque_from_current(robot: Robot, motions: Sequence[Motion]) -> tuple[Robot, list[Motion], TorqueConstants | None]:
    """Give robot and motions the torque constants that power tells, and the torque that follows.

    None, and all as it was, where torque is known, or no current beside power.
    """
    telling = [motion for motion in motions if motion.current is not None and motion.power is not None]
    if not telling or any(motion.torque is not None for motion in motions):
        return robot, list(motions), None
    balance = torque_constants(robot, telling)
    both = zip(robot.joints, balance.constants.tolist(), strict=True)
    known = [
        motion if motion.current is None else replace(motion, torque=motion.current * balance.constants)
        for motion in motions
    ]
    return replace(robot, joints=tuple(replace(joint, torque_constant=value) for joint, value in both)), known, balance


def _balance(motions: Sequence[Motion], terms: Sequence[Term], *, pooled: bool) -> Estimate:
    def equations(motion: Motion) -> Rows:
        assert motion.current is not None and motion.power is not None
        parts = [motion.current * motion.dq, motion.current**2]
        if pooled:
            parts = [part.sum(axis=1, keepdims=True) for part in parts]
        columns = np.column_stack([np.ones(len(motion.time)), *parts])
        return Rows(columns[:, None], np.zeros((len(columns), 1)), motion.power[:, None])

    return estimate_one(motions, equations, terms)[1]

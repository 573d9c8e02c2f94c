"""A better place of the base: the flange keeps its way through the room, within the limits of the arm."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from tests.planning.test_cycle import twin

from irtwin.planning.placement import FARTHEST, better_placement
from irtwin.robot.kinematics import placements
from irtwin.signals.motion import Motion


def swing(amplitude: float, joints: int = 6, seconds: float = 2.0) -> Motion:
    """A smooth swing of all joints about a bent pose."""
    time = np.linspace(0.0, seconds, 101)
    turn = 2 * np.pi * time / seconds
    weights = amplitude * np.linspace(1.0, 0.4, joints)
    middle = np.resize([0.3, -0.6, 0.9, 0.4, 0.7, -0.2, 0.5], joints)
    q = middle + (1 - np.cos(turn))[:, None] / 2 * weights
    dq = np.sin(turn)[:, None] * weights * np.pi / seconds
    ddq = np.cos(turn)[:, None] * weights * 2 * (np.pi / seconds) ** 2
    return Motion(time, q, dq, ddq, run="weld")


@pytest.mark.parametrize("joints", [6, 7])  # an arm of seven has many ways to follow
def test_the_flange_keeps_its_way_and_the_energy_falls(joints: int) -> None:
    known, was = twin(joints=joints), swing(0.4, joints=joints)
    found = better_placement(known, was)
    assert 0 < np.abs(found.shift).max() <= FARTHEST
    way, moved = placements(known.robot, was.q), placements(known.robot, found.motion.q)
    np.testing.assert_allclose(moved[:, :3, 3] + found.shift, way[:, :3, 3], atol=2e-3)
    np.testing.assert_allclose(moved[:, :3, :3], way[:, :3, :3], atol=5e-3)
    assert found.saved.value == pytest.approx(known.energy(was) - known.energy(found.motion), rel=1e-3)


def test_an_arm_that_cannot_follow_from_elsewhere_stays() -> None:
    assert better_placement(twin(joints=2), swing(0.4, joints=2)) is None


def test_an_arm_whose_limits_leave_no_room_stays() -> None:
    known, was = twin(joints=6), swing(0.4)
    narrow = [
        replace(joint, lower=float(low) - 1e-3, upper=float(high) + 1e-3)
        for joint, low, high in zip(known.robot.joints, was.q.min(axis=0), was.q.max(axis=0), strict=True)
    ]
    held = replace(known, robot=replace(known.robot, joints=tuple(narrow)))
    assert better_placement(held, was) is None

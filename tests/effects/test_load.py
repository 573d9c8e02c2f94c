"""How much of a load is expected before anything is measured."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest
from tests.synthetic import arm

from irtwin.effects.load import GravityCompensation, borne


def weighing(times):
    """The arm with masses so many times its own."""
    robot = arm(3)
    return replace(
        robot, urdf=re.sub(r'<mass value="([^"]+)"', lambda mass: f'<mass value="{times * float(mass[1])}"', robot.urdf)
    )


def test_a_balancer_is_built_for_what_its_joint_bears():
    light, heavy = (
        np.array([term.spread for term in GravityCompensation(joints=("joint_2",)).terms(weighing(times))])
        for times in (1.0, 5.0)
    )
    assert heavy == pytest.approx(5 * light)
    assert light[0] == pytest.approx(borne(weighing(1.0), 1))
    assert light == pytest.approx(light[0] * np.array([1, 1, 1 / 3, 1 / 3]))


def test_a_joint_bears_the_bodies_beyond_it():
    robot = weighing(1.0)
    outer = 8.0 / 3 * np.linalg.norm([0.06, 0.03, 0.1])
    assert borne(robot, 2) == pytest.approx(9.81 * outer)
    assert borne(robot, 0) > borne(robot, 1) > borne(robot, 2)
    assert borne(arm(3, slides=(2,)), 2) == pytest.approx(9.81 * 8.0 / 3)


def test_of_an_arm_without_masses_nothing_is_known():
    assert borne(weighing(0.0), 1) == 1000.0

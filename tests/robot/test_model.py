"""The model of a URDF: what the joints move."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest
from tests.synthetic import arm

from irtwin.robot.model import build_model, mean_inertia

TWO_LINKS = arm(2).urdf


def limited(lower: float, upper: float) -> pin.Model:
    return build_model(TWO_LINKS.replace('lower="-2.5" upper="2.5"', f'lower="{lower}" upper="{upper}"'))


def by_grid(lower: float, upper: float) -> float:
    """The inertia that the first joint moves, over many angles of the second: its own changes nothing."""
    model = build_model(TWO_LINKS)
    data = model.createData()
    return float(np.mean([pin.crba(model, data, np.array([0.0, q]))[0, 0] for q in np.linspace(lower, upper, 2001)]))


@pytest.mark.parametrize(("lower", "upper"), [(-2.5, 2.5), (0.5, 1.5), (-0.1, 3.0)])
def test_the_mean_inertia_is_that_of_all_poses_within_the_limits(lower: float, upper: float) -> None:
    assert mean_inertia(limited(lower, upper))[0] == pytest.approx(by_grid(lower, upper), rel=0.01)


def test_a_joint_of_several_turns_or_without_limits_has_one_turn() -> None:
    every = by_grid(-np.pi, np.pi)
    assert mean_inertia(limited(-11.0, 11.0))[0] == pytest.approx(every, rel=0.01)
    continuous = build_model(TWO_LINKS.replace('type="revolute"', 'type="continuous"'))
    assert mean_inertia(continuous)[0] == pytest.approx(every, rel=0.01)


def test_the_last_joint_moves_the_same_in_every_pose() -> None:
    model = build_model(TWO_LINKS)
    own = pin.crba(model, model.createData(), np.zeros(2))[1, 1]
    assert mean_inertia(model)[1] == pytest.approx(own)

"""Equations of a step give what least squares give."""

from __future__ import annotations

import numpy as np
import pytest

from irtwin.simulator.equations import Equations

ROWS = ("a", "b", "c")
LEFT = np.random.default_rng(1).standard_normal((50, 2, 4))  # (N, c, n)
COLUMNS = np.random.default_rng(2).standard_normal((3, 50, 2, 4))
WEIGHT = np.random.default_rng(3).uniform(0.5, 2.0, (2, 4))


@pytest.fixture
def joints():
    return Equations.of(ROWS, COLUMNS, LEFT, WEIGHT)


def one(joints, joint):
    return Equations(ROWS, joints.normal[joint], joints.right[joint])


def fitted(columns, left, weight):
    root = np.sqrt(weight)
    return np.linalg.lstsq((columns * root).reshape(len(columns), -1).T, (left * root).ravel())[0]


def test_the_step_is_that_of_weighted_least_squares(joints):
    for joint in range(4):
        expected = fitted(COLUMNS[..., joint], LEFT[..., joint], WEIGHT[:, joint])
        np.testing.assert_allclose(one(joints, joint).step(), expected)
    np.testing.assert_allclose(joints.together().step(), fitted(COLUMNS, LEFT, WEIGHT))


def test_equations_beside_each_other_add_up(joints):
    both = Equations.beside([joints, joints])
    assert both.right.shape == (2, 4, 3)
    np.testing.assert_allclose(both.together().normal, 2 * joints.normal)
    np.testing.assert_allclose(both.together(axis=1).right[0], joints.together().right)


def test_some_rows_are_fitted_with_the_others_held_or_fitted_beside(joints):
    whole = joints.together()
    np.testing.assert_allclose(whole.some(["c", "a"]).step(), fitted(COLUMNS[[2, 0]], LEFT, WEIGHT))
    beside = whole.marginal(["c"])
    np.testing.assert_allclose(beside.step(), whole.step()[2:])
    np.testing.assert_allclose(beside.variance, whole.variance[2:])


def test_what_is_likely_pulls_and_damping_holds_back(joints):
    whole = joints.together()
    deviation = np.array([1e-6, 1.0, 1e6])
    step = whole.likely(np.array([2.0, 0.0, 0.0]), deviation).step()
    assert step[0] == pytest.approx(-2e-6, rel=1e-3)
    assert step[2] == pytest.approx(fitted(COLUMNS[1:], LEFT, WEIGHT)[1], rel=0.1)
    assert (np.abs(whole.damped(9.0).step()) < 0.2 * np.abs(whole.step()).max()).all()


def test_a_step_goes_no_farther_than_it_may(joints):
    whole = joints.together()
    farthest = np.abs(whole.step()) * np.array([0.5, 1.0, 2.0])
    np.testing.assert_allclose(whole.step(farthest), whole.step() / 2)


def test_numbers_of_stretches_that_disagree_are_less_sure(joints):
    whole = joints.together()
    np.testing.assert_allclose(whole.disagreement(np.zeros((4, 3)), 3), whole.variance)
    each = 100.0 * np.random.default_rng(4).standard_normal((4, 3))
    assert (whole.disagreement(each, 3) > whole.variance).all()
    assert whole.known(np.full(3, 10.0)) == pytest.approx(np.log(np.linalg.det(100.0 * whole.normal)) / 2)

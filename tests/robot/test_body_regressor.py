"""The regressor of many samples at once is Pinocchio's of each: any chain or tree, whose axes turn or slide."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from irtwin.robot import body_regressor as module
from irtwin.robot.body_regressor import body_regressor, carried_bodies, point_jacobian, regressor_slope


def tree(parents: list[int], slides: list[bool], rng: np.random.Generator) -> pin.Model:
    """Joints at any place on their parents (0: the base), about or along any axis; gravity in any direction."""
    model = pin.Model()
    model.gravity.linear = rng.uniform(-10, 10, 3)
    for number, (parent, sliding) in enumerate(zip(parents, slides, strict=True)):
        axis = rng.standard_normal(3)
        axis /= np.linalg.norm(axis)
        kind = pin.JointModelPrismaticUnaligned if sliding else pin.JointModelRevoluteUnaligned
        place = pin.SE3(pin.exp3(rng.standard_normal(3)), rng.uniform(-1, 1, 3))
        model.addJoint(parent, kind(*axis), place, f"joint_{number}")
    return model


def one_by_one(model: pin.Model, q: np.ndarray, dq: np.ndarray, ddq: np.ndarray) -> np.ndarray:
    data = model.createData()
    states = zip(q, dq, ddq, strict=True)
    found = [np.array(pin.computeJointTorqueRegressor(model, data, *state)) for state in states]
    return np.reshape(found, (len(q), model.nv, 10 * model.nv))


@settings(max_examples=30)
@given(st.data(), st.integers(1, 7), st.integers(0, 2**32 - 1))
def test_it_is_what_pinocchio_says_of_each_sample(data, joints, seed):
    parents = [data.draw(st.integers(0, number), "parent") for number in range(joints)]
    slides = data.draw(st.lists(st.booleans(), min_size=joints, max_size=joints), "slides")
    rng = np.random.default_rng(seed)
    model, states = tree(parents, slides, rng), rng.uniform(-3, 3, (3, 4, joints))
    found, along = body_regressor(model, *states), rng.uniform(-3, 3, (4, joints))
    np.testing.assert_allclose(found, one_by_one(model, *states), rtol=1e-11, atol=1e-10)
    expected = np.einsum("njk,nj->nk", found, along)
    np.testing.assert_allclose(carried_bodies(model, *states, along), expected, rtol=1e-9, atol=1e-9)


@settings(max_examples=30)
@given(st.data(), st.integers(1, 7), st.integers(0, 2**32 - 1))
def test_its_slope_is_that_of_differences(data, joints, seed):
    parents = [data.draw(st.integers(0, number), "parent") for number in range(joints)]
    slides = data.draw(st.lists(st.booleans(), min_size=joints, max_size=joints), "slides")
    rng = np.random.default_rng(seed)
    model, states = tree(parents, slides, rng), rng.uniform(-2, 2, (3, 4, joints))
    weights, along = rng.standard_normal((4, joints, 10 * joints)), rng.standard_normal((3, 4, joints))
    up, down = (body_regressor(model, *(states + step * along)) for step in (1e-5, -1e-5))
    differences = ((up - down) * weights).sum(axis=(1, 2)) / 2e-5
    found = (np.array(regressor_slope(model, *states, weights)) * along).sum(axis=(0, 2))
    np.testing.assert_allclose(found, differences, rtol=1e-6, atol=1e-4)


@pytest.mark.parametrize("samples", [0, 1, 6, 7, 15])
def test_pieces_join(monkeypatch, samples):
    monkeypatch.setattr(module, "_PIECE", 7)
    rng = np.random.default_rng(0)
    model, states = tree([0, 1, 2], [False, True, False], rng), rng.uniform(-2, 2, (3, samples, 3))
    found = body_regressor(model, *states)
    assert found.shape == (samples, 3, 30)
    np.testing.assert_allclose(found, one_by_one(model, *states), rtol=1e-11, atol=1e-11)


def test_the_jacobian_of_a_point_is_what_pinocchio_says_of_each_sample(monkeypatch):
    monkeypatch.setattr(module, "_PIECE", 3)
    rng = np.random.default_rng(0)
    model = tree([0, 1, 1, 3], [False, True, False, False], rng)
    place = pin.SE3(pin.exp3(rng.standard_normal(3)), rng.uniform(-1, 1, 3))
    frame = model.addFrame(pin.Frame("tip", 4, 0, place, pin.FrameType.OP_FRAME))
    q, data = rng.uniform(-3, 3, (8, 4)), model.createData()
    single = [pin.computeFrameJacobian(model, data, each, frame, pin.LOCAL_WORLD_ALIGNED)[:3].T.copy() for each in q]
    np.testing.assert_allclose(point_jacobian(model, frame, q), single, atol=1e-12)

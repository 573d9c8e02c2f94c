"""Numbers that differ are found and no others; equal models have none."""

from __future__ import annotations

import numpy as np
import pytest
from tests import servo_arm

from irtwin.simulator.alone import alone
from irtwin.simulator.choice import choose
from irtwin.simulator.fit import Fit
from irtwin.simulator.play import each
from irtwin.simulator.refined import softened
from irtwin.simulator.servos import NAMES, PARTS

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def arm(tmp_path_factory):
    told = {name: servo_arm.swings(6, seed) for name, seed in (("a", 1), ("b", 2))}
    return servo_arm.read(*servo_arm.write(tmp_path_factory.mktemp("arm"), told))


def chosen(arm, numbers):
    data_set, _, own = arm
    runs = servo_arm.played(data_set, own, numbers).runs
    stretches = [one for run in runs for one in each(run, 2.7, 2)]
    return choose(Fit(alone(own, stretches, 0.01), np.full(2, 1e-2), np.full(2, 3.0)))


def test_equal_models_have_no_number_that_differs(arm):
    assert not chosen(arm, arm[2].numbers).differs.any()


@pytest.mark.nightly
def test_a_limit_of_torque_and_a_dead_band_are_found(arm):
    true = servo_arm.changed(arm[2], torque_limit=(0.8, arm[2].numbers[7, 1]), dead_band=(0.0, 0.02))
    found = chosen(arm, true)
    assert (found.differs == (true != arm[2].numbers)).all()
    assert found.numbers[7, 0] == pytest.approx(0.8, rel=0.1)
    assert found.numbers[8, 1] == pytest.approx(0.02, rel=0.2)


def test_the_numbers_that_differ_are_found_with_their_values(arm):
    true = servo_arm.changed(arm[2], stiffness=(20.0, 10.0), friction=(0.15, 0.05))
    found = chosen(arm, true)
    assert (found.differs == (true != arm[2].numbers)).all()
    assert (((found.interval[0] <= true) & (true <= found.interval[1])) | ~found.differs).all()
    np.testing.assert_allclose(found.numbers, true, rtol=0.1)
    rng = np.random.default_rng(0)
    draws = np.array([found.drawn(rng) for _ in range(300)])
    inside = (found.interval[0] <= draws) & (draws <= found.interval[1])
    assert inside[:, found.differs].mean() == pytest.approx(0.95, abs=0.03)
    np.testing.assert_allclose(draws[:, ~found.differs], np.tile(true[~found.differs], (300, 1)), rtol=1e-9)
    left_out = np.array([False, False, True, True])
    np.testing.assert_allclose(found.without(left_out), true, rtol=0.2)


@pytest.mark.parametrize(
    ("name", "true"),
    [
        ("spring", (0.0, 3.0)),
        ("link_compliance", (0.0, 0.05)),
        pytest.param("compliance", (0.05, 0.0), marks=pytest.mark.nightly),
    ],
)
def test_a_spring_and_a_soft_joint_are_found(arm, name, true):
    found = softened(chosen(arm, servo_arm.changed(arm[2], **{name: true})))
    row = NAMES.index(name)
    assert np.argwhere(found.differs).tolist() == [[row, int(np.argmax(true))]]
    np.testing.assert_allclose(found.numbers[row], true, rtol=0.05)
    assert (found.interval[0, row] <= true).all() and (found.interval[1, row] >= true).all()


@pytest.mark.parametrize(
    ("part", "name", "true"),
    [("payload", "payload", 0.1), pytest.param("base_tilt", "tilt_y", 0.25, marks=pytest.mark.nightly)],
)
def test_what_the_whole_robot_has_is_found_and_no_joint_is_blamed(arm, part, name, true):
    found = chosen(arm, servo_arm.changed(arm[2], **{name: (true, true)}))
    assert {one for one, row in zip(NAMES, found.differs, strict=True) if row.any()} == set(PARTS[part])
    row = NAMES.index(name)
    assert (found.interval[0, row] <= true).all() and (found.interval[1, row] >= true).all()
    assert found.numbers[row] == pytest.approx(true, rel=0.2)

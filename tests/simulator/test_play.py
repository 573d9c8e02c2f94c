from __future__ import annotations

import numpy as np
import pytest
from tests import servo_arm

from irtwin.simulator.alone import alone
from irtwin.simulator.play import commanded, each, play, whole


def test_commands_are_held_until_the_next_and_come_late(tmp_path):
    told = np.zeros((50, 2))
    told[25:] = 1.0
    data_set, _, own = servo_arm.read(*servo_arm.write(tmp_path, {"a": told}))
    stretch, begin = whole(data_set.runs[0]), np.arange(0.0, 1.0, 0.01)
    numbers = servo_arm.changed(own, delay=(0.0, 0.1), offset=(0.2, 0.0))
    (found,) = commanded(own, [(numbers, stretch)], begin, 0.01)
    np.testing.assert_allclose(found[:, 0], 0.2 + (begin > 0.495), atol=1e-9)
    np.testing.assert_allclose(found[:, 1], begin > 0.595, atol=1e-9)


def test_a_controller_that_damps_its_error_leads_by_the_speed_of_its_commands(tmp_path):
    told = np.column_stack([np.zeros(100), np.linspace(0, 1, 100)])
    data_set, _, own = servo_arm.read(*servo_arm.write(tmp_path, {"a": told}))
    stretch, begin = whole(data_set.runs[0]), np.arange(0.5, 1.5, 0.02)
    plain, led = (stretch.commands(begin, 0.02, own.numbers, 0.04, damps) for damps in (False, True))
    np.testing.assert_allclose(led - plain, [[0.0, 0.04 * 50 / 99]] * len(begin), atol=1e-12)


@pytest.fixture
def still(tmp_path):
    """The servos of an arm without dry friction, and a run in which it is told to stay."""
    text = servo_arm.MODEL.replace('frictionloss="0.05"', 'frictionloss="0"')
    data_set, _, own = servo_arm.read(*servo_arm.write(tmp_path, {"a": np.zeros((150, 2))}, text))
    return own, whole(data_set.runs[0])


def test_a_servo_settles_where_its_load_lets_it(still):
    own, run = still
    q = play(own, [own.numbers], [run])[0][0][-1, 0]
    sags = 9.81 * 0.1 * 0.1 * np.cos(q.sum()) / 15
    assert q[1] == pytest.approx(sags, rel=1e-3)


def test_a_servo_with_a_dead_band_lets_its_joint_sag_by_it(still):
    own, run = still
    numbers = [own.numbers, servo_arm.changed(own, dead_band=(0.0, 0.03)), servo_arm.changed(own, torque_limit=(5, 0))]
    tight, loose, weak = (q[0][-1, 0] for q in play(own, numbers, [run]))
    assert loose[1] - tight[1] == pytest.approx(0.03, rel=0.02)
    assert weak[1] > 0.5


def test_a_limit_of_the_joint_holds_beside_a_dead_band(tmp_path):
    weak = servo_arm.MODEL.replace(
        'name="lift"', 'name="lift" actuatorfrclimited="true" actuatorfrcrange="-0.05 0.05"', 1
    )
    data_set, _, own = servo_arm.read(*servo_arm.write(tmp_path, {"a": np.zeros((50, 2))}, weak))
    numbers = [own.numbers, servo_arm.changed(own, dead_band=(0.0, 1e-6))]
    plain, banded = (q[0][:, 0] for q in play(own, numbers, [whole(data_set.runs[0])]))
    assert np.abs(plain[-1]).max() > 0.1
    np.testing.assert_allclose(banded, plain, atol=1e-3)


def test_stretches_do_not_overlap_and_are_spread(tmp_path):
    run = servo_arm.read(*servo_arm.write(tmp_path, {"a": servo_arm.swings(10, 1)}))[0].runs[0]
    assert [round(one.begin, 2) for one in each(run, 2.0, 2)] == [1.5, 6.49]
    assert len(each(run, 0.5, 60)) == 19
    assert [len(one.time) for one in each(run, 60.0, 60)] == [500]


def test_a_joint_by_itself_plays_nearly_as_the_whole_model(tmp_path):
    data_set, _, own = servo_arm.read(*servo_arm.write(tmp_path, {"a": servo_arm.swings(6, 1)}))
    data_set = servo_arm.played(data_set, own, own.numbers, noise=0.0)
    differs = {"stiffness": (22.0, 14.0), "friction": (0.1, 0.02), "torque_limit": (3.0, 5.0)}
    numbers = servo_arm.changed(own, **differs, delay=(0.0, 0.02), dead_band=(0, 0.02))
    stretches = each(data_set.runs[0], 2.0, 2)
    single, whole_ = alone(own, stretches, 0.005).play([numbers])[0], play(own, [numbers], stretches)[0]
    far = max(np.abs(one.measured - own_).max() for one, own_ in zip(stretches, whole_, strict=True))
    near = max(np.abs(one - other).max() for one, other in zip(single, whole_, strict=True))
    assert near < 0.02 < far


def test_a_joint_by_itself_stops_where_the_model_has_a_stop(tmp_path):
    told = {"a": servo_arm.swings(6, 1)}
    data_set, _, own = servo_arm.read(*servo_arm.write(tmp_path, told, text=servo_arm.STOPPED))
    numbers = servo_arm.changed(own, torque_limit=(0.3, own.numbers[7, 1]))
    stretches = each(servo_arm.played(data_set, own, numbers, noise=0.0).runs[0], 1.0, 3)
    single = alone(own, stretches, 0.005).play([numbers])[0]
    assert max(np.abs(one.measured - other).max() for one, other in zip(stretches, single, strict=True)) < 0.05

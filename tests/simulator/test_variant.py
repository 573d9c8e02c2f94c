"""A model with joints that are soft behind their motors, and servos with dead bands."""

from __future__ import annotations

import numpy as np
import pytest
from tests import servo_arm

from irtwin.simulator.play import play, whole
from irtwin.simulator.variant import variant

SMOOTH = servo_arm.MODEL.replace('frictionloss="0.05"', 'frictionloss="0"')


def test_a_link_hangs_behind_its_motor_by_its_load(tmp_path):
    data_set, _, own = servo_arm.read(*servo_arm.write(tmp_path, {"a": np.zeros((200, 2))}, SMOOTH))
    ways = [servo_arm.changed(own, **{name: (0.0, 0.02)}) for name in ("compliance", "link_compliance")]
    motor, link = (q[0][-1, 0] for q in play(own, ways, [whole(data_set.runs[0])]))
    load = 9.81 * 0.1 * 0.1 * np.cos(link.sum())
    assert link[1] - motor[1] == pytest.approx(0.02 * load, rel=0.01)
    assert motor[1] == pytest.approx(load / 15, rel=0.01)


def test_positions_are_measured_at_motors_or_at_links(tmp_path):
    _, model, _ = servo_arm.read(*servo_arm.write(tmp_path, {"a": np.zeros((50, 2))}))
    soft = variant(model, False, ["elbow"])
    assert (soft.compiled.nv, soft.soft.tolist(), len(soft.second)) == (3, [1], 0)
    qpos = np.zeros((1, 3))
    qpos[0, soft.positions], qpos[0, soft.links] = (0.1, 0.2), 0.03
    assert soft.measured(qpos, np.array([False, False])).tolist() == [[0.1, 0.2]]
    np.testing.assert_allclose(soft.measured(qpos, np.array([False, True])), [[0.1, 0.23]])


def test_dead_bands_have_actuators_beside_the_servos(tmp_path):
    _, model, _ = servo_arm.read(*servo_arm.write(tmp_path, {"a": np.zeros((50, 2))}))
    banded = variant(model, True, [])
    assert (banded.compiled.nu, banded.second.tolist(), len(banded.behind)) == (4, [2, 3], 0)
    assert banded.compiled.actuator_ctrlrange[banded.second].tolist() == [[-1.5, 1.5], [-1.5, 1.5]]


def test_dry_friction_keeps_its_law_beside_a_soft_joint(tmp_path):
    data_set, _, own = servo_arm.read(*servo_arm.write(tmp_path, {"a": servo_arm.swings(3, 1)}))
    nearly_rigid = servo_arm.changed(own, compliance=(0.0, 1 / 200))  # N m/rad, where the servo has 15
    rigid, soft = (q[0][:, 0] for q in play(own, [own.numbers, nearly_rigid], [whole(data_set.runs[0])]))
    assert own.needs(nearly_rigid) == (False, ("elbow",))
    assert np.abs(soft - rigid).max() < 0.01 < np.abs(rigid).max()

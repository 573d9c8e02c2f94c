"""A payload at a model's flange is what a body of its own would be, and is written as the file tells inertials."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest
from tests import servo_arm

from irtwin.simulator.payload import loaded
from irtwin.simulator.servos import NAMES, PARTS

OFF = np.array([0.02, -0.01, 0.03])


@pytest.fixture
def arm(tmp_path):
    return servo_arm.read(*servo_arm.write(tmp_path, {"a": servo_arm.swings(4, 1)}))


def torque(compiled, q=(0.3, -0.5), dq=(1.0, 2.0), ddq=(3.0, -1.0)):
    data = mujoco.MjData(compiled)
    data.qpos[:], data.qvel[:], data.qacc[:] = q, dq, ddq
    mujoco.mj_inverse(compiled, data)
    return data.qfrc_inverse.copy()


def test_it_takes_the_torque_of_a_body_of_its_own(arm):
    _, model, _ = arm
    np.testing.assert_allclose(model.flange.place, [0.1, 0, 0])  # the last body's centre of mass: it has no other frame
    body = f'<body name="load" pos="0.12 -0.01 0.03"><inertial pos="0 0 0" mass="0.4" diaginertia="{"1e-12 " * 3}"/>'
    last = servo_arm.MODEL.index("</body>")
    other = mujoco.MjModel.from_xml_string(servo_arm.MODEL[:last] + body + "</body>" + servo_arm.MODEL[last:])
    one = loaded(model.compiled, model.flange, 0.4, OFF)
    np.testing.assert_allclose(torque(one), torque(other), rtol=1e-8)
    assert not np.allclose(torque(one), torque(model.compiled), rtol=1e-2)


def test_it_is_held_where_the_last_bodys_farthest_frame_is(tmp_path):
    text = servo_arm.MODEL.replace(
        'diaginertia="0.0005 0.0005 0.0005"/>', 'diaginertia="0.0005 0.0005 0.0005"/>\n<site pos="0.15 0 0.1"/>'
    )
    _, model, _ = servo_arm.read(*servo_arm.write(tmp_path, {"a": servo_arm.swings(4, 1)}, text))
    np.testing.assert_allclose(model.flange.place, [0.15, 0, 0.1])


def written(own, folder):
    numbers = own.numbers.copy()
    numbers[[NAMES.index(name) for name in PARTS["payload"]]] = np.array([0.4, *OFF])[:, None]
    file = folder / "new.xml"
    file.write_bytes(own.written(numbers, numbers != own.numbers))
    return file


def test_its_file_is_played_alike(arm, tmp_path):
    _, model, own = arm
    file = written(own, tmp_path)
    again = servo_arm.read(tmp_path / "data", file)[1]
    np.testing.assert_allclose(
        torque(again.compiled), torque(loaded(model.compiled, model.flange, 0.4, OFF)), rtol=1e-9
    )
    assert 'diaginertia="0.001 0.001 0.001"' in file.read_text() and "0.0005 0.0005" not in file.read_text()


def test_a_body_without_an_inertial_of_its_own_keeps_its_file(tmp_path):
    inertial = '<inertial pos="0.1 0 0" mass="0.1" diaginertia="0.0005 0.0005 0.0005"/>'
    text = servo_arm.MODEL.replace(inertial, '<geom size="0.05" mass="0.1"/>')
    _, _, own = servo_arm.read(*servo_arm.write(tmp_path, {"a": servo_arm.swings(4, 1)}, text))
    assert written(own, tmp_path).read_text() == text

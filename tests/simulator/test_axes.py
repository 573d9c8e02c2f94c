"""Whose arm a model is, by where the axes of its joints lie."""

from __future__ import annotations

from dataclasses import replace

import mujoco
import numpy as np
import pytest
from tests import mujoco_models
from tests.synthetic import arm

from irtwin.errors import InputError
from irtwin.simulator.axes import Axes, alike, first_unlike
from irtwin.simulator.model import read_model

ROBOT = arm(4)
ORDER = [0, 1, 2, 3]


def compiled(change=lambda spec: None):
    spec = mujoco.MjSpec.from_string(ROBOT.urdf)
    change(spec)
    return spec.compile()


def tilted(spec):
    for body in spec.worldbody.bodies:
        body.pos, body.quat = [1.0, -2.0, 0.5], [0.7, 0.1, -0.5, 0.5]


def reversed_(spec):
    spec.joint("joint_3").axis = -np.array(spec.joint("joint_3").axis)


def longer(spec):
    spec.joint("joint_3").parent.pos = 1.5 * np.array(spec.joint("joint_3").parent.pos) + [0.0, 0.2, 0.2]


def with_a_zero_elsewhere(spec):
    spec.joint("joint_2").ref = 0.3


def nudged(spec):
    spec.joint("joint_2").ref = 0.02
    spec.joint("joint_3").parent.pos = np.array(spec.joint("joint_3").parent.pos) + 0.002


@pytest.mark.parametrize(
    ("change", "found"),
    [
        (lambda spec: None, None),
        (tilted, None),
        (nudged, None),
        (longer, 2),
        (with_a_zero_elsewhere, 2),
        (reversed_, 2),
    ],
)
def test_a_model_is_the_robots_wherever_it_stands(change, found):
    of_it = first_unlike(compiled(change), ORDER, ROBOT)
    assert (of_it is None) == (found is None) and (of_it is None or of_it >= found)


def test_joints_in_another_order_are_none_of_the_robots():
    assert first_unlike(compiled(), [1, 0, 2, 3], ROBOT) is not None
    assert first_unlike(compiled(), [0, 1, 3, 2], ROBOT) is not None


def test_of_two_arms_in_a_model_both_are_found():
    spec = mujoco.MjSpec.from_string(ROBOT.urdf)
    frame = spec.worldbody.add_frame(pos=[0, 2, 0])
    spec.attach(mujoco.MjSpec.from_string(ROBOT.urdf), prefix="left_", frame=frame)
    assert alike(spec.compile(), ROBOT) == [ROBOT.joint_names, tuple(f"left_{name}" for name in ROBOT.joint_names)]
    assert alike(compiled(), arm(5)) == []


def test_axes_that_are_all_parallel_show_how_they_turn_by_how_they_move():
    angles = np.random.default_rng(0).uniform(-2, 2, (6, 2))
    point = np.zeros((6, 3, 3))
    for joint, length in ((1, 1.0), (2, 0.7)):
        turn = angles[:, :joint].sum(axis=1)
        point[:, joint] = point[:, joint - 1] + length * np.array([np.cos(turn), np.sin(turn), 0 * turn]).T
    flat = Axes(np.broadcast_to([0.0, 0.0, 1.0], point.shape), point, np.ones(3, dtype=bool))
    turn = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    elsewhere = replace(flat, direction=flat.direction @ turn, point=point @ turn + [3.0, 2.0, 1.0])
    assert flat.first_unlike(elsewhere) is None
    assert flat.first_unlike(replace(elsewhere, point=1.3 * elsewhere.point)) == 1


def test_a_model_in_another_order_is_refused_with_the_robots(tmp_path):
    file = mujoco_models.write(tmp_path / "arm.xml", ROBOT)
    swapped = ("joint_2", "joint_1", "joint_3", "joint_4")
    with pytest.raises(InputError, match=r"lies otherwise .* --joints joint_1,joint_2,joint_3,joint_4 lie as these do"):
        read_model(file, ROBOT, swapped)
    spec = mujoco.MjSpec.from_file(str(file))
    reversed_(spec)
    spec.compile()
    file.write_text(spec.to_xml())
    with pytest.raises(InputError, match=r"lies otherwise .* no joints of it lie as the robot's do; give a model of"):
        read_model(file, ROBOT)

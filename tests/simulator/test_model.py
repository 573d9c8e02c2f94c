from __future__ import annotations

import numpy as np
import pytest
from tests import mujoco_models
from tests.synthetic import arm, rigid_torque, swing, truth

from irtwin.errors import InputError
from irtwin.simulator.model import read_model

ROBOT = arm(4)
TRUE = truth(ROBOT)
NUMBERS = {"armature": TRUE["Ia"], "damping": TRUE["Fv"], "frictionloss": TRUE["Fc"]}


def test_a_model_takes_the_torque_of_its_bodies_rotors_and_friction(tmp_path):
    model = read_model(mujoco_models.write(tmp_path / "arm.xml", ROBOT, **NUMBERS), ROBOT)
    motion = swing(ROBOT, 1, seconds=2.0)
    expected = rigid_torque(ROBOT, motion) + TRUE["Ia"] * motion.ddq
    expected += TRUE["Fc"] * np.sign(motion.dq) + TRUE["Fv"] * motion.dq
    np.testing.assert_allclose(model.torque(motion.q, motion.dq, motion.ddq), expected, atol=1e-4)
    assert model.numbers("joint_2") == {name: pytest.approx(values[1]) for name, values in NUMBERS.items()}


def test_joints_that_the_robot_lacks_stay_where_they_begin(tmp_path):
    file = mujoco_models.write(tmp_path / "arm.xml", ROBOT)
    door = '<body><joint name="door"/><geom size=".1"/></body><body name="ball"><freejoint/><geom size=".1"/></body>'
    file.write_text(file.read_text().replace("</worldbody>", f"{door}</worldbody>"))
    model = read_model(file, ROBOT)
    assert model.others == ("door", "ball")
    motion = swing(ROBOT, 1, seconds=0.5)
    found = model.torque(motion.q, motion.dq, motion.ddq)
    np.testing.assert_allclose(found, rigid_torque(ROBOT, motion), atol=1e-4)


def test_meshes_for_pictures_may_be_missing(tmp_path):
    file = mujoco_models.write(tmp_path / "arm.xml", ROBOT)
    text = file.read_text().replace("<worldbody>", '<asset><mesh name="m" file="m.stl"/></asset><worldbody>')
    drawn = text.replace("<joint ", '<geom type="mesh" mesh="m"/><joint ', 1)
    file.write_text(drawn)
    assert read_model(file, ROBOT).joints == ROBOT.joint_names
    file.write_text(drawn.replace("<compiler", '<compiler inertiafromgeom="true"'))
    with pytest.raises(InputError, match=r"arm\.xml: .*m\.stl.*; MuJoCo cannot load it so"):
        read_model(file, ROBOT)


def test_a_model_of_other_joints_is_refused(tmp_path):
    file = mujoco_models.write(tmp_path / "arm.xml", arm(3))
    told = r"no joint joint_4; its joints are joint_1, joint_2, joint_3: no joints of it lie"
    with pytest.raises(InputError, match=told):
        read_model(file, ROBOT)


@pytest.mark.parametrize(("number", "value"), [("armature", "-1.0"), ("damping", "nan"), ("frictionloss", "-0.5")])
@pytest.mark.filterwarnings("ignore:Inertia matrix")
def test_numbers_that_no_joint_has_are_refused(tmp_path, number, value):
    file = mujoco_models.write(tmp_path / "arm.xml", ROBOT)
    file.write_text(file.read_text().replace('<joint name="joint_2"', f'<joint {number}="{value}" name="joint_2"'))
    with pytest.raises(InputError, match=rf"arm\.xml: {number} of joint joint_2 is {value}; give zero or more"):
        read_model(file, ROBOT)


def test_joints_of_other_names_are_said_in_the_robots_order(tmp_path):
    file = mujoco_models.write(tmp_path / "arm.xml", ROBOT, **NUMBERS)
    names = ["pan", "lift", "elbow", "wrist"]
    text = file.read_text()
    for old, new in zip(ROBOT.joint_names, names, strict=True):
        text = text.replace(f'"{old}"', f'"{new}"')
    file.write_text(text)
    with pytest.raises(InputError, match=r"are pan, lift, elbow, wrist: say .*: --joints pan,lift,elbow,wrist lie as"):
        read_model(file, ROBOT)
    model = read_model(file, ROBOT, names)
    assert model.numbers("joint_2") == {name: pytest.approx(values[1]) for name, values in NUMBERS.items()}
    tag, attribute = model.file.number(model.called["joint_2"], "damping")
    assert (tag.attributes["name"], attribute) == ("lift", "damping")
    for wrong, said in ((names[:3], "pan, lift, elbow are to be 4 names"), ([*names[:3], "pan"], "are to be 4 names")):
        with pytest.raises(InputError, match=said):
            read_model(file, ROBOT, wrong)
    file.write_text(text.replace('name="lift"', 'name="lift" type="slide"'))
    with pytest.raises(InputError, match="joint lift slides where the robot's turns, or the other way round"):
        read_model(file, ROBOT, names)


def test_a_urdf_is_a_model_without_its_pictures(tmp_path):
    text = ROBOT.urdf
    picture = '<visual><geometry><mesh filename="package://arm/none.stl"/></geometry></visual></link>'
    rubs = '<joint name="joint_2" type="revolute"><dynamics damping="2.5" friction="1.5"/>'
    text = text.replace("</link>", picture).replace('<joint name="joint_2" type="revolute">', rubs)
    file = tmp_path / "arm.urdf"
    file.write_text(text)
    model = read_model(file, ROBOT)
    assert model.numbers("joint_2") == {"damping": 2.5, "frictionloss": 1.5}
    motion = swing(ROBOT, 1, seconds=2.0)
    expected = rigid_torque(ROBOT, motion)
    expected[:, 1] += 2.5 * motion.dq[:, 1] + 1.5 * np.sign(motion.dq[:, 1])
    np.testing.assert_allclose(model.torque(motion.q, motion.dq, motion.ddq), expected, atol=1e-4)

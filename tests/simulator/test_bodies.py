"""Bodies of a twin in the file of a model: its torque is the twin's, in whatever frames, and what is off is told."""

from __future__ import annotations

import numpy as np
import pytest
from tests import synthetic

from irtwin.effects.drive import RotorInertia
from irtwin.effects.rigid_body import NAMES, RigidBody
from irtwin.robot.model import inverse_dynamics
from irtwin.simulator.bodies import BodiesBeside
from irtwin.simulator.model import read_model
from irtwin.twin.described import text_of
from irtwin.twin.twin import Parameter, Twin

ROBOT = synthetic.arm(4)
WRONG = synthetic.heavier(ROBOT, 1.0, 1.0, 0.6, 1.0)  # of the third link 60 % of the mass
ROTORS = (0.9, 0.8, 0.3, 0.1)
OTHER_FRAMES = """<mujoco><compiler angle="radian"/><worldbody><body name="cart" pos="1 2 3" quat="0.8 0 0 0.6">
<body name="first" pos="0.1 -0.2 0.65" quat="0.5 0.5 0.5 0.5">
 <joint name="joint_1" pos="0.2 -0.3 -0.1" axis="0 1 0"/><inertial pos="0 0 0" mass="3" diaginertia="1 1 1"/>
 <body name="second" pos="0.02 0.32 0.03">
  <joint name="joint_2" pos="0.2 -0.3 -0.1" axis="1 0 0"/><geom size="0.1"/><!-- its inertia is the ball's -->
  <body name="third" pos="0.04 0.29 0.06">
   <joint name="joint_3" pos="0.2 -0.3 -0.1" axis="1 0 0"/><inertial pos="0 0 0" mass="3" diaginertia="1 1 1"/>
   <body name="fourth" pos="0.06 0.26 0.09">
    <joint name="joint_4" pos="0.2 -0.3 -0.1" axis="0 0 1"/>
    <inertial pos="0 0 0" euler="0.1 0 0" mass="3" diaginertia="1 1 1"/>
    <body name="tool" pos="0.1 0 0"><inertial pos="0 0.02 0" mass="0.3" diaginertia="0.001 0.001 0.001"/>
     <body name="finger" pos="0 0 0.1"><joint name="finger" type="slide"/>
      <inertial pos="0 0 0" mass="0.05" diaginertia="0.0001 0.0001 0.0001"/></body></body>
   </body></body></body></body></body></worldbody></mujoco>"""


def twin(robot=ROBOT, rotors=ROTORS):
    bodies = np.array([inertia.toDynamicParameters() for inertia in list(robot.model.inertias)[1:]])
    own = [
        Parameter("rigid_body", joint, f"link_{k + 1}", name, float(value), "kg")
        for k, joint in enumerate(robot.joint_names)
        for name, value in zip(NAMES, bodies[k], strict=True)
    ]
    own += [
        Parameter("rotor_inertia", joint, None, "Ia", value, "kg m^2")
        for joint, value in zip(robot.joint_names, rotors, strict=True)
    ]
    return Twin(robot, (RigidBody(), RotorInertia()), tuple(own), covariance=1e-8 * np.eye(len(own)))


def written(folder, text, ending=".xml"):
    file = folder / f"model{ending}"
    file.write_text(text, encoding="utf-8")
    model = read_model(file, ROBOT)
    beside = BodiesBeside(model, twin())
    assert beside.written, "the file holds them"
    rotors = {model.file.number(joint, "armature")[0]: {"armature": value} for joint, value in beside.rotors.items()}
    file.write_bytes(model.file.changed(rotors, beside.written))
    return read_model(file, ROBOT), beside


def check_torque(model, rotors, digits=9):
    rng = np.random.default_rng(0)
    q, dq, ddq = rng.uniform(-1.5, 1.5, (3, 30, 4))
    alone = inverse_dynamics(ROBOT.model, q, dq, ddq)
    np.testing.assert_allclose(model.torque(q, dq, ddq), alone + ddq * rotors, atol=10.0**-digits * np.abs(alone).max())


@pytest.mark.parametrize("form", ["mjcf", "urdf", "sdf"])
def test_the_written_files_torque_is_the_twins(tmp_path, form):
    text = WRONG.urdf if form == "urdf" else text_of(twin(WRONG, (0.1,) * 4), form)
    model, _ = written(tmp_path, text, {"mjcf": ".xml"}.get(form, f".{form}"))
    check_torque(model, ROTORS if form == "mjcf" else np.zeros(4))


@pytest.mark.parametrize(("mass", "left"), [(0.3, 0.3), (30.0, 0.0)])
def test_what_else_hangs_on_the_robot_stays_if_its_link_is_a_body_without_it(tmp_path, mass, left):
    model, _ = written(tmp_path, OTHER_FRAMES.replace('mass="0.3"', f'mass="{mass}"'))
    check_torque(model, ROTORS)
    assert (model.compiled.body("tool").mass[0], model.compiled.body("finger").mass[0]) == (left, 0.05)


def test_a_usd_has_them_in_its_layer(tmp_path):
    pytest.importorskip("pxr", reason="irtwin[usd] is not installed")
    file = tmp_path / "arm.usda"
    file.write_text(text_of(twin(WRONG), "usd"), encoding="utf-8")
    model = read_model(file, ROBOT)
    layer = tmp_path / "better.usda"
    layer.write_bytes(model.file.changed({}, BodiesBeside(model, twin()).written))
    check_torque(read_model(layer, ROBOT), ROTORS, digits=6)


def test_what_is_off_is_told_by_link(tmp_path):
    file = tmp_path / "arm.xml"
    file.write_text(text_of(twin(WRONG, (0.9, 0.4, 0.3, 0.1)), "mjcf"), encoding="utf-8")
    told = BodiesBeside(read_model(file, ROBOT), twin()).told
    mass, rotor = told
    true = 8.0 / 3
    assert (mass.name, mass.joint, mass.unit) == ("mass (link_3)", "joint_3", "kg")
    assert (mass.simulator, mass.robot, mass.value) == pytest.approx((0.6 * true, true, 0.4 * true))
    assert mass.interval95[0] < mass.value < mass.interval95[1]
    assert (rotor.name, rotor.joint, rotor.simulator, rotor.robot) == ("Ia", "joint_2", 0.4, 0.8)


def test_a_file_whose_inertias_are_made_of_shapes_is_given_none(tmp_path):
    file = tmp_path / "arm.xml"
    text = text_of(twin(WRONG), "mjcf").replace('inertiafromgeom="false"', 'inertiafromgeom="auto" settotalmass="20"')
    file.write_text(text, encoding="utf-8")
    assert BodiesBeside(read_model(file, ROBOT), twin()).written == {}

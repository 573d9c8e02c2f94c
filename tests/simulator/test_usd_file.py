"""Models in USD: written of a twin, read as Newton and PhysX mean them, and changed by a layer over them."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest
from tests import servo_arm
from tests.simulator.test_sdf_file import ONE, pull
from tests.synthetic import arm
from tests.twin.test_described import fitted, of, states, torque

from irtwin.effects.rigid_body import model_of
from irtwin.errors import InputError
from irtwin.planning.plan import nominal_twin
from irtwin.robot.description import Robot
from irtwin.robot.urdf import parse_urdf
from irtwin.simulator.model import read_model
from irtwin.simulator.servos import NAMES, servos
from irtwin.twin.described import text_of

Sdf = pytest.importorskip("pxr.Sdf")
PENDULUM = """#usda 1.0
(
    metersPerUnit = 0.01
    upAxis = "Y"
)
# a rod of 2 kg, 0.5 m long, hung on z
def Xform "arm"
{
    def Xform "base" (prepend apiSchemas = ["PhysicsRigidBodyAPI"])
    {
    }
    def Xform "rod" (prepend apiSchemas = ["PhysicsRigidBodyAPI", "PhysicsMassAPI"])
    {
        float physics:mass = 2
        point3f physics:centerOfMass = (0, -25, 0)
        float3 physics:diagonalInertia = (1000, 100, 1000)
        float3 xformOp:scale = (2, 2, 2)
        uniform token[] xformOpOrder = ["xformOp:scale"]
        def Cube "shape" (prepend apiSchemas = ["PhysicsCollisionAPI"])
        {
        }
    }
    def PhysicsFixedJoint "hold"
    {
        rel physics:body1 = </arm/base>
    }
    def PhysicsRevoluteJoint "swing" (
        prepend apiSchemas = ["PhysicsDriveAPI:angular"]
        displayName = "pan"
    )
    {
        rel physics:body0 = </arm/base>
        rel physics:body1 = </arm/rod>
        uniform token physics:axis = "Z"
        float physics:lowerLimit = -90
        float physics:upperLimit = 180
        float mjc:damping = 2500
        float physxJointAxis:angular:dynamicFrictionEffort = 5000
        float drive:angular:physics:stiffness = 17453.293
        float drive:angular:physics:damping = 174.53293
        float drive:angular:physics:maxForce = 80000
    }
}
"""


def read(folder: Path, text: str = PENDULUM, robot: Robot = ONE, name: str = "arm.usda"):
    file = folder / name
    file.write_text(text, encoding="utf-8")
    return read_model(file, robot)


@pytest.mark.parametrize("slides", [(), (1,)])
def test_a_written_twin_is_read_back_to_single_precision(tmp_path, slides):
    twin, motion = fitted(slides), states(fitted(slides))
    model = read(tmp_path, text_of(twin, "usd"), twin.robot)
    wanted = torque(model_of(twin.robot, of(twin, "rigid_body")), motion) + of(twin, "rotor_inertia") * motion.ddq
    wanted += of(twin, "viscous_friction") * motion.dq + of(twin, "coulomb_friction") * np.sign(motion.dq)
    assert model.torque(motion.q, motion.dq, motion.ddq) == pytest.approx(wanted, abs=3e-7 * np.abs(wanted).max())
    told = {name: [model.numbers(joint)[name] for joint in model.joints] for name in model.numbers(model.joints[0])}
    assert told["damping"] == pytest.approx(of(twin, "viscous_friction"), rel=2e-7)
    assert told["frictionloss"] == pytest.approx(of(twin, "coulomb_friction"), rel=1e-7)
    assert told["armature"] == pytest.approx(of(twin, "rotor_inertia"), rel=1e-7)
    joints = [model.compiled.joint(joint).id for joint in model.joints]
    limits = [(one.lower, one.upper) for one in twin.robot.joints]
    assert model.compiled.jnt_range[joints] == pytest.approx(np.array(limits), rel=1e-6)


def test_units_of_the_stage_become_metres_newtons_and_radians(tmp_path):
    model = read(tmp_path)
    assert pull(model) == pytest.approx(9.81)
    assert model.numbers("pan") == pytest.approx({"armature": 0.0, "damping": 0.25, "frictionloss": 0.5})
    assert model.compiled.body("/arm/rod").inertia == pytest.approx([0.1, 0.1, 0.01])
    assert model.compiled.jnt_range[0] == pytest.approx([-np.pi / 2, np.pi])
    own = servos(model)
    told = dict(zip(NAMES, own.numbers[:, 0], strict=True))
    assert (told["stiffness"], told["torque_limit"]) == pytest.approx((100.0, 8.0))
    assert told["damping"] == pytest.approx(0.25 + 1.0)


def test_an_unchanged_model_is_the_same_bytes_and_a_changed_one_a_layer_over_it(tmp_path):
    own = servos(read(tmp_path))
    assert own.written(own.numbers, np.zeros(own.numbers.shape, dtype=bool)) == (tmp_path / "arm.usda").read_bytes()
    changed = {"stiffness": 120.0, "damping": 2.0, "friction": 0.75, "armature": 0.03, "torque_limit": 6.0}
    robots = servo_arm.changed(own, **changed, delay=0.1, offset=0.2)
    differs = robots != own.numbers
    layer = tmp_path / "better.usda"
    layer.write_bytes(own.written(robots, differs))
    assert own.unwritten(differs) == ["offset of pan", "delay of pan"]
    again = dict(zip(NAMES, servos(read_model(layer, ONE)).numbers[:, 0], strict=True))
    assert {name: again[name] for name in changed} == pytest.approx(changed, rel=1e-6)
    assert pull(read_model(layer, ONE)) == pytest.approx(9.81)
    assert "newton:armature" in layer.read_text() and "newton:damping" not in layer.read_text()
    assert "physics:mass" not in layer.read_text()


def test_a_binary_file_has_a_binary_layer(tmp_path):
    layer = Sdf.Layer.CreateNew(str(tmp_path / "arm.usdc"))
    layer.ImportFromString(PENDULUM)
    layer.Save()
    file = read_model(tmp_path / "arm.usdc", ONE).file
    tag, name = file.number("pan", "armature")
    (tmp_path / "better.usdc").write_bytes(file.changed({tag: {name: 0.5}}))
    assert read_model(tmp_path / "better.usdc", ONE).numbers("pan")["armature"] == 0.5
    for out in (tmp_path / "b.usda", tmp_path / "sub" / "b.usdc"):
        with pytest.raises(InputError, match=r"is to be a layer over .*arm\.usdc; give a file beside that, and with"):
            file.check_written(out)


def test_names_that_usd_does_not_allow_are_kept_for_show(tmp_path):
    robot = parse_urdf(arm(2).urdf.replace('"joint_1"', '"1 joint-é"').replace('"joint_2"', '"1 joint_é"'))
    text = text_of(nominal_twin(robot), "usd")
    assert 'PhysicsRevoluteJoint "_1_joint__"' in text and 'PhysicsRevoluteJoint "_1_joint___0"' in text
    assert read(tmp_path, text, robot).joints == ("1 joint-é", "1 joint_é")


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("#usda 1.0", "#usd 7", r"is no USD that can be read \("),
        ("def Xform", "def Xform {", r"is no USD that can be read \("),
        ("(\n", "(\n    subLayers = [@../o.usda@]\n", r"names \.\./o\.usda, which is out"),
        ('"arm"\n', '"arm" (references = @/etc/passwd@)\n', r"names /etc/passwd, which is outside the folder"),
        ('"arm"\n', '"arm" (payload = @m.usda@)\n', r"names m\.usda, which is missing; put it there"),
        ("body1 = </arm/rod>", "body1 = </arm/none>", r'joint "pan" names /arm/none, which is missing'),
        ("body1 = </arm/base>", "body1 = </arm/rod>", r'link "/arm/rod" is the child of two joints, hold and pan'),
        ("body0 = </arm/base>", "body0 = </arm/rod>", r'joints about link "/arm/rod" form a loop, or lead nowhere'),
        ("def PhysicsRevoluteJoint", "def PhysicsSphericalJoint", r'"pan" is a PhysicsSphericalJoint, which cannot be'),
        ("float physics:mass = 2", "", r"/arm/rod takes its mass from its shapes; give it physics:mass, physics:cen"),
        ('displayName = "pan"', "", r"has no joint pan; its joints are swing: say .*: --joints swing lie"),
        ('axis = "Z"', 'axis = "W"', r'joint "pan" moves along W; give X, Y or Z as its physics:axis'),
        ("float mjc:damping = 2500", 'string mjc:damping = "1"', r'joint "pan" has no number as its mjc:damping'),
        ("mjc:damping = 2500", "mjc:damping = nan", r'joint "pan" has a number that is not finite'),
        ("physics:mass = 2", "physics:mass = inf", r'link "/arm/rod" has a number that is not finite'),
    ],
)
def test_what_cannot_be_read_is_refused_in_a_line(tmp_path, old, new, said, capfd):
    assert old in PENDULUM
    with pytest.raises(InputError, match=said) as error:
        read(tmp_path, PENDULUM.replace(old, new, 1))
    assert "\n" not in str(error.value)
    assert capfd.readouterr().err == ""


def test_files_of_something_else_are_refused(tmp_path):
    with pytest.raises(InputError, match=r"arm\.usdc: is no USD that can be read"):
        read(tmp_path, "PXR-USDC and nothing more", name="arm.usdc")
    (tmp_path / "bytes.usda").write_bytes(b'#usda 1.0\ndef "a" { \xff\xfe }')
    with pytest.raises(InputError, match=r"bytes\.usda: is no USD that can be read \(.*[a-z]"):
        read_model(tmp_path / "bytes.usda", ONE)
    with pytest.raises(InputError, match=r"none\.usd: cannot be read \(No such file"):
        read_model(tmp_path / "none.usd", ONE)


def test_without_its_package_it_is_said_what_to_install(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "pxr", None)
    monkeypatch.delitem(sys.modules, "irtwin.simulator.usd_file", raising=False)
    with pytest.raises(InputError, match=r"arm\.usda: reading USD needs its package; install irtwin\[usd\]"):
        read(tmp_path)

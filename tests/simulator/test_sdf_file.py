"""Models in SDF: read as Gazebo reads them, and written back in single numbers."""

from __future__ import annotations

import numpy as np
import pytest
from tests import servo_arm
from tests.synthetic import arm
from tests.twin.test_described import fitted, of, states, torque

from irtwin.effects.rigid_body import model_of
from irtwin.errors import InputError
from irtwin.identification.progress import telling
from irtwin.robot.description import Robot
from irtwin.robot.urdf import parse_urdf
from irtwin.simulator.model import read_model
from irtwin.simulator.servos import NAMES, has_servos, servos
from irtwin.twin.described import text_of

ONE = parse_urdf(
    '<robot name="one"><link name="base"/><link name="rod"/><joint name="pan" type="continuous">'
    '<parent link="base"/><child link="rod"/><axis xyz="0 1 0"/></joint></robot>'
)
PENDULUM = """<?xml version="1.0"?>
<sdf version="1.9">
  <!-- a rod of 2 kg, 0.5 m long; <damping>7</damping> was here -->
  <model name="one">
    <link name="base"/>
    <joint name="hold" type="fixed"><parent>world</parent><child>base</child></joint>
    <link name="rod">
      <pose>0 0 1 0 0 0</pose>
      <inertial><pose>0 0 -0.5 0 0 0</pose><mass>2</mass>
        <inertia><ixx>0.1</ixx><iyy>0.1</iyy><izz>0.01</izz></inertia></inertial>
    </link>
    <joint name="pan" type="revolute">
      <parent>base</parent><child>rod</child>
      <axis><xyz>0 1 0</xyz><dynamics><damping>0.25</damping></dynamics></axis>
    </joint>
  </model>
</sdf>
"""


def read(folder, text=PENDULUM, robot: Robot = ONE):
    file = folder / "arm.sdf"
    file.write_text(text, encoding="utf-8")
    return read_model(file, robot)


def pull(model) -> float:
    """The torque that holds the rod at a right angle."""
    return float(model.torque(np.array([[np.pi / 2]]), np.zeros((1, 1)), np.zeros((1, 1)))[0, 0])


@pytest.mark.parametrize("slides", [(), (1,)])
def test_a_written_twin_is_read_back(tmp_path, slides):
    twin, motion = fitted(slides), states(fitted(slides))
    model = read(tmp_path, text_of(twin, "sdf"), twin.robot)
    wanted = torque(model_of(twin.robot, of(twin, "rigid_body")), motion)
    wanted += of(twin, "viscous_friction") * motion.dq + of(twin, "coulomb_friction") * np.sign(motion.dq)
    assert model.torque(motion.q, motion.dq, motion.ddq) == pytest.approx(wanted, abs=1e-9)
    told = [model.numbers(joint) for joint in model.joints]
    assert [one["damping"] for one in told] == of(twin, "viscous_friction").tolist()
    assert [one["frictionloss"] for one in told] == of(twin, "coulomb_friction").tolist()


@pytest.mark.parametrize(
    ("old", "new", "held", "axis"),
    [
        ("", "", 9.81, (0, 1, 0)),
        ('<model name="one">', '<model name="one"><pose>0 0 0 0 -1.5707963267948966 0</pose>', 0.0, (0, 1, 0)),
        ("<xyz>0 1 0</xyz>", '<xyz expressed_in="hang">0 1 0</xyz>', 9.81, (0, -1, 0)),
        ('type="revolute">', 'type="revolute"><pose degrees="true">0 0 0.5 0 0 180</pose>', 19.62, (0, -1, 0)),
        ("<pose>0 0 1 0 0 0</pose>", '<pose relative_to="hang">0 0 0.5 0 0 0</pose>', 9.81, (0, 1, 0)),
        ("<pose>0 0 1 0 0 0</pose>", "<pose>0 0 1 0 0 1.5707963267948966</pose>", 9.81, (0, 1, 0)),
        ("<pose>0 0 -0.5 0 0 0", '<pose rotation_format="quat_xyzw">0 0 -0.25 0 0 0 1', 9.81 / 2, (0, 1, 0)),
        ("<parent>base</parent>", "<parent>hang</parent>", 9.81, (0, 1, 0)),
        ("</xyz>", "</xyz><use_parent_model_frame>1</use_parent_model_frame>", 9.81, (0, 1, 0)),
    ],
)
def test_frames_are_what_sdf_means_by_them(tmp_path, old, new, held, axis):
    hang = '<frame name="hang" attached_to="base"><pose>0 0 0.5 0 0 3.141592653589793</pose></frame>\n  </model>'
    assert old in PENDULUM
    model = read(tmp_path, PENDULUM.replace("  </model>", hang).replace(old, new, 1))
    assert pull(model) == pytest.approx(held, abs=1e-9)
    assert model.compiled.jnt_axis[0] == pytest.approx(axis, abs=1e-9)


def test_axes_of_early_versions_are_said_in_the_model(tmp_path):
    turned = PENDULUM.replace("<pose>0 0 1 0 0 0</pose>", "<pose>0 0 1 0 0 1.5707963267948966</pose>")
    assert read(tmp_path, turned.replace('"1.9"', '"1.4"')).compiled.jnt_axis[0] == pytest.approx([1, 0, 0], abs=1e-9)


def test_a_world_says_gravity_and_has_one_robot(tmp_path):
    world = PENDULUM.replace("<model", '<world name="w"><gravity>0 0 -1</gravity><model name="box"/><model', 1)
    assert pull(read(tmp_path, world.replace("</model>\n", "</model></world>"))) == pytest.approx(1.0)


def test_limits_of_angle_and_effort_are_the_models(tmp_path):
    limits = "<limit><lower>-1</lower><upper>2</upper><effort>5</effort></limit><dynamics>"
    compiled = read(tmp_path, PENDULUM.replace("<dynamics>", limits)).compiled
    assert (compiled.jnt_range[0].tolist(), compiled.jnt_actfrcrange[0].tolist()) == ([-1, 2], [-5, 5])
    endless = limits.replace("-1<", "-1e16<").replace("2<", "inf<").replace("5<", "-1<")
    compiled = read(tmp_path, PENDULUM.replace("<dynamics>", endless)).compiled
    assert not compiled.jnt_limited[0] and not compiled.jnt_actfrclimited[0]


def test_changed_numbers_alone_differ(tmp_path):
    file = read(tmp_path).file
    assert file.changed({}) == PENDULUM.encode()
    assert file.holds("damping") and not file.holds("armature")
    (pan, damping), (same, friction) = (file.number("pan", name) for name in ("damping", "frictionloss"))
    assert pan is same
    new = file.changed({pan: {damping: 1 / 3, friction: 0.5}}).decode()
    assert new == PENDULUM.replace(
        "<damping>0.25</damping></dynamics>", f"<damping>{1 / 3!r}</damping><friction>0.5</friction></dynamics>"
    )
    assert read(tmp_path, new).numbers("pan") == {"damping": 1 / 3, "frictionloss": 0.5}
    bare = read(tmp_path, PENDULUM.replace("<dynamics><damping>0.25</damping></dynamics>", "")).file
    new = bare.changed({bare.number("pan", "damping")[0]: {"damping": 2.0}}).decode()
    assert new == PENDULUM.replace("0.25", "2.0")


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("<sdf", "<!DOCTYPE sdf [<!ENTITY a 'b'>]><sdf", r"line 2: declares a document type; remove it"),
        ("</sdf>", "", r"line \d+, column 1: no element found; mend the XML"),
        ("<damping>0.25</damping>", "<dampening>1</dampening>", r"<dynamics> has <dampening>, which SDF does not know"),
        ("0.25", "much", r'joint "pan": dynamics/damping: "much" should be 1 finite number'),
        ("0 0 1 0 0 0", "0 0 1", r"rod: pose: \"0 0 1\" should be 6 finite numbers"),
        ('type="revolute"', 'type="screw"', r'joint "pan": type "screw" cannot be modelled; use revolute, continuous'),
        ("<pose>0 0 1", '<pose relative_to="nowhere">0 0 1', r'has no frame "nowhere", which another is said in'),
        ("<pose>0 0 1", '<pose relative_to="pan">0 0 1', r'frame "\w+" is said in itself'),
        ("<child>rod</child>", "<child>arm</child>", r'has no link "arm", which a joint names'),
        ("<child>base</child>", "<child>rod</child>", r'link "rod" is the child of two joints, hold and pan'),
        ("<parent>base</parent>", "<parent>rod</parent>", r'the joints about link "rod" form a loop, or lead nowhere'),
        ("<inertial>", '<inertial auto="true">', r'link "rod": its inertia is that of its shapes \(auto\); give'),
        ("<mass>2", "<mass>0", r"arm\.sdf: .*mass and inertia of moving bodies.*; MuJoCo cannot load it so"),
        ("<link ", "<include><uri>model://x</uri></include><link ", r"its model has <include>; write it out whole"),
        ("<link ", "<include><uri>file:///etc/passwd</uri></include><link ", r"its model has <include>; write it out"),
        ("</sdf>", PENDULUM[PENDULUM.index("<model") :], r"has 2 models with joints \(one, one\); give a file of the"),
        ('"pan"', '"lift"', r"has no joint pan; its joints are lift: say .*: --joints lift lie as these do"),
        ("<model", "<group", r"mismatched tag"),
    ],
)
def test_what_cannot_be_read_is_refused_in_a_line(tmp_path, old, new, said):
    assert old in PENDULUM
    with pytest.raises(InputError, match=said) as error:
        read(tmp_path, PENDULUM.replace(old, new, 1))
    assert "\n" not in str(error.value)


def test_a_file_without_a_model_is_refused(tmp_path):
    with pytest.raises(InputError, match=r"has 0 models with joints"):
        read(tmp_path, "<sdf version='1.9'/>")


@pytest.mark.slow
def test_long_chains_and_large_files_are_refused(tmp_path):
    links = "".join(f'<link name="l{k}"/>' for k in range(3000))
    joints = "".join(
        f'<joint name="j{k}" type="fixed"><parent>l{k}</parent><child>l{k + 1}</child></joint>' for k in range(2999)
    )
    with pytest.raises(InputError, match="a chain of more than 500 links cannot be modelled"):
        read(tmp_path, f'<sdf version="1.9"><model name="m">{links}{joints}</model></sdf>', arm(2))
    (tmp_path / "big.sdf").write_bytes(b" " * 20_000_001)
    with pytest.raises(InputError, match="larger than the 20 MB limit"):
        read_model(tmp_path / "big.sdf", ONE)


CONTROLLED = PENDULUM.replace(
    "  </model>",
    """    <plugin filename="gz-sim-joint-position-controller-system" name="gz::sim::systems::JointPositionController">
      <joint_name>pan</joint_name> <!-- gains of the maker -->
      <p_gain>100</p_gain><i_gain>0</i_gain><d_gain>4</d_gain><cmd_max>30</cmd_max><cmd_min>-30</cmd_min>
    </plugin>
  </model>""",
)


def test_a_position_controller_is_a_servo(tmp_path):
    own = servos(read(tmp_path, CONTROLLED))
    told = dict(zip(NAMES, own.numbers[:, 0], strict=True))
    assert (told["stiffness"], told["torque_limit"]) == (100.0, 30.0)
    assert told["damping"] == pytest.approx(0.25 + 4.0)
    assert own.lead(own.numbers) == pytest.approx([4 / 100])  # its damping is of the error


def test_what_a_controller_does_besides_is_told(tmp_path):
    heard: list[str] = []
    with telling(heard.append):
        read(tmp_path, CONTROLLED)
        read(tmp_path, CONTROLLED.replace("<i_gain>0<", "<i_gain>0.5<"))
    assert len(heard) == 1 and "i_gain" in heard[0] and heard[0].endswith("of pan are not played")


def test_a_controller_has_the_gains_that_gazebo_takes_by_itself(tmp_path):
    said = "<p_gain>100</p_gain><i_gain>0</i_gain><d_gain>4</d_gain><cmd_max>30</cmd_max><cmd_min>-30</cmd_min>"
    old = CONTROLLED.replace(said, "").replace("gz::sim", "ignition::gazebo")
    told = dict(zip(NAMES, servos(read(tmp_path, old)).numbers[:, 0], strict=True))
    assert (told["stiffness"], told["torque_limit"]) == (1.0, 1000.0)
    assert told["damping"] == pytest.approx(0.25 + 0.01)


@pytest.mark.parametrize("other", ["<use_velocity_commands>true</use_velocity_commands>", "<p_gain>0</p_gain>"])
def test_a_controller_that_does_not_pull_to_a_position_is_no_servo(tmp_path, other):
    text = CONTROLLED.replace("<p_gain>100</p_gain>", other)
    assert not has_servos(read(tmp_path, text))


def test_gains_are_written_into_their_controller(tmp_path):
    own = servos(read(tmp_path, CONTROLLED))
    assert own.written(own.numbers, np.zeros(own.numbers.shape, dtype=bool)) == CONTROLLED.encode()
    changed = {"stiffness": 120.0, "damping": 5.0, "friction": 0.75, "torque_limit": 20.0}
    robots = servo_arm.changed(own, **changed, delay=0.1, offset=0.2, armature=0.1)
    differs = robots != own.numbers
    text = own.written(robots, differs).decode()
    assert own.unwritten(differs) == ["armature of pan", "offset of pan", "delay of pan"]
    again = dict(zip(NAMES, servos(read(tmp_path, text)).numbers[:, 0], strict=True))
    assert {name: again[name] for name in changed} == pytest.approx(changed, rel=1e-12)
    assert "<cmd_min>-20.0</cmd_min>" in text and "<!-- gains of the maker -->" in text and "<i_gain>0</i_gain>" in text

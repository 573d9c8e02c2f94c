"""The ROS package of a robot: what its readers find in it."""

from __future__ import annotations

import math
import re
import runpy
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from types import ModuleType
from typing import Any
from xml.etree import ElementTree

import pinocchio
import pytest
from hypothesis import given, settings
from tests import mesh_robots, synthetic
from tests.fuzz.drawn_robots import RobotPlan, robots, urdf
from tests.providers.test_robot_of_graph import BRANCHED
from tests.ros.test_description import ODD
from tests.virtual.scene_data import kr6

from irtwin.errors import InputError
from irtwin.identification.motion_limits import JointLimits
from irtwin.robot.structure import structure_of
from irtwin.robot.urdf import parse_urdf, read_urdf
from irtwin.ros.ros_package import write_package

NAME = "kuka_kr6_r700_description"


@pytest.fixture(scope="module")
def package(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("ros") / "kr6"
    assert write_package(kr6(), folder) == []
    return folder


def xml(file: Path) -> ElementTree.Element:
    return ElementTree.parse(file).getroot()


def test_it_holds_what_ros_looks_for(package: Path) -> None:
    files = {file.relative_to(package).as_posix() for file in package.rglob("*") if file.is_file()}
    assert files == {
        *("package.xml", "CMakeLists.txt", ".setup_assistant", "urdf/KUKA_KR6_R700.urdf"),
        *("config/KUKA_KR6_R700.srdf", "config/joint_limits.yaml", "config/kinematics.yaml"),
        *("launch/display.launch", "launch/display.launch.py", "launch/planning_context.launch"),
        *("rviz/KUKA_KR6_R700.rviz", "rviz/KUKA_KR6_R700_ros2.rviz"),
    }


def test_every_file_that_a_file_names_is_there(package: Path) -> None:
    for launch in package.glob("launch/*.launch"):
        named = re.findall(rf"\$\(find {NAME}\)/([\w./]+)", launch.read_text())
        assert named
        assert all((package / name).is_file() for name in named)
    setup = (package / ".setup_assistant").read_text()
    assert re.findall("package: (.+)", setup) == [NAME, NAME]
    places = re.findall("relative_path: (.+)", setup)
    assert len(places) == 4
    assert all((package / place).is_file() for place in places)


def test_meshes_of_one_name_lie_apart(tmp_path: Path) -> None:
    meshes = {"a/arm.stl": b"1", "package://b/Arm.STL": b"2", "päckchen 1.dae": b"3", "p_ckchen_1.dae": b"4"}
    write_package(mesh_robots.robot(), tmp_path / "p", meshes)
    files = [file.name for file in (tmp_path / "p" / "meshes").iterdir()]
    assert len({name.lower() for name in files}) == len(files) == 4
    assert all(re.fullmatch(r"[A-Za-z0-9_]+\.(stl|dae)", name) for name in files)


def test_its_manifest_serves_both(package: Path) -> None:
    manifest = xml(package / "package.xml")
    assert manifest.findtext("name") == NAME
    kinds = {element.get("condition"): element.text for element in manifest.iter("build_type")}
    assert kinds == {"$ROS_VERSION == 1": "catkin", "$ROS_VERSION == 2": "ament_cmake"}
    assert f"project({NAME})" in (package / "CMakeLists.txt").read_text()


def test_its_urdf_is_the_robot(package: Path) -> None:
    robot = read_urdf(package / "urdf" / "KUKA_KR6_R700.urdf")
    assert robot.joints == kr6().joints
    assert structure_of(robot) == structure_of(kr6())


def test_moveit_finds_group_home_and_pairs(package: Path) -> None:
    semantics = xml(package / "config" / "KUKA_KR6_R700.srdf")
    assert semantics.get("name") == "KUKA_KR6_R700"
    chain = semantics.find("group[@name='manipulator']/chain")
    assert chain.attrib == {"base_link": "base_link", "tip_link": "flange"}
    state = {joint.get("name"): joint.get("value") for joint in semantics.iterfind("group_state/joint")}
    assert state == {f"joint_a{axis}": "0.0" for axis in range(1, 7)}
    listed = [pair.attrib for pair in semantics.iter("disable_collisions")]
    pairs = {(pair["link1"], pair["link2"]): pair["reason"] for pair in listed}
    assert pairs["link_1", "link_2"] == "Adjacent"
    assert pairs["base_link", "link_2"] == "Never"
    assert ("base_link", "link_5") not in pairs


def test_another_reader_of_srdf_finds_each_name_in_the_urdf(package: Path) -> None:
    urdf, srdf = (str(package / name) for name in ("urdf/KUKA_KR6_R700.urdf", "config/KUKA_KR6_R700.srdf"))
    model = pinocchio.buildModelFromUrdf(urdf)
    bodies = pinocchio.buildGeomFromUrdf(model, urdf, pinocchio.GeometryType.COLLISION)
    bodies.addAllCollisionPairs()
    pinocchio.loadReferenceConfigurations(model, srdf, False)
    assert [entry.key() for entry in model.referenceConfigurations] == ["home"]
    home = model.referenceConfigurations["home"]
    assert ((model.lowerPositionLimit <= home) & (home <= model.upperPositionLimit)).all()
    before = len(bodies.collisionPairs)
    pinocchio.removeCollisionPairs(model, bodies, srdf, False)
    listed = [pair.attrib for pair in xml(package / "config" / "KUKA_KR6_R700.srdf").iter("disable_collisions")]
    links = {frame.name for frame in model.frames if frame.type == pinocchio.FrameType.BODY}
    assert {pair[end] for pair in listed for end in ("link1", "link2")} <= links
    assert 0 < len(bodies.collisionPairs) < before
    data = pinocchio.GeometryData(bodies)
    assert not pinocchio.computeCollisions(model, model.createData(), bodies, data, home, False)


def test_limits_of_acceleration_are_those_that_plans_keep_to(tmp_path: Path) -> None:
    robot = kr6()
    first, second, *others = robot.joints
    given = replace(first, acceleration=12.5), replace(second, velocity=math.inf)
    last = replace(others.pop(), velocity=1e-5)
    write_package(replace(robot, joints=(*given, *others, last)), tmp_path)
    text = (tmp_path / "config" / "joint_limits.yaml").read_text()
    one, two, three = (text[text.index(f"  joint_a{number}:") :].splitlines()[1:5] for number in (1, 2, 3))
    assert one[1:] == ["    max_velocity: 6.283185", "    has_acceleration_limits: true", "    max_acceleration: 12.5"]
    assert [line.strip() for line in two] == [
        *("has_velocity_limits: false", "max_velocity: 0.0"),
        *("has_acceleration_limits: false", "max_acceleration: 0.0"),
    ]
    assert "    max_velocity: 0.000010000000" in text  # with an exponent YAML takes it for text
    assert three[3] == f"    max_acceleration: {JointLimits.of(robot).acceleration[2]}"


def test_a_branched_robot_has_a_group_of_all_joints(tmp_path: Path) -> None:
    write_package(parse_urdf(BRANCHED), tmp_path)
    semantics = xml(tmp_path / "config" / "two_hands.srdf")
    joints = [joint.get("name") for joint in semantics.iterfind("group[@name='all_joints']/joint")]
    assert sorted(map(str, joints)) == ["a_right", "turn", "z_left"]
    assert {joint.get("name") for joint in semantics.iterfind("group_state/joint")} == {"turn", "a_right"}


def test_a_joint_may_have_the_name_of_the_flange(tmp_path: Path) -> None:
    write_package(synthetic.arm(3), tmp_path)  # whose last joint and link are both called flange
    assert ' tip_link="flange"' in (tmp_path / "config" / "arm_3.srdf").read_text()


def test_a_robot_with_odd_names_and_no_shapes_is_written_and_told(tmp_path: Path) -> None:
    said = write_package(parse_urdf(ODD.replace("collision", "visual")), tmp_path)
    assert 'robot "Zelle 1/b" is Zelle_1_b in ROS' in said
    assert said[-1] == (
        "no link has collision shapes of boxes, cylinders or spheres: MoveIt checks nothing against the robot"
    )
    assert "disable_collisions" not in (tmp_path / "config" / "Zelle_1_b.srdf").read_text()


def check_urdf(package: Path) -> None:
    """Check that ROS' own parser takes a package's URDF, and that its other files are well-formed."""
    for file in [*package.glob("*/*.srdf"), *package.glob("*/*.launch"), package / "package.xml"]:
        xml(file)
    (file,) = (package / "urdf").iterdir()
    program = Path(sys.executable).with_name("check_urdf")  # comes with Pinocchio
    done = subprocess.run([program, file], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "Successfully Parsed XML" in done.stdout
    assert "rror" not in done.stderr


@pytest.mark.slow
@pytest.mark.parametrize("text", [ODD, BRANCHED, kr6().urdf])
def test_ros_own_parser_takes_the_urdf(text: str, tmp_path: Path) -> None:
    write_package(parse_urdf(text), tmp_path)
    check_urdf(tmp_path)


@pytest.mark.slow
@settings(max_examples=15)
@given(plan=robots(large=False))
def test_ros_own_parser_takes_any_robot_that_we_take(plan: RobotPlan) -> None:
    with tempfile.TemporaryDirectory() as folder:
        try:
            robot = parse_urdf(urdf(plan))
        except InputError:
            return
        write_package(robot, Path(folder) / "package")
        check_urdf(Path(folder) / "package")


def test_a_title_cannot_break_out_of_the_manifest(tmp_path: Path) -> None:
    write_package(parse_urdf(ODD.replace("Zelle 1/b", "&lt;/description&gt;&amp;")), tmp_path)
    assert str(xml(tmp_path / "package.xml").findtext("description")).startswith("</description>&: ")


@pytest.mark.slow
def test_a_package_is_written_again_but_no_other_folder(package: Path, tmp_path: Path) -> None:
    write_package(kr6(), package)
    (tmp_path / "thesis.tex").touch()
    with pytest.raises(InputError, match=f"is there already, and is no ROS package {NAME}; name a new folder"):
        write_package(kr6(), tmp_path)
    file = tmp_path / "thesis.tex"
    with pytest.raises(InputError, match="is there already"):
        write_package(kr6(), file)


@pytest.fixture
def ros2(package: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """What a ROS 2 launch file imports, each call kept as (name, arguments)."""

    def kept(name: str) -> Any:
        return lambda *given, **named: (name, given, named)

    names = {
        "ament_index_python.packages": {"get_package_share_directory": lambda name: str(package)},
        "launch": {"LaunchDescription": lambda parts: parts},
        "launch.actions": {"DeclareLaunchArgument": kept("argument")},
        "launch.conditions": {"IfCondition": kept("if")},
        "launch.substitutions": {"LaunchConfiguration": kept("value")},
        "launch_ros.actions": {"Node": kept("node")},
    }
    for place, parts in names.items():
        for whole in (place.partition(".")[0], place):
            if whole not in sys.modules:
                monkeypatch.setitem(sys.modules, whole, ModuleType(whole))
        vars(sys.modules[place]).update(parts)
    yield


@pytest.mark.usefixtures("ros2")
def test_the_launch_file_of_ros_2_starts_its_nodes(package: Path) -> None:
    parts = runpy.run_path(str(package / "launch" / "display.launch.py"))["generate_launch_description"]()
    nodes = {named["executable"]: named for name, _, named in parts if name == "node"}
    assert set(nodes) == {"joint_state_publisher_gui", "robot_state_publisher", "rviz2"}
    (parameters,) = nodes["robot_state_publisher"]["parameters"]
    assert parameters["robot_description"] == (package / "urdf" / "KUKA_KR6_R700.urdf").read_text()
    assert Path(nodes["rviz2"]["arguments"][1]).is_file()

"""A robot by its table of joints in dataset.toml."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tests import data_sets, synthetic

from irtwin.errors import InputError
from irtwin.robot.chain_table import table_of
from irtwin.robot.denavit_hartenberg import ChainTable, Row, from_table
from irtwin.robot.kinematics import placements
from irtwin.signals.log import read_data_set, read_robot

SCARA = """[robot]
name = "Scara"
[robot.dh]
convention = "standard"
base = [0.0, 0.0, 0.4, 0.0, 0.0, 1.5]
tool = [0.0, 0.0, 0.05, 0.0, 0.0, 0.0]
[[robot.dh.row]]
name = "shoulder"
a = 0.325
lower = -2.0
upper = 2.0
velocity = 4.0
effort = 60
mass = 4.5
com = [-0.1, 0.0, 0.02]
inertia = [0.01, 0.05, 0.05, 0.0, 0.001, 0.0]
[[robot.dh.row]]
name = "elbow"
a = 0.275
alpha = 3.141592653589793
theta = 0.1
type = "continuous"
[[robot.dh.row]]
type = "prismatic"
d = 0.1
lower = 0.0
upper = 0.2
mass = 0.5
[robot.joint.elbow]
gear_ratio = 50.0
"""


def written(folder: Path, text: str) -> Path:
    folder.mkdir(exist_ok=True)
    (folder / "dataset.toml").write_text(text, encoding="utf-8")
    return folder


def test_a_robot_is_read_from_its_table(tmp_path):
    robot = read_robot(written(tmp_path, SCARA))
    assert robot == read_robot(tmp_path / "dataset.toml")
    assert robot.joint_names == ("shoulder", "elbow", "joint_3")
    assert [joint.kind for joint in robot.joints] == ["revolute", "continuous", "prismatic"]
    assert (robot.joints[0].lower, robot.joints[0].velocity, robot.joints[0].effort) == (-2.0, 4.0, 60.0)
    assert robot.joints[1].gear_ratio == 50.0
    reach = 0.325 + 0.275 * np.exp(0.1j)
    turned = reach * np.exp(1.5j)
    place = placements(robot, np.array([[0.0, 0.0, 0.02]]))[0]
    assert place[:3, 3] == pytest.approx([turned.real, turned.imag, 0.4 - 0.12 - 0.05], abs=1e-12)
    rows = table_of(robot).rows
    assert rows[0].mass == pytest.approx(4.5)
    assert rows[0].com == pytest.approx((-0.1, 0.0, 0.42))  # `table_of` starts at the floor
    assert rows[0].inertia == pytest.approx((0.01, 0.05, 0.05, 0.0, 0.001, 0.0))
    assert rows[2].inertia == (0.0,) * 6  # a point


def test_a_data_set_needs_no_urdf(tmp_path):
    robot = from_table("Two", ChainTable((Row(0.4, 0.3, 0.0), Row(0.3, 0.0, 0.1))))
    run = synthetic.as_run(synthetic.measure(robot, synthetic.swing(robot, 1, seconds=2.0)))
    folder = data_sets.write(tmp_path / "set", robot, [replace(run, signals=replace(run.signals, current=None))])
    text = (folder / "dataset.toml").read_text()
    first, second = "[[robot.dh.row]]\na = 0.4\nalpha = 0.3\n", "[[robot.dh.row]]\na = 0.3\nd = 0.1\n"
    rows = f"[robot.dh]\nconvention = 'standard'\n{first}{second}"
    (folder / "dataset.toml").write_text(text.replace('urdf = "robot.urdf"', "").replace("[[run]]", f"{rows}[[run]]"))
    (folder / "robot.urdf").unlink()
    data_set = read_data_set(folder)
    assert data_set.robot.joint_names == robot.joint_names
    assert len(data_set.runs) == 1
    assert "dh" not in data_set.notes


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('convention = "standard"', "", r"\[robot.dh\] convention is missing; use standard or modified"),
        ('"standard"', '"craig"', r'\[robot.dh\] convention = "craig"; use'),
        ('name = "Scara"', 'name = "Scara"\nurdf = "robot.urdf"', "has both urdf and dh"),
        ("[robot.dh]\n", "[robot.dh]\nconvenion = 1\n", "convenion is not known; did you mean conv"),
        ("a = 0.325", "r = 0.325", r"\[\[robot.dh.row\]\] 1 r is not known; it may have name, type"),
        ("a = 0.325", 'a = "0.325"', r"\[\[robot.dh.row\]\] 1 a should be a number"),
        ("a = 0.325", "a = nan", r"\[\[robot.dh.row\]\] 1 a should be a number, not nan"),
        ("a = 0.325", "a = 3250", "1 a = 3250 m is beyond 1e[+]03 m"),
        ("alpha = 3.14", "alpha = 180 # ", "2 alpha = 180 rad is beyond 12.6 rad"),
        ('"prismatic"', '"linear"', '3 type = "linear"; use revolute, continuous, prismatic'),
        ("lower = -2.0", "", "1 lower is missing"),
        ("lower = -2.0", "lower = 3.0", "1 lower = 3 lies above upper = 2"),
        ('type = "continuous"', 'type = "continuous"\nlower = 1', "2: a continuous joint has no lower or upper limit"),
        ("mass = 4.5", "", "1 mass is missing; com and inertia say nothing without it"),
        ("mass = 4.5", "mass = -4.5", "1 mass should be a number of at least 0, not -4.5"),
        ("com = [-0.1, ", "com = [", "1 com should be 3 numbers"),
        ("inertia = [0.01", "inertia = [-0.01", "1 inertia: a moment of inertia cannot be negative"),
        ("base = [0.0, ", "base = [", r"\[robot.dh\] base should be 6 numbers \(x, y, z in m and roll"),
        ('name = "elbow"', 'name = "shoulder"', 'two joints are named "shoulder"'),
        ("[robot.joint.elbow]", "[robot.joint.wrist]", r"\[robot.joint.wrist\]: the robot has no moving joint"),
    ],
)
def test_faults_are_named(tmp_path, old, new, message):
    assert old in SCARA
    with pytest.raises(InputError, match=message):
        read_robot(written(tmp_path, SCARA.replace(old, new, 1)))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("[robot]\nname = 'a'\ndh = 3", r"\[robot.dh\] should be a table"),
        ("[robot]\nname = 'a'\n[robot.dh]\nconvention = 'modified'", r"\[\[robot.dh.row\]\] is missing"),
        ("[robot]\nname = 'a'\n[robot.dh]\nconvention = 'modified'\nrow = [3]", "1 should be a table"),
        (
            "[robot]\nname = 'a'\n[robot.dh]\nconvention = 'standard'\n" + "[[robot.dh.row]]\n" * 101,
            "101 rows; a robot has at most 100",
        ),
        ("[robot]\nname = 'a'\n", r"\[robot\] urdf is missing; name the URDF, or describe the joints"),
    ],
)
def test_tables_that_are_none_are_named(tmp_path, text, message):
    with pytest.raises(InputError, match=message):
        read_robot(written(tmp_path, text))

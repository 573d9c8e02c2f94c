"""`irtwin robot` as a newcomer meets it."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import numpy as np
import pytest
from tests.data_sets import irtwin

from irtwin import resources
from irtwin.robot.kinematics import placements
from irtwin.robot.urdf import read_urdf

KR6 = resources.folder("ontology") / "robots" / "kuka_kr6_r700.urdf"
PENDULUM = """[robot]
name = "Pendulum"
[robot.dh]
convention = "standard"
base = [0.0, 0.0, 0.0, 1.5707963267948966, 0.0, 0.0]
[[robot.dh.row]]
name = "swing"
a = 0.5
mass = 2.0
"""


@pytest.fixture
def pendulum(tmp_path: Path) -> Path:
    (tmp_path / "dataset.toml").write_text(PENDULUM, encoding="utf-8")
    return tmp_path


def test_a_table_is_printed_with_units():
    said = irtwin("robot", "dh", KR6)
    assert (said.status, said.err) == (0, "")
    title, head, first, *_ = said.out.splitlines()
    assert title.startswith("KUKA_KR6_R700, base to ")
    assert "standard convention (theta, d, a, alpha)" in title
    assert head.split("  ")[0] == "joint"
    assert first.split() == ["joint_a1", "0.025", "1.57079633", "90", "-0.4", "q", "0"]
    assert "e-16 m and" in said.out.splitlines()[-1]


def test_a_table_as_json_makes_the_same_robot(tmp_path):
    document = json.loads(irtwin("robot", "dh", KR6, "--convention", "modified", "--link", "link_4", "--json").out)
    assert [row["joint"] for row in document["rows"]] == ["joint_a1", "joint_a2", "joint_a3", "joint_a4"]
    assert document["differs_by_m"] < 1e-12
    place = np.array(document["base"])
    for row in document["rows"]:
        ca, sa, ct, st = (f(row[f"{k}_rad"]) for k in ("alpha", "theta") for f in (np.cos, np.sin))
        a, d = row["a_m"], row["d_m"]
        place = place @ np.array(
            [[ct, -st, 0, a], [st * ca, ct * ca, -sa, -d * sa], [st * sa, ct * sa, ca, d * ca], [0, 0, 0, 1]]
        )
    assert place @ np.array(document["tool"]) == pytest.approx(
        placements(read_urdf(KR6), np.zeros((1, 6)), "link_4")[0], abs=1e-12
    )


def test_a_table_becomes_a_urdf_and_is_found_in_it(pendulum, tmp_path):
    out = tmp_path / "pendulum.urdf"
    said = irtwin("robot", "urdf", pendulum, "--out", out)
    assert (said.status, said.out.strip()) == (0, str(out))
    assert irtwin("robot", "dh", out).out == irtwin("robot", "dh", pendulum / "dataset.toml").out
    assert irtwin("robot", "urdf", KR6, "--out", out).status == 0
    assert out.read_text(encoding="utf-8") == KR6.read_text(encoding="utf-8")


def test_a_pose_is_printed_and_found_again():
    q = ["0.1", "-1.2", "1.4", "-.3", "-1e-1", "0.2"]
    said = irtwin("robot", "fk", KR6, *q)
    assert [line.split("  ")[0] for line in said.out.splitlines()][:4] == [
        "x, y, z, m",
        "roll, pitch, yaw, rad",
        "quaternion x, y, z, w",
        "rotation matrix",
    ]
    document = json.loads(irtwin("robot", "fk", KR6, *q, "--json").out)
    assert np.linalg.det(document["rotation"]) == pytest.approx(1.0)
    pose = [*document["position_m"], *document["rpy_rad"]]
    found = irtwin("robot", "ik", KR6, "--pose", *pose, "--from", ",".join(q), "--json")
    assert list(json.loads(found.out)[0].values()) == pytest.approx([float(each) for each in q], abs=1e-6)
    table = irtwin("robot", "ik", KR6, "--pose", *pose)
    assert table.out.splitlines()[0].startswith("joint_a1, rad  joint_a2, rad")
    assert len(table.out.splitlines()) == 1 + len(json.loads(found.out))


def test_poses_of_a_file_are_csv(tmp_path):
    file = tmp_path / "q.csv"
    head = ["time", *(f"q_joint_a{n}" for n in (2, 1, 3, 4, 5, 6))]
    file.write_text("\n".join([",".join(head), "0,-1,0.2,1,0,0,0", "0.1,-1.1,0.3,1,0,0,0"]), encoding="utf-8")
    said = irtwin("robot", "fk", KR6, "--file", file)
    assert said.status == 0
    rows = list(csv.DictReader(said.out.splitlines()))
    expected = placements(read_urdf(KR6), np.array([[0.2, -1, 1, 0, 0, 0], [0.3, -1.1, 1, 0, 0, 0]]))
    assert [[float(row[key]) for key in ("x_m", "y_m", "z_m")] for row in rows] == pytest.approx(expected[:, :3, 3])
    assert len(json.loads(irtwin("robot", "fk", KR6, "--file", file, "--json").out)) == 2


def test_a_position_out_of_the_limits_is_said_and_answered():
    said = irtwin("robot", "fk", KR6, 0, 1.5, 0, 0, 0, 0)
    assert said.status == 0
    assert "joint_a2 is at 1.5 rad, outside its limits -3.31613 to 0.785398" in said.err


def test_the_torque_of_a_pendulum_is_printed(pendulum):
    said = irtwin("robot", "equations", pendulum)
    assert said.out.splitlines()[:4] == [
        "# tau1: swing, N m; q1 in rad",
        "tau1 =",
        "  + 0.5*ddq1",
        "  + 9.81*cos(q1)",
    ]
    assert "These equations and Pinocchio differ by" in said.err
    assert r"\ddot{q}_{1}" in irtwin("robot", "equations", pendulum, "--joint", "swing", "--latex").out


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["dh", "nowhere.urdf"], "nowhere.urdf: cannot be read"),
        (["dh", "nowhere/dataset.toml"], "nowhere: there is no such file or folder"),
        (["dh", KR6, "--link", "hand"], 'has no link "hand"'),
        (["dh", KR6, "--convention", "craig"], "'craig' is not one of"),
        (["urdf", KR6, "--out", KR6 / "robot.urdf"], "robot.urdf: cannot be written"),
        (["fk", KR6], "give joint positions, or --file"),
        (["fk", KR6, "1", "--file", "q.csv"], "give joint positions, or --file, not both"),
        (["fk", KR6, "1", "2"], "has 6 moving joints (joint_a1, joint_a2"),
        (["fk", KR6, "1", "2", "3", "nan", "5", "6"], "the position of joint_a4 is nan"),
        (["fk", KR6, "--file", "nowhere.csv"], "nowhere.csv: cannot be read"),
        (["ik", KR6, "--pose", 9, 0, 0, 0, 0, 0], "out of reach: within its joint limits the flange comes no nearer"),
        (["ik", KR6, "--pose", 0.4, 0, "inf", 0, 0, 0], "--pose: give six finite numbers"),
        (["ik", KR6, "--pose", 0.4, 0, 0.5, 0, 0, 0, "--from", "1,a"], '--from: "1,a" should be numbers'),
        (["ik", KR6, "--pose", 0.4, 0, 0.5, 0, 0, 0, "--from", "1,2"], "and 2 positions were given"),
        (["equations", KR6], "6 joints move; equations are written for 3 or fewer"),
        (["equations", KR6, "--joint", "wrist"], 'no moving joint "wrist"'),
    ],
)
def test_a_mistake_is_one_line(arguments, message, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    said = irtwin("robot", *arguments)
    assert said.status == 2
    assert message in said.err
    assert said.out == ""
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "line 1: there is no column q_swing"),
        ("q_other\n1\n", "line 1: there is no column q_swing"),
        ("q_swing\n", "has no joint positions below its first line"),
        ("q_swing\n1\nx\n", "line 3: a joint position is no number"),
        ("time,q_swing\n1\n", "line 2: a joint position is no number"),
        ("q_swing\ninf\n", "line 2: a joint position is not finite"),
        (b"\xff\xfe", "not UTF-8 text"),
    ],
)
def test_a_damaged_file_of_positions_is_named(pendulum, text, message):
    file = pendulum / "q.csv"
    file.write_bytes(text if isinstance(text, bytes) else text.encode())
    said = irtwin("robot", "fk", pendulum, "--file", file)
    assert (said.status, message in said.err) == (2, True), said.err

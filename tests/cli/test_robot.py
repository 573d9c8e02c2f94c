"""`irtwin robot` as a newcomer meets it."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from tests.data_sets import done, irtwin, refused

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
    document = json.loads(done("robot", "dh", KR6, "--convention", "modified", "--link", "link_4", "--json"))
    assert [row["joint"] for row in document["rows"]] == ["joint_a1", "joint_a2", "joint_a3", "joint_a4"]
    assert document["differs_by_m"] < 1e-12
    place = np.array(document["base"])
    for row in document["rows"]:
        ca, sa, ct, st = (f(row[f"{k}_rad"]) for k in ("alpha", "theta") for f in (np.cos, np.sin))
        a, d = row["a_m"], row["d_m"]
        place = place @ np.array(
            [[ct, -st, 0, a], [st * ca, ct * ca, -sa, -d * sa], [st * sa, ct * sa, ca, d * ca], [0, 0, 0, 1]]
        )
    (known,) = placements(read_urdf(KR6), np.zeros((1, 6)), "link_4")
    assert place @ np.array(document["tool"]) == pytest.approx(known, abs=1e-12)


def test_a_table_becomes_a_urdf_and_is_found_in_it(pendulum, tmp_path):
    out = tmp_path / "pendulum.urdf"
    assert done("robot", "urdf", pendulum, "--out", out) == f"{out}\n"
    assert done("robot", "dh", out) == done("robot", "dh", pendulum / "dataset.toml")
    assert "is there already, and no model is written over" in refused("robot", "urdf", KR6, "--out", out)
    out = tmp_path / "kr6.urdf"
    done("robot", "urdf", KR6, "--out", out)
    assert out.read_text(encoding="utf-8") == KR6.read_text(encoding="utf-8")


def test_the_torque_of_a_pendulum_is_printed(pendulum):
    said = irtwin("robot", "equations", pendulum)
    assert said.out.startswith("# tau1: swing, N m; q1 in rad\ntau1 =\n  + 0.5*ddq1\n  + 9.81*cos(q1)\n")
    assert "These equations and Pinocchio differ by" in said.err
    assert r"\ddot{q}_{1}" in done("robot", "equations", pendulum, "--joint", "swing", "--latex")


@pytest.mark.slow
def test_the_torque_of_six_joints_is_a_list_of_short_formulas():
    pytest.importorskip("sympy")
    said = done("robot", "equations", KR6)
    assert "# tau6: joint_a6, N m; q6 in rad" in said
    assert "\nc2 = cos(q2)\n" in said and "\ntau6 = " in said
    alone = done("robot", "equations", KR6, "--joint", "joint_a6", "--latex")
    assert alone.startswith("% tau6") and r"\tau_{6} = " in alone and r"\tau_{5}" not in alone


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["dh", "nowhere.urdf"], "nowhere.urdf: cannot be read"),
        (["dh", "nowhere/dataset.toml"], "nowhere: there is no such file or folder"),
        (["dh", KR6, "--link", "hand"], 'has no link "hand"'),
        (["dh", KR6, "--convention", "craig"], "'craig' is not one of"),
        (["urdf", KR6, "--out", KR6 / "robot.urdf"], "robot.urdf: cannot be written"),
        (["equations", KR6, "--joint", "wrist"], 'no moving joint "wrist"'),
    ],
)
def test_a_mistake_is_one_line(arguments, message, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert message in refused("robot", *arguments)
    assert list(tmp_path.iterdir()) == []

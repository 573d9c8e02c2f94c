"""Denavit-Hartenberg tables: robots from them, and they from robots."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tests.robot.chains import chains

from irtwin import resources
from irtwin.errors import InputError
from irtwin.robot.chain_table import deviation, table_of
from irtwin.robot.denavit_hartenberg import CONVENTIONS, ChainTable, Row, from_table
from irtwin.robot.description import Robot
from irtwin.robot.kinematics import placements
from irtwin.robot.urdf import parse_urdf, read_urdf

# Universal Robots UR10, as the maker publishes it
UR10 = (
    Row(0.0, np.pi / 2, 0.1273),
    Row(-0.612, 0.0, 0.0),
    Row(-0.5723, 0.0, 0.0),
    Row(0.0, np.pi / 2, 0.163941),
    Row(0.0, -np.pi / 2, 0.1157),
    Row(0.0, 0.0, 0.0922),
)
# Franka Panda, as the maker publishes it, with the flange's row added to the last
PANDA = (
    Row(0.0, 0.0, 0.333),
    Row(0.0, -np.pi / 2, 0.0),
    Row(0.0, np.pi / 2, 0.316),
    Row(0.0825, np.pi / 2, 0.0),
    Row(-0.0825, -np.pi / 2, 0.384),
    Row(0.0, np.pi / 2, 0.0),
    Row(0.088, np.pi / 2, 0.107),
)
MEASURED = Path(__file__).parents[3] / "shared/data"
EXACT = 1e-12  # m, and an element of a rotation matrix


def standard(row: Row, angle: float) -> np.ndarray:
    """The textbook's matrix, written out."""
    t, a = row.theta + angle, row.alpha
    return np.array(
        [
            [np.cos(t), -np.sin(t) * np.cos(a), np.sin(t) * np.sin(a), row.a * np.cos(t)],
            [np.sin(t), np.cos(t) * np.cos(a), -np.cos(t) * np.sin(a), row.a * np.sin(t)],
            [0.0, np.sin(a), np.cos(a), row.d],
            [0.0, 0.0, 0.0, 1.0],
        ]
    )


def modified(row: Row, angle: float) -> np.ndarray:
    t, a = row.theta + angle, row.alpha
    return np.array(
        [
            [np.cos(t), -np.sin(t), 0.0, row.a],
            [np.sin(t) * np.cos(a), np.cos(t) * np.cos(a), -np.sin(a), -row.d * np.sin(a)],
            [np.sin(t) * np.sin(a), np.cos(t) * np.sin(a), np.cos(a), row.d * np.cos(a)],
            [0.0, 0.0, 0.0, 1.0],
        ]
    )


def poses(robot: Robot) -> np.ndarray:
    return np.random.default_rng(1).uniform(-2.0, 2.0, (5, len(robot.joints)))


def check_same(robot: Robot, convention: str, tip: str | None = None) -> ChainTable:
    """The robot, its table, and the robot of its table have the flange in one place."""
    table = table_of(robot, convention, tip)
    q = poses(robot)
    places = placements(robot, q, tip)
    names = [robot.index(name) for name in table.joint_names]
    assert np.abs(np.array([table.flange(row[names]) for row in q]) - places).max() < EXACT
    assert np.abs(placements(from_table("again", table), q[:, names]) - places).max() < EXACT
    assert max(deviation(robot, table, tip)) < EXACT
    return table


@pytest.mark.parametrize(("convention", "matrix"), [("standard", standard), ("modified", modified)])
@given(q=st.lists(st.floats(-3.0, 3.0), min_size=6, max_size=6))
def test_the_flange_is_where_the_product_of_matrices_puts_it(convention, matrix, q):
    table = ChainTable(UR10, convention)
    product = np.eye(4)
    for row, angle in zip(UR10, q, strict=True):
        product = product @ matrix(row, angle)
    assert np.abs(table.flange(q) - product).max() < EXACT
    assert np.abs(placements(from_table("UR10", table), np.array([q]))[0] - product).max() < EXACT


@pytest.mark.slow
@pytest.mark.parametrize("convention", CONVENTIONS)
@settings(max_examples=25)
@given(urdf=chains())
def test_a_chain_its_table_and_the_robot_of_its_table_agree(convention, urdf):
    robot = parse_urdf(urdf)
    table = check_same(robot, convention)
    assert table.joint_names == robot.joint_names
    again = from_table("again", table)
    data, other = robot.model.createData(), again.model.createData()
    for q in poses(robot):  # the bodies are the same as well
        torque = pin.rnea(robot.model, data, q, 0.5 * q, -q)
        assert pin.rnea(again.model, other, q, 0.5 * q, -q) == pytest.approx(torque, rel=1e-9, abs=1e-9)


@pytest.mark.parametrize("said", [ChainTable(UR10), ChainTable(PANDA, "modified")])
def test_a_makers_table_is_found_again(said):
    found = table_of(from_table("found", said), said.convention)
    for row, expected in zip(found.rows, said.rows, strict=True):
        assert (row.a, row.alpha, row.d, row.theta) == pytest.approx((expected.a, expected.alpha, expected.d, 0.0))
    assert found.base == pytest.approx(np.eye(4))
    assert found.tool == pytest.approx(np.eye(4), abs=1e-15)


@pytest.mark.parametrize("convention", CONVENTIONS)
def test_the_kr6_has_its_makers_dimensions(convention):
    robot = read_urdf(resources.folder("ontology") / "robots" / "kuka_kr6_r700.urdf")
    table = check_same(robot, convention, "tool0")
    assert sorted({round(abs(row.a), 6) for row in table.rows}) == [0.0, 0.025, 0.035, 0.315]
    assert sorted({round(abs(row.d), 6) for row in table.rows}) == [0.0, 0.08, 0.365, 0.4]
    assert [(row.lower, row.upper) for row in table.rows] == [(joint.lower, joint.upper) for joint in robot.joints]


def test_a_table_ends_at_any_link_of_a_branched_robot():
    fork = """<robot name="fork"><link name="base"/><link name="left"/><link name="right"/><link name="hand"/>
      <joint name="a" type="continuous"><parent link="base"/><child link="left"/><origin xyz="0 1 0"/></joint>
      <joint name="b" type="continuous"><parent link="base"/><child link="right"/><axis xyz="0 1 0"/></joint>
      <joint name="c" type="continuous"><parent link="right"/><child link="hand"/><origin xyz="0.3 0 0"/></joint>
    </robot>"""
    robot = parse_urdf(fork)
    assert check_same(robot, "standard", "left").joint_names == ("a",)
    assert check_same(robot, "modified", "hand").joint_names == ("b", "c")
    with pytest.raises(InputError, match='no joint moves the link "base"'):
        table_of(robot, "standard", "base")
    with pytest.raises(InputError, match='has no link "foot"'):
        table_of(robot, "standard", "foot")


def test_angles_that_a_file_rounds_count_as_parallel_and_the_cost_is_known():
    rows = (Row(0.4, 1e-6, 0.1), Row(0.3, 0.0, 0.0))
    robot = from_table("rounded", ChainTable(rows))
    table = table_of(robot)
    assert table.rows[0].alpha == 0.0
    assert abs(table.rows[0].d) < 1.0
    far, turned = deviation(robot, table)
    assert 1e-8 < far < 1e-6
    assert 1e-7 < turned < 2e-6


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: from_table("none", ChainTable(())), "has no row"),
        (lambda: table_of(from_table("UR10", ChainTable(UR10)), "khalil"), 'no Denavit-Hartenberg convention "khalil"'),
    ],
)
def test_faults_are_named(make, message):
    with pytest.raises(InputError, match=message):
        make()


@pytest.mark.system
@pytest.mark.skipif(not MEASURED.exists(), reason="the measured data are not here")
@pytest.mark.parametrize("convention", CONVENTIONS)
@pytest.mark.parametrize("name", ["franka_panda", "ur10", "staubli_tx40"])
def test_measured_robots_and_their_tables_agree(name, convention):
    check_same(read_urdf(MEASURED / name / "robot.urdf"), convention)

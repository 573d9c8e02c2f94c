from __future__ import annotations

from math import pi

import numpy as np
import pytest
from tests.identification.arms import kr6
from tests.synthetic import AXES, arm, swing

from irtwin.effects.catalogue import BASELINE, catalogue
from irtwin.effects.stack import Stack
from irtwin.identification.base_parameters import base_parameters, condition_number
from irtwin.robot.urdf import parse_urdf


def chain(frames):
    """A robot from (origin, roll, axis) per joint, with one inertia for all."""
    parts = ['<link name="base"/>']
    for k, (origin, roll, axis) in enumerate(frames):
        parts.append(
            f'<link name="l{k}"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/>'
            f'</inertial></link><joint name="j{k}" type="revolute"><parent link="{"base" if k == 0 else f"l{k - 1}"}"/>'
            f'<child link="l{k}"/><origin xyz="{origin}" rpy="{roll} 0 0"/><axis xyz="{axis}"/></joint>'
        )
    return parse_urdf(f'<robot name="chain">{"".join(parts)}</robot>')


UR10 = chain(
    [
        ("0 0 0", 0, "0 0 1"),
        ("0 0 0.1273", pi / 2, "0 0 1"),
        ("-0.612 0 0", 0, "0 0 1"),
        ("-0.5723 0 0", 0, "0 0 1"),
        ("0 0 0.163941", pi / 2, "0 0 1"),
        ("0 0 0.1157", -pi / 2, "0 0 1"),
    ]
)
PUMA = chain(
    [
        ("0 0 0", 0, "0 0 1"),
        ("0 0.15 0", 0, "0 1 0"),
        ("0.43 0 0", 0, "0 1 0"),
        ("0.02 0 0.43", 0, "0 0 1"),
        ("0 0 0", 0, "0 1 0"),
        ("0 0 0", 0, "0 0 1"),
    ]
)


# Gautier and Khalil 1990: an arm of n revolute joints, the first one vertical and followed by a perpendicular one,
# has 7 n - 4 base parameters, less 2 where the second axis is parallel to the third: of links whose axes stay
# parallel to a fixed plane. A first vertical axis shows Izz alone: 6 R arms keep 36.
@pytest.mark.parametrize("robot, count", [(kr6(), 36), (UR10, 36), (PUMA, 36), (arm(7), 43), (arm(1), 1)])
def test_number_of_inertial_base_parameters(robot, count):
    assert len(base_parameters(Stack(robot, ["rigid_body"])).independent) == count


def test_one_joint_under_gravity_shows_inertia_and_two_moments():
    robot = chain([("0 0 0", 0, "0 1 0")])
    base = base_parameters(Stack(robot, ["rigid_body", "rotor_inertia"]))
    assert base.names() == ("mx_l0", "mz_l0", "Iyy_l0 + Ia_j0")


def test_rotor_inertia_is_grouped_only_where_it_cannot_be_told_apart():
    base = base_parameters(Stack(kr6(), ["rigid_body", "rotor_inertia"]))
    # of six rotor inertias, those of the first two joints show like their links' own (their axes never turn apart)
    assert len(base.independent) == 40
    grouped = [name for name in base.names() if " Ia_" in name]
    assert sum(name.count("Ia_") for name in grouped) == 2


def test_friction_and_offset_are_always_told_apart():
    assert len(base_parameters(Stack(kr6(), BASELINE)).independent) == 40 + 18


@pytest.mark.parametrize("robot", [arm(4), arm(6), arm(7), arm(4, slides=(2,))], ids=["4", "6", "7", "slide"])
def test_base_regressor_predicts_the_same_torque(robot):
    stack = Stack(robot, BASELINE)
    base = base_parameters(stack)
    rng = np.random.default_rng(0)
    values = rng.standard_normal(len(stack.torque_terms))
    columns = stack.torque_columns(swing(robot, 5, seconds=1))
    np.testing.assert_allclose(
        columns[:, :, base.independent] @ (base.grouping @ values), columns @ values, rtol=1e-6, atol=1e-6
    )


def test_names_are_readable():
    names = base_parameters(Stack(UR10, ["rigid_body"])).names()
    assert "mx_l1 - 0.612 m_l2 - 0.612 m_l3 - 0.612 m_l4 - 0.612 m_l5" in names
    assert all(names)


def test_condition_number_of_what_a_motion_shows():
    stack = Stack(arm(2), ["rigid_body"])
    base = base_parameters(stack)
    columns = stack.torque_columns(swing(arm(2), 1)).reshape(-1, len(stack.torque_terms))
    rich = condition_number(columns, base)
    poor = condition_number(columns[:40], base)
    assert 1 < rich < poor
    assert condition_number(np.zeros_like(columns), base) == np.inf


def test_where_nothing_makes_torque_there_is_nothing_to_tell_apart():
    none = base_parameters(Stack(kr6(), [catalogue()["standby_power"]]))
    assert none.independent.shape == (0,)
    assert condition_number(np.zeros((3, 0)), none) == 1.0


def test_seven_axes_are_named():
    assert len(AXES) == 7

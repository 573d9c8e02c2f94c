"""Names that ROS takes."""

from __future__ import annotations

import re

from hypothesis import given
from hypothesis import strategies as st

from irtwin.robot.ros_names import ros_names, ros_package


def test_a_valid_name_stays_and_any_other_is_made_valid() -> None:
    made = ros_names(["joint_1", "Achse 2", "Höhe", "3rd", "関節", "a-b", "a.b"], "joint")
    assert list(made.values()) == ["joint_1", "Achse_2", "Hohe", "joint_3rd", "joint", "a_b", "a_b_2"]


def test_a_long_name_is_cut() -> None:
    assert ros_names(["n" * 250, "n" * 251], "joint") == {"n" * 250: "n" * 100, "n" * 251: "n" * 100 + "_2"}


def test_a_made_name_is_none_that_another_has() -> None:
    assert ros_names(["a b", "a_b", "a-b"], "joint") == {"a b": "a_b_2", "a_b": "a_b", "a-b": "a_b_3"}


@given(st.lists(st.text(max_size=12), max_size=8))
def test_names_are_valid_and_stay_apart(names: list[str]) -> None:
    made = ros_names(names, "link")
    assert made.keys() == set(names)
    assert len(set(made.values())) == len(made)
    assert all(re.fullmatch("[A-Za-z][A-Za-z0-9_]*", name) for name in made.values())


@given(st.text(max_size=20))
def test_a_package_has_a_name_that_catkin_and_colcon_take(robot: str) -> None:
    assert re.fullmatch("[a-z](_?[a-z0-9])+", ros_package(robot))


def test_a_package_is_named_by_its_robot() -> None:
    assert ros_package("KUKA_KR6_R700") == "kuka_kr6_r700_description"

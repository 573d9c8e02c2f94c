"""Robots from Denavit-Hartenberg tables."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.flange import flange_position

from irtwin.errors import InputError
from irtwin.robot.denavit_hartenberg import Row, from_table

# Universal Robots UR10, as the maker publishes it
UR10 = (
    Row(0.0, np.pi / 2, 0.1273),
    Row(-0.612, 0.0, 0.0),
    Row(-0.5723, 0.0, 0.0),
    Row(0.0, np.pi / 2, 0.163941),
    Row(0.0, -np.pi / 2, 0.1157),
    Row(0.0, 0.0, 0.0922),
)


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


@pytest.mark.slow
@pytest.mark.parametrize(("convention", "is_modified"), [(standard, False), (modified, True)])
@given(q=st.lists(st.floats(-3.0, 3.0), min_size=6, max_size=6))
def test_the_flange_is_where_the_product_of_matrices_puts_it(convention, is_modified, q):
    robot = from_table("UR10", UR10, modified=is_modified)
    product = np.eye(4)
    for row, angle in zip(UR10, q, strict=True):
        product = product @ convention(row, angle)
    assert np.allclose(flange_position(robot, np.array([q]))[0], product[:3, 3], atol=1e-9)


def test_an_empty_table_is_refused():
    with pytest.raises(InputError, match="has no row"):
        from_table("none", ())

"""Equations of motion in symbols."""

from __future__ import annotations

import sys

import numpy as np
import pytest
from hypothesis import given, settings
from tests.robot.chains import chains
from tests.synthetic import arm

from irtwin.errors import InputError
from irtwin.robot.denavit_hartenberg import ChainTable, Row, from_table
from irtwin.robot.equations import equations
from irtwin.robot.urdf import parse_urdf


@pytest.mark.slow
@settings(max_examples=5)
@given(urdf=chains(most=3))
def test_they_are_those_of_newton_and_euler(urdf):
    assert equations(parse_urdf(urdf)).deviation < 1e-9


@pytest.fixture
def sympy():
    """Imported where it is used: it takes half a second."""
    return pytest.importorskip("sympy")


def test_a_pendulum_is_a_pendulum(sympy):
    row = Row(0.5, 0.0, 0.0, mass=2.0, inertia=(0.0,) * 6)
    lying = ((0, 0, 1, 0), (1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 0, 1))  # z, the axis, along the base's x
    found = equations(from_table("pendulum", ChainTable((row,), base=np.array(lying, dtype=float))))
    q, ddq = sympy.symbols("q1 ddq1")
    off = found.torque(0) - (2.0 * 0.25 * ddq + 2.0 * 9.81 * 0.5 * sympy.cos(q))
    assert max(map(abs, off.as_coefficients_dict().values())) < 1e-12
    assert found.text(0) == "tau1 =\n  + 0.5*ddq1\n  + 9.81*cos(q1)"
    assert found.latex(0) == r"\tau_{1} = 0.5 \ddot{q}_{1} + 9.81 \cos{\left(q_{1} \right)}"


def test_parts_are_sums_of_waves(sympy):
    found = equations(arm(3))
    assert found.mass == found.mass.T
    assert found.mass[0, 0].has(sympy.cos(2 * sympy.Symbol("q2") + sympy.Symbol("q3")))  # no product of cosines
    assert found.gravity[0] == 0
    assert found.text(1).count("\n") > 4


def test_a_joint_that_slides_has_a_force(sympy):
    found = equations(arm(2, slides=(1,)))
    assert found.deviation < 1e-9
    assert found.mass[0, 0].has(sympy.Symbol("q2") ** 2)


def test_a_large_robot_is_refused():
    with pytest.raises(InputError, match="4 joints move; equations are written out for 3 or fewer"):
        equations(arm(4))


def test_a_missing_library_is_said(monkeypatch):
    monkeypatch.setitem(sys.modules, "sympy", None)
    with pytest.raises(InputError, match=r"pip install \"irtwin\[symbolic\]\""):
        equations(arm(2))

"""Torque of longer robots in symbols, by Newton and Euler's recursion."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from tests.robot.chains import chains
from tests.synthetic import arm

from irtwin.robot.recursive_equations import recursive_equations
from irtwin.robot.urdf import parse_urdf

pytest.importorskip("sympy")


@pytest.mark.slow
@settings(max_examples=10, deadline=None)
@given(urdf=chains(most=7))
def test_they_are_those_of_pinocchio(urdf):
    assert recursive_equations(parse_urdf(urdf)).deviation < 1e-8


@pytest.mark.slow
def test_six_joints_take_few_short_formulas():
    found = recursive_equations(arm(6))
    assert found.deviation < 1e-9
    assert len(found.steps) < 250
    assert max(len(line) for line in found.text().splitlines()) < 300


def test_each_step_is_made_before_it_is_used_and_each_is_needed():
    found = recursive_equations(arm(6, slides=(3,)))
    inputs = {f"{sign}{n}" for sign in ("q", "dq", "ddq") for n in range(1, 7)}
    known, used = set(inputs), set()
    for name, formula in (*found.steps, *found.torques):
        symbols = {str(symbol) for symbol in formula.free_symbols}
        assert symbols <= known
        known.add(str(name))
        used |= symbols
    assert {str(name) for name, _ in found.steps} <= used


@pytest.mark.slow
def test_the_last_joint_alone_takes_fewer_steps():
    found = recursive_equations(arm(6))
    last = found.alone(5)
    assert [str(name) for name, _ in last.torques] == ["tau6"]
    assert len(last.steps) < len(found.steps)
    assert r"\ddot{q}_{6}" in last.latex()

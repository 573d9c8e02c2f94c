"""Physically consistent bodies, as near to what torque asks for as any."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from tests import synthetic

from irtwin.effects.stack import Stack
from irtwin.identification.consistent_bodies import described_bodies, spreads, with_consistent_bodies
from irtwin.identification.estimators import Estimate
from irtwin.identification.fits import fit_torque
from irtwin.robot.pseudo_inertia import consistent, inertial_parameters, pseudo_inertias
from irtwin.robot.urdf import parse_urdf

EFFECTS = ("rigid_body", "rotor_inertia", "viscous_friction")
ROBOT = synthetic.arm(2)
STACK = Stack(ROBOT, EFFECTS)
TERMS = STACK.torque_terms
OWN = np.arange(20).reshape(2, 10)


def estimate(values: np.ndarray, sure: np.ndarray) -> Estimate:
    """Values that are known each by itself, to a standard deviation of `sure`."""
    equations = np.column_stack([np.diag(1 / sure), values / sure])
    return Estimate(values, np.diag(sure**2), np.ones(2), 10, equations, np.ones((10, 2)))


def described() -> np.ndarray:
    values = np.zeros(len(TERMS))
    values[OWN] = inertial_parameters(described_bodies(STACK))
    return values


def test_what_is_consistent_and_sure_stays() -> None:
    values = described()
    values[OWN] *= 1.3
    found = with_consistent_bodies(STACK, TERMS, estimate(values, np.full(len(values), 1e-6)))
    assert found.values == pytest.approx(values, abs=1e-8)


def test_what_is_not_consistent_becomes_so() -> None:
    values = described()
    values[9] = 3 * (values[4] + values[6])  # Izz beyond Ixx + Iyy
    assert consistent(values[OWN]).tolist() == [False, True]
    found = with_consistent_bodies(STACK, TERMS, estimate(values, np.full(len(values), 1e-3)))
    assert consistent(found.values[OWN]).all()
    least, *_, most = np.linalg.eigvalsh(pseudo_inertias(found.values[OWN])[0])
    assert least < 1e-4 * most  # the nearest one is at the edge


def test_what_data_leave_open_is_as_described() -> None:
    values = described()
    sure = np.full(len(values), 1e3)
    values[0] += 50.0
    found = with_consistent_bodies(STACK, TERMS, estimate(values, sure))
    assert found.values[OWN] == pytest.approx(described()[OWN], rel=1e-2, abs=1e-4)


def test_bounds_hold() -> None:
    values = described()
    values[-4:] = [0.5, 0.5, 0.0, 0.2]  # rotors, friction; one on its bound
    sure = np.full(len(values), 1e-3)
    given = estimate(values, sure)
    found = with_consistent_bodies(STACK, TERMS, given)
    assert found.values[-4:] == pytest.approx(values[-4:])
    pushed = replace(given, equations=given.equations + 0.0)
    pushed.equations[-1, -1] = -1.0  # friction wants to be less than nothing
    assert with_consistent_bodies(STACK, TERMS, pushed).values[-1] == 0.0


@pytest.mark.parametrize(
    ("effects", "least", "most"), [((*EFFECTS, "coulomb_friction", "torque_offset"), 0.0, 1e-6), (EFFECTS, 0.01, 0.1)]
)
def test_torque_changes_where_bodies_stood_in_for_effects(effects: tuple[str, ...], least: float, most: float) -> None:
    robot = synthetic.arm(3)
    motions = [synthetic.measure(robot, synthetic.swing(robot, seed, seconds=6.0), noise=0.05) for seed in (1, 2)]
    stack = Stack(robot, effects)
    _, free = fit_torque(stack, motions)
    found = with_consistent_bodies(stack, stack.torque_terms, free)
    assert consistent(found.values[:30].reshape(-1, 10)).all()
    before, after = (
        np.concatenate([stack.shown_torque(motion, values) for motion in motions])
        for values in (free.values, found.values)
    )
    assert least < np.linalg.norm(after - before) / np.linalg.norm(before) < most


def test_a_robot_without_bodies_gets_consistent_ones() -> None:
    bare = parse_urdf(
        '<robot name="bare"><link name="a"/><link name="b"/><link name="c">'
        '<inertial><mass value="2"/><inertia ixx="0" ixy="0" ixz="0" iyy="0" iyz="0" izz="0"/></inertial></link>'
        '<joint name="j" type="revolute"><parent link="a"/><child link="b"/>'
        '<limit lower="-1" upper="1" effort="9" velocity="9"/></joint>'
        '<joint name="k" type="revolute"><parent link="b"/><child link="c"/><origin xyz="0 0 .3"/>'
        '<limit lower="-1" upper="1" effort="9" velocity="9"/></joint></robot>'
    )
    found = inertial_parameters(described_bodies(Stack(bare, EFFECTS)))
    assert consistent(found).all()
    assert found[1, 0] == 2.0


def test_what_the_description_says_of_bodies_is_known_before_data() -> None:
    known = np.array([term.spread for _, term in TERMS])
    found = spreads(STACK, TERMS)
    assert (found[:20] < known[:20]).any() and (found[:20] <= known[:20]).all()
    assert found[20:].tolist() == known[20:].tolist()


def test_what_has_no_bodies_stays() -> None:
    stack = Stack(ROBOT, ("viscous_friction",))
    given = estimate(np.array([1.0, 2.0]), np.ones(2))
    assert with_consistent_bodies(stack, stack.torque_terms, given) is given

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from typing import ClassVar

import numpy as np
import pytest
from tests.synthetic import arm, measure, swing, with_constants

from irtwin.effects.effect import Effect, Term
from irtwin.effects.stack import Stack
from irtwin.identification.power_line import power_line, power_slope, rows_of_both

ROBOT = with_constants(arm(3))
MOTION = swing(ROBOT, 1, seconds=2.0)
EFFECTS = ("rigid_body", "coulomb_friction", "torque_offset", "mechanical_power", "standby_power", "copper_loss")


@dataclass(frozen=True)
class Together(Effect):
    """The square of the sum of all torques: no joint's own."""

    id: ClassVar[str] = "together"
    channel: ClassVar[str] = "power"
    signal: ClassVar[str] = "power"
    needs: ClassVar[str | None] = "torque"

    def terms(self, robot):
        return (Term("k", "W/(N m)^2"),)

    def columns(self, robot, motion, predicted=None):
        return predicted.torque.sum(axis=1, keepdims=True) ** 2


@pytest.mark.parametrize("extra", [(), (Together(),)], ids=["of joints", "of the robot"])
def test_slope_is_speed_and_twice_the_losses(extra):
    stack = Stack(ROBOT, [*EFFECTS, *extra])
    torque = np.random.default_rng(0).uniform(-40, 40, MOTION.dq.shape)
    values = np.array([1, 1, 1, 90.0, 0.5, 1.0, 2.0, *([0.1] if extra else [])])
    expected = MOTION.dq + 2 * np.array([0.5, 1.0, 2.0]) * torque / 8.0**2
    if extra:
        expected += 2 * 0.1 * torque.sum(axis=1, keepdims=True)
    np.testing.assert_allclose(power_slope(stack, MOTION, torque, values), expected, atol=1e-6)


def test_a_line_meets_power_where_it_is_taken_and_touches_it_beside():
    stack = Stack(ROBOT, EFFECTS)
    rng = np.random.default_rng(1)
    coefficients = np.array([term.expected for _, term in stack.torque_terms]) + rng.uniform(
        0, 1, len(stack.torque_terms)
    )
    free = np.array([90.0, 0.5, 1.0, 2.0])
    values = np.concatenate([np.ones(3), free])
    loaded = replace(MOTION, payload_mass=2.0, payload_com=(0.1, 0.0, 0.0))

    def power(of):
        return stack.predicted_power_columns(loaded, of) @ values

    torque = stack.real_torque(loaded, coefficients)
    now = stack.power_columns(loaded, torque)
    line = power_line(stack, loaded, partial(stack.carried, loaded), torque, now, values)

    def said(of):
        return line.carried @ of[stack.real] + line.free @ free + line.known

    np.testing.assert_allclose(said(coefficients), power(coefficients), rtol=1e-9)
    told = power_line(stack, loaded, partial(stack.carried, loaded), torque, now, values, np.ones((1, 3), dtype=bool))
    assert not told.carried.any()
    np.testing.assert_allclose(told.free @ free + told.known, power(coefficients), rtol=1e-9)
    step = 1e-5 * rng.uniform(-1, 1, len(coefficients))
    change = power(coefficients + step) - power(coefficients - step)
    np.testing.assert_allclose(said(coefficients + step) - said(coefficients - step), change, atol=1e-7)


def test_what_was_not_measured_is_undecided():
    stack = Stack(ROBOT, EFFECTS)
    full = measure(ROBOT, MOTION)
    samples = len(full.time)
    known = np.zeros((samples, 3)), np.zeros(samples)
    columns = [[np.zeros((samples, 1))]] * 4
    rows = rows_of_both(stack, replace(full, power=None), columns, known)
    assert rows.undecided[:, 3].all() and not rows.undecided[:, :3].all()
    rows = rows_of_both(stack, replace(full, torque=None), columns, known)
    assert rows.undecided[:, :3].all() and not rows.undecided[:, 3].any()
    np.testing.assert_array_equal(rows.measured[:, 3], full.power)
    braking = full.power < full.power.mean()
    np.testing.assert_array_equal(rows_of_both(stack, full, columns, known, braking).undecided[:, 3], braking)

"""How much of a gap is closed, on groups whose squares are known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from tests.synthetic import arm, measure, swing

from irtwin.effects.effect import Predicted
from irtwin.effects.load import ExternalContact
from irtwin.effects.stack import Stack
from irtwin.gap.regression.channel_equations import torque_system
from irtwin.gap.regression.groups import Grouping
from irtwin.gap.regression.held_out import HeldOut, closed_fraction, left_out
from irtwin.gap.regression.moments import Summed

FLOOR = np.array([1.0])


def judged(before, after):
    """One row a group, so that squares are mean squares."""
    return HeldOut(np.asarray(before, float), np.asarray(after, float), np.ones(np.shape(before)))


def test_what_lies_above_the_floor_counts():
    value, interval = closed_fraction([(judged([[5.0]] * 4, [[2.0]] * 4), FLOOR)], seed=0)
    assert value == pytest.approx(0.75)
    assert interval == pytest.approx([0.75, 0.75])


def test_an_equation_without_a_gap_has_nothing_to_close():
    with_one = judged([[5.0, 0.4]] * 4, [[2.0, 0.4]] * 4)
    value, _ = closed_fraction([(with_one, np.array([1.0, 1.0]))], seed=0)
    assert value == pytest.approx(0.75)
    assert closed_fraction([(judged([[0.4]] * 4, [[0.4]] * 4), FLOOR)], seed=0) is None


def test_no_more_than_all_is_closed():
    value, (_, upper) = closed_fraction([(judged([[5.0], [4.0]], [[0.5], [0.6]]), FLOOR)], seed=0)
    assert value == upper == 1.0


@pytest.mark.slow
def test_the_interval_covers_the_truth_nineteen_times_in_twenty():
    generator = np.random.default_rng(3)
    covered = []
    for _ in range(200):
        gap = generator.lognormal(1.0, 0.7, (6, 1))
        left = 0.2 * gap * generator.uniform(0.5, 1.5, gap.shape)
        _, (lower, upper) = closed_fraction([(judged(1 + gap, 1 + left), FLOOR)], seed=0)
        covered.append(lower <= 0.8 <= upper)
    assert 0.90 <= np.mean(covered) <= 0.98


def equations(touch, runs):
    """The equations of torque of an arm of which a contact is a candidate, and the columns of this."""
    robot = arm(3)
    motions = [
        replace(measure(robot, swing(robot, seed), noise=0.1, seed=seed), run=run) for seed, run in enumerate(runs)
    ]
    stack = Stack(robot, ("rigid_body", "coulomb_friction", "viscous_friction"))
    grouping = Grouping({run: run for run in runs}, frozenset(runs))
    system = torque_system(stack, motions, grouping, [touch], lambda whole: Predicted(whole.q))
    return system, list(range(system.base, system.base + 3))


def test_what_acts_for_a_while_is_not_foretold_by_the_part_of_it_that_is_left():
    system, force = equations(ExternalContact(8.0, 12.0, runs=("one",)), ["one"])
    noise, every = system.noise_before, np.arange(system.groups)
    touched = [g for g in every if np.any(left_out(system, noise, force, [g]) != left_out(system, noise, (), [g]))]
    assert len(touched) >= 2  # groups of time: the fit of the others is a little another
    moments = system.group_moments(noise)
    for group in every:
        alone = system.solution(force, Summed(moments), moments[group])
        alone[force] = 0.0
        np.testing.assert_allclose(
            left_out(system, noise, force, [group])[0], system.squares(alone, int(group)), rtol=1e-9
        )


def test_what_acts_for_a_while_in_other_runs_too_is_foretold_by_these():
    runs = ["one", "two", "three", "four"]
    system, force = equations(ExternalContact(8.0, 12.0, runs=("one", "two")), runs)
    moments = system.group_moments(system.noise_before)
    for group in range(2):
        alone = system.solution(force, Summed(moments), moments[group])
        assert np.all(alone[force] != 0)
        np.testing.assert_allclose(
            left_out(system, system.noise_before, force, [group])[0], system.squares(alone, group), rtol=1e-9
        )

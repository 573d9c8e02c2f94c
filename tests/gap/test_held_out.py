"""What a fit leaves of groups that are left out of it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from tests.synthetic import arm, measure, swing

from irtwin.effects.effect import Predicted
from irtwin.effects.load import ExternalContact
from irtwin.effects.stack import Stack
from irtwin.gap.regression.channel_equations import torque_system
from irtwin.gap.regression.groups import Grouping
from irtwin.gap.regression.held_out import left_out
from irtwin.gap.regression.moments import Summed


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

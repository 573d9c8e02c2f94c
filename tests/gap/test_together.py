"""A payload in some runs and a contact in some, each of which hides the other."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from tests.synthetic import arm, measure, swing

from irtwin.effects.catalogue import BASELINE
from irtwin.effects.load import ExternalContact, Payload
from irtwin.effects.stack import Stack
from irtwin.gap.regression.channel_equations import torque_system
from irtwin.gap.regression.groups import Grouping
from irtwin.gap.regression.moments import Summed
from irtwin.gap.regression.normal_equations import twin_values
from irtwin.gap.screening.contact import contact
from irtwin.gap.screening.remainder import remainders
from irtwin.gap.screening.screen import each_beside_the_other
from irtwin.gap.thresholds import DEFAULT

ROBOT = arm(4)
LOAD = np.array([1.5, 0.0, 0.02, 0.1, 0, 0, 0, 0, 0, 0])
FORCE = np.array([3.0, -4.0, 4.0])


def screened(loaded, touched, still=(), references=()):
    """What is tried of payloads and contacts, and in which runs; some of the eight are references."""
    motions = []
    for seed in range(8):
        motion = replace(swing(ROBOT, seed, seconds=6.0, rate=50.0), run=f"run_{seed}")
        for joint in still:
            motion.q[:, joint], motion.dq[:, joint], motion.ddq[:, joint] = 0.3, 0.0, 0.0
        shown = measure(ROBOT, motion, noise=0.5, seed=seed)
        extra = Payload().contribution(ROBOT, motion, LOAD) if seed in loaded else 0.0
        if seed in touched:
            extra = extra + ExternalContact(2.0, 3.5).contribution(ROBOT, motion, FORCE)
        motions.append(replace(shown, torque=shown.torque + extra))
    names = frozenset(motion.run for motion in motions)
    observed = names - {f"run_{seed}" for seed in references}
    grouping = Grouping({name: name for name in names}, observed)
    case = SimpleNamespace(robot=ROBOT, with_torque=motions, observed=observed, grouping=grouping, thresholds=DEFAULT)
    stack = Stack(ROBOT, BASELINE)
    system = torque_system(stack, motions, grouping, (), None)
    noise = system.noise_before
    left = remainders(case, stack, twin_values(system, system.solution((), Summed(system.moments(noise)))))
    return [
        (type(one), one.runs) for one in each_beside_the_other(case, stack, system, noise, contact(ROBOT, left, noise))
    ]


def of_runs(kind, runs):
    return kind, tuple(f"run_{k}" for k in runs)


@pytest.mark.parametrize("still", [(), (0,)])
def test_a_contact_and_a_payload_that_hide_each_other_are_both_tried(still):
    tried = screened(loaded=(1, 4, 5), touched=(1, 2, 6), still=still)
    assert of_runs(ExternalContact, (1, 2, 6)) in tried
    assert of_runs(Payload, (1, 4, 5)) in tried


def test_a_contact_hides_behind_a_payload_of_all_observed_runs():
    tried = screened(loaded=(4, 5, 6, 7), touched=(4, 6, 7), references=(0, 1, 2, 3))
    assert of_runs(ExternalContact, (4, 6, 7)) in tried
    assert of_runs(Payload, (4, 5, 6, 7)) not in tried  # as a change it is tried anyway


def test_each_is_tried_where_it_is_alone():
    assert of_runs(Payload, (1, 4, 5)) in screened(loaded=(1, 4, 5), touched=())
    assert of_runs(ExternalContact, (1, 2, 6)) in screened(loaded=(), touched=(1, 2, 6))

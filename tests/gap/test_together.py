"""A payload in some runs and a contact in some, each of which hides the other."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
from tests.synthetic import arm, measure, swing

from irtwin.effects.catalogue import BASELINE
from irtwin.effects.load import ExternalContact, Payload
from irtwin.effects.stack import Stack
from irtwin.gap.regression.channel_equations import torque_system
from irtwin.gap.regression.groups import Grouping
from irtwin.gap.regression.moments import summed
from irtwin.gap.regression.normal_equations import noise_before, twin_values
from irtwin.gap.screening.contact import contact
from irtwin.gap.screening.payloads import untold_payload
from irtwin.gap.screening.remainder import remainders
from irtwin.gap.screening.together import each_beside_the_other
from irtwin.gap.thresholds import DEFAULT

ROBOT = arm(4)
LOAD = np.array([1.5, 0.0, 0.02, 0.1, 0, 0, 0, 0, 0, 0])
FORCE = np.array([3.0, -4.0, 4.0])


def screened(loaded, touched, still=()):
    """What is found of payload and contact each by itself, and each beside the other: the runs of both."""
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
    grouping = Grouping({name: name for name in names}, names, DEFAULT.admission.fewest_groups)
    case = SimpleNamespace(robot=ROBOT, with_torque=motions, observed=names, grouping=grouping, thresholds=DEFAULT)
    stack = Stack(ROBOT, BASELINE)
    system = torque_system(stack, motions, grouping, (), None)
    noise = noise_before(system)
    left = remainders(case, stack, twin_values(system, system.solution((), summed(system.moments(noise)))))
    alone = contact(ROBOT, left, noise, DEFAULT.contact), untold_payload(ROBOT, system, noise, DEFAULT.some_payload, 0)
    both = each_beside_the_other(case, stack, system, noise, alone, 0)
    return [[one and one.runs for one in pair] for pair in (alone, both)]


def test_a_contact_is_found_beside_a_payload_that_hides_it():
    alone, both = screened(loaded=(1, 4, 5), touched=(1, 2, 6))
    assert alone[0] != ("run_1", "run_2", "run_6")
    assert both == [("run_1", "run_2", "run_6"), ("run_1", "run_4", "run_5")]


def test_neither_makes_the_other():
    for loaded, touched in (((1, 4, 5), ()), ((), (1, 2, 6))):
        _, both = screened(loaded, touched)
        assert both == [tuple(f"run_{k}" for k in runs) or None for runs in (touched, loaded)]


def test_a_joint_that_never_moves_hides_neither():
    _, both = screened(loaded=(1, 4, 5), touched=(1, 2, 6), still=(0,))
    assert both == [("run_1", "run_2", "run_6"), ("run_1", "run_4", "run_5")]

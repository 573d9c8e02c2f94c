"""Fits of several shapes to equations of torque that were read once."""

from __future__ import annotations

import numpy as np
from tests.synthetic import arm, measure, swing

from irtwin.effects.catalogue import BASELINE
from irtwin.effects.friction import NonlinearViscousFriction, StribeckFriction
from irtwin.effects.stack import Stack
from irtwin.identification.fits import fit_torque
from irtwin.identification.reduced_torque import ReducedTorque

ROBOT = arm(3)
MOTIONS = [measure(ROBOT, swing(ROBOT, seed, seconds=8), noise=0.1, seed=seed) for seed in (1, 2)]


def test_shapes_read_at_once_leave_what_each_leaves_when_it_is_read():
    first, second, _ = ROBOT.joint_names
    curved = NonlinearViscousFriction(d=2.0)
    shapes = [
        [StribeckFriction(vs=0.05)],
        [StribeckFriction(vs=0.1).on(first), curved],
        [StribeckFriction(vs=0.05).on(second), StribeckFriction(vs=0.2).on(first)],
    ]
    stacks = [Stack(ROBOT, [*BASELINE, *some]) for some in shapes]
    known = ReducedTorque.of_all(stacks, MOTIONS)
    for stack in stacks:
        assert known.has(stack)
        (_, read), (_, reduced) = fit_torque(stack, MOTIONS), fit_torque(stack, MOTIONS, known)
        np.testing.assert_allclose(reduced.noise, read.noise, rtol=1e-6)
        np.testing.assert_allclose(reduced.values, read.values, rtol=1e-5, atol=1e-6)
    assert not known.has(Stack(ROBOT, [*BASELINE, StribeckFriction(vs=0.1).on(second)]))

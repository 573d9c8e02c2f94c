"""What a fit takes of equations reduced before is what it would have read from the samples."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from tests.synthetic import arm, measure, swing, truth

from irtwin.effects.catalogue import catalogue
from irtwin.effects.friction import NonlinearViscousFriction, StribeckFriction, turn
from irtwin.effects.stack import Stack
from irtwin.identification.fits import fit_torque
from irtwin.identification.friction_near_zero import with_friction_near_zero
from irtwin.identification.reduced_torque import ReducedTorque
from irtwin.signals.motion import Motion

ROBOT = arm(2)
EFFECTS = ("rigid_body", "coulomb_friction", "viscous_friction", "nonlinear_viscous_friction", "torque_offset")


def measured(soft: bool) -> Motion:
    """Return a motion with the truth's torque; dry friction of the second joint turns over 0.01 rad/s where `soft`."""
    motion = measure(ROBOT, swing(ROBOT, 1), noise=0.02)
    torque, dq = motion.torque.copy(), motion.dq[:, 1]
    torque[:, 1] += soft * truth(ROBOT)["Fc"][1] * (turn(dq, 0.01, 2.0) - np.sign(dq))
    return replace(motion, torque=torque)


@pytest.mark.parametrize("soft", [False, True], ids=["sharp", "soft"])
def test_a_fit_is_that_to_the_samples(soft: bool) -> None:
    motions = [measured(soft)]
    robot, reduced = with_friction_near_zero(ROBOT, motions, EFFECTS)
    assert reduced is not None and (robot.joints[1].friction_width is not None) == soft
    stack = Stack(robot, [effect for effect in EFFECTS if effect != NonlinearViscousFriction.id])
    assert reduced.of(stack) is not None
    (_, found), (_, read) = fit_torque(stack, motions, reduced), fit_torque(stack, motions)
    np.testing.assert_allclose(found.values, read.values, rtol=1e-8, atol=1e-9)
    np.testing.assert_allclose(found.covariance, read.covariance, rtol=1e-6, atol=1e-12)


def test_shapes_that_were_open_are_among_its_columns_unless_friction_turns_otherwise() -> None:
    shape = NonlinearViscousFriction(d=3.0)
    for soft in (False, True):
        motions = [measured(soft)]
        robot, reduced = with_friction_near_zero(ROBOT, motions, EFFECTS)
        stack = Stack(robot, [shape.on("joint_2") if effect == shape.id else effect for effect in EFFECTS])
        assert (reduced.of(stack) is None) == soft
        found, read = fit_torque(stack, motions, reduced)[1], fit_torque(stack, motions)[1]
        np.testing.assert_allclose(found.values, read.values, rtol=1e-8, atol=1e-9)


def test_shapes_read_at_once_leave_what_each_leaves_when_it_is_read() -> None:
    motions, (first, second) = [measured(True)], ROBOT.joint_names
    shapes = (
        [StribeckFriction(vs=0.05)],
        [StribeckFriction(vs=0.1).on(first), NonlinearViscousFriction(d=3.0)],
        [StribeckFriction(vs=0.05).on(second), StribeckFriction(vs=0.2).on(first)],
    )
    for plain in (EFFECTS[:3], ("rigid_body", "viscous_friction")):  # without dry friction, too, no sample is left out
        stacks = [Stack(ROBOT, [*plain, *some]) for some in shapes]
        known = ReducedTorque.of_all(stacks, motions)
        for stack in stacks:
            assert known.has(stack)
            (_, found), (_, read) = fit_torque(stack, motions, known), fit_torque(stack, motions)
            np.testing.assert_allclose(found.values, read.values, rtol=1e-6, atol=1e-7)
            np.testing.assert_allclose(found.noise, read.noise, rtol=1e-6)
        assert not known.has(Stack(ROBOT, [*plain, StribeckFriction(vs=0.1).on(second)]))


@pytest.mark.parametrize("effects", [("rigid_body", "viscous_friction"), (*EFFECTS[:3], "presliding_hysteresis")])
def test_other_samples_or_columns_are_not_among_it(effects: tuple[str, ...]) -> None:
    robot, reduced = with_friction_near_zero(ROBOT, [measured(False)], EFFECTS)
    assert reduced is not None and set(effects) <= set(catalogue())
    assert reduced.of(Stack(robot, effects)) is None

"""The joint torque on which causes of power are told: what was logged, less what sensors add."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
from tests.synthetic import arm, measure, swing, truth

from irtwin.effects.friction import sharp_sign
from irtwin.effects.stack import Stack
from irtwin.gap.isolation.explained import ExplainedTorque

ROBOT = arm(2)
STACK = Stack(ROBOT, ("coulomb_friction", "torque_offset"))
OFFSET = truth(ROBOT)["c"]


class Explained(ExplainedTorque):
    """Beside friction and offsets, a sensor adds a tenth of a joint's way, and a cause really adds 2 N m."""

    values = np.concatenate([truth(ROBOT)["Fc"], OFFSET])

    def __init__(self) -> None:
        causes = (SimpleNamespace(sensor=True), SimpleNamespace(sensor=False))
        super().__init__(STACK, SimpleNamespace(causes=causes, used=()), lambda whole: None)

    def added(self, cause, whole, *, real=False):
        if cause.sensor:
            return 0 * whole.q if real else 0.1 * whole.q
        return 2.0 + 0 * whole.q


def test_of_a_logged_torque_only_what_sensors_add_is_taken_off() -> None:
    motion = measure(ROBOT, swing(ROBOT, 1))
    fast = replace(motion, fast_torque=0.3 + 0 * motion.q)
    np.testing.assert_allclose(Explained().logged(motion), motion.torque - OFFSET - 0.1 * motion.q)
    np.testing.assert_allclose(Explained().logged(fast)[5:9], (motion.torque + 0.3 - OFFSET - 0.1 * motion.q)[5:9])
    np.testing.assert_allclose(Explained().logged(fast.part(5, 9)), Explained().logged(fast)[5:9])


def test_where_no_torque_was_logged_it_is_the_explained_one() -> None:
    motion = replace(measure(ROBOT, swing(ROBOT, 1)), torque=None)
    np.testing.assert_allclose(Explained().logged(motion), Explained()(motion))
    np.testing.assert_allclose(Explained()(motion), 2.0 + truth(ROBOT)["Fc"] * sharp_sign(motion.dq))

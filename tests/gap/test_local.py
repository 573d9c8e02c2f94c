"""The place of a worn spot and of a spring near a joint's end, found in what the twin leaves."""

from __future__ import annotations

import numpy as np
import pytest
from tests.synthetic import arm, swing

from irtwin.effects.load import CableDrag
from irtwin.effects.local import JointLimitSpring, LocalEffect, LocalWear
from irtwin.gap.screening.local import local_effects
from irtwin.gap.screening.remainder import RunResidual
from irtwin.gap.screening.screen import Screened

ROBOT = arm(3)
KNOWN = (LocalWear(), JointLimitSpring())
MOTIONS = [swing(ROBOT, run, seconds=8, rate=50) for run in range(6)]


def remainders(added=lambda motion: 0.0, observed=True):
    """Six runs of noise of 1 N m, with a torque on the second joint."""
    generator, left = np.random.default_rng(2), []
    for motion in MOTIONS:
        residual = generator.standard_normal((len(motion.time), 3))
        residual[:, 1] += added(motion)
        residual[:20] = np.nan
        left.append(RunResidual(motion, residual, observed))
    return left


def bump(motion, size=3.0, at=0.1):
    """A worn spot of another form than the effect's: friction that is more on a stretch."""
    q, dq = motion.q[:, 1], motion.dq[:, 1]
    return size * np.sign(dq) * (np.abs(q - at) < 0.08)


def hose(motion, side=1.0, at=0.3):
    return 20.0 * side * np.maximum(side * (motion.q[:, 1] - at), 0.0) ** 1.2


def search(left, kind=LocalEffect, joint="joint_2"):
    return [one for one in local_effects(ROBOT, KNOWN, left) if isinstance(one, kind) and one.joints == (joint,)]


def test_the_place_of_a_worn_spot_is_found_within_its_width():
    (found,) = search(remainders(bump), LocalWear)
    assert abs(found.q0 - 0.1) < found.w < 0.2


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_the_place_of_a_spring_is_found_at_its_end(side):
    found = search(remainders(lambda motion: hose(motion, side, 0.3 * side)), JointLimitSpring)
    (spring,) = (one for one in found if one.side == side)
    assert spring.q0 == pytest.approx(0.3 * side, abs=0.15)


def test_runs_that_are_not_observed_say_nothing():
    assert search(remainders(bump, observed=False)) == []


def test_a_joint_that_rests_or_is_exact_has_no_place():
    left = remainders()
    for one in left:
        one.residual[:] = 0.0
    assert search(left) == []
    assert search([]) == []


def test_local_effects_are_tried_in_their_place_only():
    spot = LocalWear(q0=0.4, joints=("joint_1",))
    assert Screened(lambda: (), (spot,)).shapes([CableDrag(), *KNOWN]) == [CableDrag(), spot]

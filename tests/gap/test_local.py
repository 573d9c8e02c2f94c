"""The place of a worn spot and of a spring near a joint's end, found in what the twin leaves."""

from __future__ import annotations

import numpy as np
import pytest
from tests.synthetic import arm, swing

from irtwin.effects.load import CableDrag
from irtwin.effects.local import JointLimitSpring, LocalWear
from irtwin.gap.screening.local import local_effects
from irtwin.gap.screening.remainder import Remainder
from irtwin.gap.screening.screen import Screened
from irtwin.gap.thresholds import DEFAULT

ROBOT = arm(3)
KNOWN = (LocalWear(), JointLimitSpring())
MOTIONS = [swing(ROBOT, run, seconds=8, rate=50) for run in range(6)]


def remainders(added=lambda motion: 0.0, memory=1, observed=True):
    """Six runs of noise of 1 N m that remembers so many samples, with a torque on the second joint."""
    generator, left = np.random.default_rng(2), []
    for motion in MOTIONS:
        noise = generator.standard_normal((len(motion.time) + memory - 1, 3))
        residual = np.apply_along_axis(np.convolve, 0, noise, np.ones(memory) / memory**0.5, "valid")
        residual[:, 1] += added(motion)
        residual[:20] = np.nan
        left.append(Remainder(motion, residual, observed, motion.run))
    return left


def bump(motion, size=3.0, at=0.1):
    """A worn spot of another form than the effect's: friction that is more on a stretch."""
    q, dq = motion.q[:, 1], motion.dq[:, 1]
    return size * np.sign(dq) * (np.abs(q - at) < 0.08)


def hose(motion, side=1.0, at=0.3):
    return 20.0 * side * np.maximum(side * (motion.q[:, 1] - at), 0.0) ** 1.2


def search(left, seed=0):
    return local_effects(ROBOT, KNOWN, left, DEFAULT.local, seed)


def test_the_place_of_a_worn_spot_is_found_within_its_width():
    (found,) = search(remainders(bump))
    assert isinstance(found, LocalWear)
    assert found.joints == ("joint_2",)
    assert abs(found.q0 - 0.1) < found.w < 0.2


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_the_place_of_a_spring_is_found_at_its_end(side):
    """One at the other end may be tried as well: beside a spring over the whole way they are nearly alike."""
    found = search(remainders(lambda motion: hose(motion, side, 0.3 * side)))
    assert {(type(one), one.joints) for one in found} == {(JointLimitSpring, ("joint_2",))}
    (spring,) = (one for one in found if one.side == side)
    assert spring.q0 == pytest.approx(0.3 * side, abs=0.15)


def test_a_spring_that_pushes_is_none():
    assert [one for one in search(remainders(lambda motion: -hose(motion))) if one.side == 1.0] == []


@pytest.mark.parametrize("memory", [1, 40])
def test_chance_gives_no_place_even_where_residuals_remember(memory):
    assert [search(remainders(memory=memory), seed) for seed in range(3)] == [[], [], []]


def test_friction_over_the_whole_turn_is_no_worn_spot():
    def bent(motion):
        return 3 * np.sign(motion.dq[:, 1]) * np.cos(motion.q[:, 1] - 0.4) + motion.dq[:, 1] ** 2

    assert search(remainders(bent)) == []


def test_a_bump_that_is_passed_in_one_run_alone_is_chance():
    assert search(remainders(lambda motion: bump(motion) * (motion.run == "swing_3"))) == []


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
    assert Screened(local=(spot,)).shapes([CableDrag(), *KNOWN]) == [CableDrag(), spot]
    assert Screened().shapes(KNOWN) == []

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from tests.synthetic import arm, rigid_torque, swing

from irtwin.robot.body_regressor import body_regressor
from irtwin.signals.filter import decimate
from irtwin.signals.sparse import at_all, at_some, decimate_sparse, factor_at_some, sparse_step, thinning

ROBOT = arm(3)


def oversampled(cutoff=4.0):
    motion = swing(ROBOT, 1, seconds=40)  # 100 Hz, below 1 Hz
    return replace(motion, cutoff=cutoff)


def regressor(motion):
    return body_regressor(ROBOT.model, motion.q, motion.dq, motion.ddq)


@pytest.mark.parametrize(("cutoff", "step"), [(None, 1), (20.0, 1), (7.6, 2), (4.0, 3), (2.5, 6)])
def test_samples_of_six_and_a_half_times_the_cutoff_are_enough(cutoff, step):
    motion = oversampled(cutoff)
    assert sparse_step(motion) == sparse_step(motion.part(100, 150)) == step
    np.testing.assert_array_equal(at_some(motion).time, motion.time[::step])


@pytest.mark.parametrize("cutoff", [7.6, 4.0, 2.5])
def test_some_samples_of_what_is_smooth_are_filtered_as_all_are(cutoff):
    part = oversampled(cutoff).part(317, 3200)
    expected = decimate(regressor(part)[:, 0], *thinning(part))
    found = decimate_sparse(regressor(at_some(part))[:, 0], part, len(expected))
    np.testing.assert_allclose(found, expected, atol=2e-6 * np.abs(expected).max())


@pytest.mark.parametrize("count", [2000, 130, 40])
def test_some_samples_tell_the_others_up_to_both_ends(count):
    part = oversampled().part(100, 100 + count)
    asked = []

    def torque(motion):
        asked.append(len(motion.time))
        return rigid_torque(ROBOT, motion)

    found = at_all(torque, part)
    expected = rigid_torque(ROBOT, part)
    np.testing.assert_allclose(found, expected, atol=2e-6 * np.abs(expected).max())
    assert sum(asked) == count if count < 100 else sum(asked) < 0.8 * count


def test_a_product_of_what_is_smooth_with_what_jumps_is_filtered_as_all_samples_are():
    part = oversampled().part(300, 3300)
    along = part.dq + 0.5 * np.sign(part.dq)
    expected = decimate(np.einsum("nj,njk->nk", along, regressor(part)), *thinning(part))
    some = at_some(part)
    found = np.einsum("nj,njk->nk", factor_at_some(along, part), regressor(some))
    error = decimate_sparse(found, part, len(expected)) - expected
    assert np.sqrt(np.mean(error**2)) < 1e-3 * np.sqrt(np.mean(expected**2))
    np.testing.assert_array_equal(factor_at_some(along, replace(part, cutoff=None)), along)

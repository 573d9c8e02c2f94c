from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from tests.synthetic import arm, swing

from irtwin.errors import InputError
from irtwin.identification.torque_constants import torque_constants

KT = np.array([12.0, 8.0, 5.0])


def motion_of(seed, still=()):
    """Currents that have nothing to do with any model of torque: the balance alone is at work."""
    motion = swing(arm(3), seed)
    rng = np.random.default_rng(seed)
    current = np.sin(motion.time[:, None] * rng.uniform(1, 4, 3) + rng.uniform(0, 6, 3)) * [3, 2, 1]
    dq = motion.dq.copy()
    dq[:, list(still)] = 0.0
    current[:, list(still)] = 0.0
    power = 90 + (KT * current * dq).sum(axis=1) + (np.array([0.5, 0.8, 1.2]) * current**2).sum(axis=1)
    return replace(motion, dq=dq, current=current, power=power + 0.5 * rng.standard_normal(len(power)))


def test_constants_are_found():
    found = torque_constants(arm(3), [motion_of(1), motion_of(2)])
    np.testing.assert_allclose(found.constants, KT, rtol=0.02)
    assert [term.joint for _, term in found.terms] == ["joint_1", "joint_2", "joint_3"]
    assert {term.unit for _, term in found.terms} == {"N m/A"}


def test_a_joint_that_rests_keeps_the_common_value_and_no_certainty():
    found = torque_constants(arm(3), [motion_of(1, still=(2,)), motion_of(2, still=(2,))])
    np.testing.assert_allclose(found.constants[:2], KT[:2], rtol=0.02)
    assert 8 < found.constants[2] < 12
    assert found.estimate.covariance[2, 2] ** 0.5 == pytest.approx(found.constants[2], rel=1e-3)


def test_a_balance_that_tells_nothing_is_refused():
    dead = [replace(motion_of(seed), power=np.full(2000, 90.0)) for seed in (1, 2)]
    with pytest.raises(InputError, match="power does not rise with current times speed"):
        torque_constants(arm(3), dead)


def test_without_losses_the_constants_are_found_all_the_same():
    ideal = [replace(m, power=90 + (KT * m.current * m.dq).sum(axis=1)) for m in (motion_of(1), motion_of(2))]
    found = torque_constants(arm(3), ideal)
    np.testing.assert_allclose(found.constants, KT, rtol=0.02)


def test_sliding_joints_have_force_constants():
    found = torque_constants(arm(3, slides=(0,)), [motion_of(1)])
    assert found.terms[0][1].unit == "N/A"

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import scipy
from hypothesis import given, settings
from hypothesis import strategies as st
from tests.synthetic import arm, as_run, measure, swing

from irtwin.errors import InputError
from irtwin.signals.conditioning import (
    choose_cutoff,
    condition,
    condition_for_fit,
    cutoff_of_motion,
    differentiate,
    lag_of,
)
from irtwin.signals.filter import low_pass
from irtwin.signals.motion import Motion

ROBOT = arm(3)


def relative(found, expected):
    return np.sqrt(np.mean((found - expected) ** 2)) / np.sqrt(np.mean(expected**2))


@pytest.mark.parametrize("rate", [25.0, 30.0, 83.33, 125.0, 1000.0])
def test_derivatives_at_every_rate_that_robots_log_at(rate):
    motion = swing(ROBOT, 1, rate=rate)
    found = condition(as_run(motion), ROBOT)
    assert found.rate == pytest.approx(rate)
    assert found.cutoff <= 0.4 * rate + 1e-9
    inner = slice(int(rate), -int(rate))
    assert relative(found.q[inner], motion.q[inner]) < 1e-3
    assert relative(found.dq[inner], motion.dq[inner]) < 5e-3
    assert relative(found.ddq[inner], motion.ddq[inner]) < 0.02


def test_derivatives_hold_up_to_the_ends():
    motion = swing(ROBOT, 2)
    found = condition(as_run(motion), ROBOT)
    for part in (slice(0, 50), slice(-50, None)):
        assert relative(found.dq[part], motion.dq[part]) < 0.1
        assert np.abs(found.ddq[part]).max() < 2 * np.abs(motion.ddq).max()


def test_noise_of_encoders_does_not_drown_the_acceleration():
    motion = swing(ROBOT, 3, rate=1000.0)
    noisy = replace(motion, q=np.round(motion.q / 1e-5) * 1e-5)
    found = condition(as_run(noisy), ROBOT)
    inner = slice(500, -500)
    assert relative(found.ddq[inner], motion.ddq[inner]) < 0.02


@pytest.mark.parametrize("step", [1e-7, 1e-4, 4e-4])
def test_a_joint_stands_where_it_does_not_move_and_not_between_two_steps_of_its_encoder(step):
    time = np.arange(0, 12, 1e-3)
    moved = np.interp(time, [0, 3, 6, 9, 12], [0, 0.03, 0.03, 0.5, 0.5])  # 10 mrad/s, rest, 157 mrad/s, rest
    moved[time > 9] += step * (np.arange((time > 9).sum()) % 2)  # the encoder flickers
    motion = swing(arm(1), 5, seconds=12, rate=1000.0)
    found = condition(as_run(replace(motion, q=np.round(moved[:, None] / step) * step)), arm(1)).standing[:, 0]
    margin = 0.5 + step / 2e-3
    rests = [(time > start + margin) & (time < stop - margin) for start, stop in ((3, 6), (9, 12))]
    moves = [(time > start + margin) & (time < stop - margin) for start, stop in ((0, 3), (6, 9))]
    assert all(found[inside].all() for inside in rests)
    assert not any(found[inside].any() for inside in moves)


@pytest.mark.slow
@settings(max_examples=10)
@given(jitter=st.floats(0, 0.3), seed=st.integers(0, 100))
def test_jitter_of_sampling_is_evened_out(jitter, seed):
    rng = np.random.default_rng(seed)
    motion = swing(ROBOT, 4, seconds=10)
    dense = swing(ROBOT, 4, seconds=10, rate=10000.0)
    rows = np.round(np.arange(1000) * 100 + 100 * jitter * rng.uniform(-1, 1, 1000)).astype(int).clip(0, 99999)
    run = as_run(replace(dense, time=dense.time[rows], q=dense.q[rows]))
    found = condition(run, ROBOT)
    assert np.ptp(np.diff(found.time)) < 1e-9
    expected = np.column_stack([np.interp(found.time, motion.time, column) for column in motion.dq.T])
    assert relative(found.dq[100:-100], expected[100:-100]) < 0.02


def test_what_decided_the_cutoff_is_said():
    slow = as_run(swing(ROBOT, 3, seconds=20.0))
    coarse = replace(slow, signals=slow.signals.rows(slice(None, None, 20)))  # at 5 Hz
    for run, why in ((slow, "10 times the bandwidth of the motion"), (coarse, "0.8 of the Nyquist frequency")):
        assert cutoff_of_motion([run]) == (choose_cutoff([run]), why)


def test_cutoff_follows_the_band_of_the_motion_and_not_its_noise():
    motion = swing(ROBOT, 5, rate=200.0)
    noise = 1e-4 * np.random.default_rng(0).standard_normal(motion.q.shape)
    clean, noisy = choose_cutoff([as_run(motion)]), choose_cutoff([as_run(replace(motion, q=motion.q + noise))])
    assert 3 < clean < 8  # sines up to 0.6 Hz
    assert noisy == pytest.approx(clean, rel=0.2)
    fast = replace(motion, time=motion.time / 3)
    assert choose_cutoff([as_run(fast)]) == pytest.approx(3 * clean, rel=0.2)
    assert choose_cutoff([as_run(fast), as_run(motion)]) == pytest.approx(choose_cutoff([as_run(fast)]), rel=0.2)


def test_a_slow_run_whose_encoder_s_steps_look_like_motion_does_not_widen_the_band():
    motion = swing(ROBOT, 5, rate=200.0)
    slow = replace(motion, q=np.round(0.01 * motion.q / 4e-4) * 4e-4)
    usual = choose_cutoff([as_run(motion)])
    assert choose_cutoff([as_run(slow)]) > 3 * usual
    assert choose_cutoff([as_run(motion), as_run(slow)]) == pytest.approx(usual, rel=0.2)


def test_a_robot_that_rests_can_be_conditioned():
    motion = swing(ROBOT, 6)
    rest = replace(motion, q=np.full_like(motion.q, 0.3))
    found = condition(as_run(rest), ROBOT)
    np.testing.assert_allclose(found.q, 0.3)
    assert np.abs(found.dq).max() < 1e-9


def test_logged_speed_is_taken_where_it_agrees_with_the_positions():
    motion = swing(ROBOT, 7, rate=25.0)
    good = condition(as_run(motion, dq=motion.dq), ROBOT)
    degrees = condition(as_run(motion, dq=np.rad2deg(motion.dq)), ROBOT)
    alone = condition(as_run(motion), ROBOT)
    assert relative(good.dq[25:-25], motion.dq[25:-25]) < 1e-3
    np.testing.assert_array_equal(degrees.dq, alone.dq)
    np.testing.assert_allclose(good.ddq, differentiate(good.dq, good.rate))


@pytest.mark.parametrize("lag", [2e-3, -1.3e-3, 20e-3])
def test_a_speed_that_a_filter_made_late_is_taken_as_much_earlier(lag):
    """Noise of positions, which are derived, and of the speed do not move it."""
    random, motion = np.random.default_rng(0), swing(ROBOT, 7, rate=250.0)
    late = scipy.interpolate.CubicSpline(motion.time, motion.dq)(motion.time - lag)
    noisy = late + 5e-3 * random.standard_normal(late.shape)
    run = as_run(motion, q=np.round(motion.q / 1e-4) * 1e-4, dq=noisy)
    found = condition(run, ROBOT)
    assert lag_of(noisy, motion.dq, motion.rate) == pytest.approx(lag, rel=0.05)
    assert relative(found.dq[25:-25], motion.dq[25:-25]) < 0.003


def test_a_joint_at_rest_tells_no_lag():
    still, noise = np.zeros((100, 1)), np.random.default_rng(0).standard_normal((100, 1))
    assert lag_of(still, still, 100.0) == 0.0
    assert np.isfinite(lag_of(still, noise, 100.0))


def test_every_measurement_passes_the_same_filter():
    motion = measure(ROBOT, swing(ROBOT, 8))
    found = condition(as_run(motion, torque=motion.q, temperature=motion.q), ROBOT, cutoff=3.0)
    assert found.cutoff == 3.0
    np.testing.assert_allclose(found.torque, found.q, atol=1e-12)
    np.testing.assert_allclose(found.temperature, found.q, atol=1e-12)
    assert found.power.shape == (len(found.time),)
    assert found.current.shape == found.q.shape


def test_what_logged_torque_carries_is_filtered_with_the_power():
    time = np.arange(0, 10, 2e-3)
    q = np.column_stack([np.sin(2 * np.pi * 0.5 * time)] * 2)
    torque = np.column_stack([np.sign(np.cos(2 * np.pi * 0.5 * time))] * 2)  # as fast as dry friction that turns
    still = 0 * q
    run = as_run(Motion(time, q, still, still, torque=torque, run="turns"))
    motion = condition_for_fit(run, arm(2), 4.0)
    fast = motion.torque + motion.fast_torque
    wanted = low_pass(torque * np.pi * np.cos(2 * np.pi * 0.5 * time)[:, None], motion.rate, 4.0)
    whole, slow = (low_pass(one * motion.dq, motion.rate, 4.0) - wanted for one in (fast, motion.torque))
    assert np.abs(whole).max() < 0.25 * np.abs(slow).max()
    assert condition(run, arm(2), 4.0).fast_torque is None


@pytest.mark.parametrize("cutoff", [0.0, -1.0, float("nan")])
def test_wrong_cutoffs(cutoff):
    with pytest.raises(InputError, match="give a positive frequency"):
        condition(as_run(swing(ROBOT, 9)), ROBOT, cutoff)


def test_too_short_a_run():
    with pytest.raises(InputError, match=r"swing_1.csv: has 10 samples; a run needs at least 20"):
        condition(as_run(swing(ROBOT, 1, seconds=0.1)), ROBOT)


def test_speeds_of_a_joint_that_hardly_moves_are_not_those_of_its_encoder_s_steps():
    """Where a joint moves fast, its speeds keep three times the band, whatever the encoder."""
    slow, fast = (replace(swing(ROBOT, 4), q=swing(ROBOT, 4).q * scale) for scale in (0.03, 1.0))
    q = np.column_stack([slow.q[:, 0], fast.q[:, 1], fast.q[:, 2]])
    coarse = as_run(replace(fast, q=np.round(q / 3e-4) * 3e-4))
    found, wide = condition_for_fit(coarse, ROBOT, 10.0), condition(coarse, ROBOT, 10.0, states_cutoff=30.0)
    inner = slice(100, -100)
    true = 0.03 * swing(ROBOT, 4).dq[:, 0]
    assert relative(found.dq[inner, 0], true[inner]) < 0.4 * relative(wide.dq[inner, 0], true[inner])
    assert np.array_equal(found.dq[:, 1:], wide.dq[:, 1:])


def test_a_joint_that_only_moves_fast_keeps_its_band():
    """Its positions lie on no grid: what is least between two of them is how far it goes between samples."""
    motion = swing(ROBOT, 4)
    steady = 0.5 * motion.time + 1e-4 * np.random.default_rng(0).standard_normal(len(motion.time))
    run = as_run(replace(motion, q=np.column_stack([steady] * 3)))
    found, wide = condition_for_fit(run, ROBOT, 10.0), condition(run, ROBOT, 10.0, states_cutoff=30.0)
    assert np.array_equal(found.dq, wide.dq)

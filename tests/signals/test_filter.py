from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from irtwin.signals.filter import decimate, decimation, kernel, low_pass

rates = st.floats(10, 1000)
shares = st.floats(0.02, 1.2)  # cutoff over Nyquist


@settings(max_examples=30)
@given(rate=rates, share=shares, level=st.floats(-1e3, 1e3), slope=st.floats(-10, 10), count=st.integers(2, 400))
def test_constants_and_ramps_pass_unchanged(rate, share, level, slope, count):
    signal = level + slope * np.arange(count)
    np.testing.assert_allclose(low_pass(signal, rate, share * rate / 2), signal, atol=1e-8 * (1 + np.abs(signal).max()))


@settings(max_examples=20)
@given(share=st.floats(0.05, 0.9), size=st.integers(1, 3))
def test_linear_and_without_phase(share, size):
    rng = np.random.default_rng(1)
    one, two = rng.standard_normal((2, 200, size))
    cutoff = share * 50
    both = low_pass(2 * one - 3 * two, 100, cutoff)
    np.testing.assert_allclose(both, 2 * low_pass(one, 100, cutoff) - 3 * low_pass(two, 100, cutoff), atol=1e-12)
    # zero phase: filtering backwards in time gives the same
    np.testing.assert_allclose(low_pass(one[::-1], 100, cutoff)[::-1], low_pass(one, 100, cutoff), atol=1e-12)


def test_band_is_kept_and_noise_above_it_taken():
    time = np.arange(2000) / 200
    slow, fast = np.sin(2 * np.pi * 2 * time), np.sin(2 * np.pi * 40 * time)
    inner = slice(200, -200)
    np.testing.assert_allclose(low_pass(slow, 200, 20)[inner], slow[inner], atol=2e-4)
    assert np.abs(low_pass(fast, 200, 20)[inner]).max() < 1e-3


def test_nothing_is_filtered_from_the_nyquist_frequency_on():
    signal = np.random.default_rng(0).standard_normal(50)
    assert kernel(100, 50).tolist() == [1.0]
    np.testing.assert_array_equal(low_pass(signal, 100, 60), signal)


@pytest.mark.parametrize("step", [1, 3, 7])
def test_decimation_is_filtering_and_then_picking(step):
    signal = np.random.default_rng(2).standard_normal((300, 2, 3))
    taps = kernel(100, 8)
    half = len(taps) // 2
    whole = low_pass(signal, 100, 8)[half : len(signal) - half : step]
    np.testing.assert_allclose(decimate(signal, taps, step), whole, atol=1e-12)
    assert len(decimate(signal[: 2 * half], taps, step)) == 0


def test_decimation_keeps_four_samples_a_cutoff_period():
    assert decimation(1000, 10) == 25
    assert decimation(25, 10) == 1

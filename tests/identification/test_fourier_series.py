import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from irtwin.identification.fourier_series import RestSeries, between_samples


@given(st.integers(2, 12), st.integers(0, 2**32 - 1), st.floats(0.5, 60))
def test_every_series_of_the_basis_rests_at_both_ends(harmonics: int, seed: int, period: float) -> None:
    x = np.random.default_rng(seed).normal(size=(2 * harmonics - 1, 3))
    q, dq, ddq = RestSeries(period, harmonics).series(x).motion(np.array([0.0, period]))
    w = 2 * np.pi * harmonics / period
    np.testing.assert_allclose(dq, 0, atol=1e-11 * w)
    np.testing.assert_allclose(ddq, 0, atol=1e-11 * w**2)
    np.testing.assert_allclose(q[0], q[1], atol=1e-9)


def test_speed_and_acceleration_are_the_derivatives_of_position() -> None:
    series = RestSeries(7.0, 5).series(np.random.default_rng(1).normal(size=(9, 2)))
    time, h = np.linspace(0, 7, 50), 1e-5
    before, now, after = (series.motion(time + shift) for shift in (-h, 0, h))
    np.testing.assert_allclose((after[0] - before[0]) / (2 * h), now[1], atol=1e-6)
    np.testing.assert_allclose((after[1] - before[1]) / (2 * h), now[2], atol=1e-6)


def test_the_bases_give_the_series_motion_at_the_grid() -> None:
    rest = RestSeries(10.0, 4)
    x = np.random.default_rng(2).normal(size=(7, 3))
    for basis, values in zip(rest.bases, rest.series(x).motion(rest.grid), strict=True):
        np.testing.assert_allclose(basis @ x, values, atol=1e-12)


@pytest.mark.slow
@settings(max_examples=30)
@given(st.integers(2, 10), st.integers(0, 2**32 - 1))
def test_between_samples_bounds_what_a_fine_grid_shows(harmonics: int, seed: int) -> None:
    series = RestSeries(1.0, harmonics).series(np.random.default_rng(seed).normal(size=(2 * harmonics - 1, 2)))
    fine = np.linspace(0, 1, 20_000)
    for count in (2 * harmonics + 1, 4 * harmonics, 32 * harmonics):
        bound = between_samples(harmonics, count)
        for coarse_values, fine_values in zip(
            series.motion(np.arange(count) / count), series.motion(fine), strict=True
        ):
            assert (np.abs(fine_values).max(axis=0) <= bound * np.abs(coarse_values).max(axis=0) + 1e-9).all()


def test_between_samples_is_tight_for_a_cosine_between_two_samples() -> None:
    samples = np.cos(2 * 2 * np.pi * (np.arange(16) + 0.5) / 16)
    assert between_samples(2, 16) * np.abs(samples).max() == pytest.approx(1.0)


def test_too_few_samples_bound_nothing() -> None:
    with pytest.raises(ValueError, match="cannot bound"):
        between_samples(5, 10)

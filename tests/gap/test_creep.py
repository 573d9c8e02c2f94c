"""How power drifts: as a ramp or an exponential, in itself or in the copper loss."""

from __future__ import annotations

import numpy as np
import pytest

from irtwin.gap.repeats.series import EvenSeries
from irtwin.gap.repeats.slow import creep

TIME = np.arange(1000) / 100
COPPER = 1 + np.sin(2.2 * TIME) ** 2


@pytest.mark.parametrize("course", [TIME, 10 * (1 - np.exp(-TIME / 2.5))])
@pytest.mark.parametrize("loss", [np.ones(1000), COPPER / COPPER.mean()])
def test_a_drift_is_followed_and_is_by_so_much_a_second(course, loss):
    drift = 3.0 * loss * course
    noise = 0.1 * np.random.default_rng(0).standard_normal(1000)
    series = EvenSeries(TIME, 7.0 + drift + noise, np.column_stack([np.ones(1000), TIME - TIME.mean(), COPPER]))
    found = creep(series, COPPER[:, None])
    assert np.std(found.left()) == pytest.approx(0.1, rel=0.1)
    assert found.coefficients()[1] == pytest.approx(np.polyfit(TIME, drift, 1)[0], rel=0.1)


def test_noise_is_no_exponential():
    noise = np.random.default_rng(1).standard_normal(1000)
    found = creep(EvenSeries(TIME, noise, np.column_stack([np.ones(1000), TIME - TIME.mean()])), None)
    assert np.allclose(np.diff(found.beside[:, 1]), TIME[1])

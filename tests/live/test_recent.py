"""The last minutes: no peak is lost, no sample made up, and memory stays bounded."""

from __future__ import annotations

import numpy as np
import pytest

from irtwin.live.recent import BIN, SECONDS, Curve


def curve_of(time: np.ndarray, value: np.ndarray) -> Curve:
    curve = Curve()
    for at, power in zip(time.tolist(), value.tolist(), strict=True):
        curve.add(at, power)
    return curve


@pytest.mark.parametrize("rate", [2.0, 83.0, 1000.0])
def test_each_bin_keeps_its_lowest_and_its_highest_sample(rate: float) -> None:
    time = 1.7e9 + np.arange(0, 20, 1 / rate)
    value = np.random.default_rng(3).normal(size=time.size)
    points = curve_of(time, value).points()
    samples = set(zip(time.tolist(), value.tolist(), strict=True))
    assert all(tuple(point) in samples for point in points.tolist())
    assert (np.diff(points[:, 0]) > 0).all()
    bins, of_points = (time / BIN).astype(int), (points[:, 0] / BIN).astype(int)
    for number in np.unique(bins):
        here, kept = value[bins == number], points[of_points == number, 1]
        assert sorted(kept) == sorted({here.min(), here.max()})


def test_memory_and_what_is_told_stay_bounded() -> None:
    time = 1.7e9 + np.arange(0, 2.5 * SECONDS, 0.02)
    curve = curve_of(time, np.sin(time))
    points = curve.points()
    assert len(points) <= 2 * SECONDS / BIN
    assert points[0, 0] == pytest.approx(time[-1] - SECONDS, abs=2 * BIN)
    assert points[-1, 0] == pytest.approx(time[-1], abs=BIN)
    assert curve._ends.nbytes <= 100_000


def test_after_a_pause_what_is_older_is_not_told() -> None:
    curve = curve_of(np.array([0.0, 1.0, SECONDS + 0.5]), np.array([1.0, 2.0, 3.0]))
    assert curve.points().tolist() == [[1.0, 2.0], [SECONDS + 0.5, 3.0]]


def test_a_clock_that_is_set_back_begins_anew() -> None:
    curve = curve_of(np.array([100.0, 101.0, 50.0, 51.0]), np.array([1.0, 2.0, 3.0, 4.0]))
    assert curve.points().tolist() == [[50.0, 3.0], [51.0, 4.0]]

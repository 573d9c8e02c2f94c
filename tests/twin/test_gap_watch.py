"""The gap's state has a band, hysteresis and excursions."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from irtwin.twin.gap_watch import GapWatch, Windows, band

RATE = 100


def stretch(start: float, torque: np.ndarray, begins: bool = False) -> Any:
    """A stretch of one joint whose residual is given, without power."""
    time = start + np.arange(len(torque)) / RATE
    residual = torque[:, None]
    return SimpleNamespace(
        motion=SimpleNamespace(time=time), torque=np.zeros_like(residual), torque_residual=residual,
        power_residual=None, begins=begins,
    )  # fmt: skip


def watched(residual: np.ndarray, size: int) -> GapWatch:
    watch = GapWatch(["j1"], {"j1": 1.0, "robot": 5.0})
    for start in range(0, len(residual) - 1, size):
        watch.take(stretch(1000.0 + start / RATE, residual[start : start + size + 1], begins=start == 0))
    return watch


def seconds(*parts: tuple[float, float]) -> np.ndarray:
    return np.concatenate([np.full(int(RATE * long), size) for long, size in parts])


@pytest.mark.parametrize("size", [7, 25, 5000])
def test_the_state_is_left_and_entered_with_hysteresis(size: int) -> None:
    watch = watched(seconds((5, 0.5), (5, 3.0), (5, 1.3), (5, 0.5)), size)
    now = watch.places["j1"]
    assert (now.state, now.band) == ("inside", 1.0)
    assert now.residual == pytest.approx(0.5)
    (one,) = now.excursions
    assert 1005.0 < one.began <= 1006.0  # a window of two seconds is beyond the band soon
    assert one.ended is not None and 1015.0 < one.ended < 1017.1  # at 1.3 times the band it is still outside
    assert one.peak_ratio == pytest.approx(3.0)
    assert "robot" not in watch.places  # power was not measured


def test_a_moment_is_no_excursion() -> None:
    watch = watched(seconds((5, 0.5), (0.02, 8.0), (5, 0.5)), 50)
    assert watch.places["j1"].excursions == []
    assert watch.places["j1"].state == "inside"


def test_what_lasts_ends_with_the_run() -> None:
    watch = watched(seconds((3, 0.5), (6, 4.0)), 50)
    assert watch.places["j1"].excursions[-1].ended is None
    watch.end()
    assert watch.places["j1"].excursions[-1].ended is not None
    assert watch.places["j1"].state == "outside"


def test_windows_do_not_reach_over_a_hole() -> None:
    windows = Windows()
    first = list(windows.take(np.arange(300) / RATE, np.ones((300, 1)), begins=True))
    assert first and all(root == pytest.approx(1.0) for _, root in first)
    assert not list(windows.take(100 + np.arange(150) / RATE, np.full((150, 1), 9.0), begins=True))


def test_a_band_is_what_windows_seldom_exceed() -> None:
    windows = np.column_stack([np.linspace(0, 1, 1001), np.full(1001, np.nan)])
    assert band(windows)[0] == pytest.approx(0.99)
    assert np.isnan(band(windows)[1])

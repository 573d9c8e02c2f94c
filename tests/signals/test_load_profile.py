"""What a meter's log says by itself: plants whose standby, cycles and energies are known."""

from __future__ import annotations

import numpy as np
import pytest

from irtwin.signals.load_profile import OFF, STANDBY, WORKING, by_hour, load_profile

RNG = np.random.default_rng(0)
TIME = np.arange(0.0, 1200.0, 0.5)


def noisy(power: np.ndarray) -> np.ndarray:
    return np.maximum(power + RNG.normal(0.0, 2.0, len(power)), 0.0)


def test_standby_and_cycles_between_changes_of_level() -> None:
    within = TIME % 60.0  # 40 s of work with a ripple, 20 s of standby
    power = noisy(np.where(within < 40.0, 500.0 + 80.0 * np.sin(within), 120.0))
    found = load_profile(TIME, power)
    seconds = {state.name: state.seconds for state in found.states}
    assert seconds == {STANDBY: pytest.approx(400, rel=0.02), WORKING: pytest.approx(800, rel=0.02)}
    assert found.standby == pytest.approx(120.0, abs=1.0)
    assert (found.cycles.count, found.cycles.seconds) == (18, pytest.approx(60.0, abs=0.6))
    assert found.cycles.energy == pytest.approx(found.energy / 20, rel=0.02)
    assert found.standing.mean() == pytest.approx(1 / 3, abs=0.02)


def test_work_without_a_pause_repeats() -> None:
    power = noisy(400.0 + 100.0 * np.sin(2 * np.pi * TIME / 24.0) + 60.0 * np.sin(2 * np.pi * TIME / 8.0 + 1.0))
    found = load_profile(TIME, power)
    assert [state.name for state in found.states] == [WORKING]
    assert found.standby is None
    assert (found.cycles.count, found.cycles.seconds) == (49, pytest.approx(24.0, abs=0.5))  # whole ones


def test_noise_has_neither_levels_nor_cycles() -> None:
    found = load_profile(TIME, 300.0 + RNG.normal(0.0, 20.0, len(TIME)))
    assert (found.standby, found.cycles) == (None, None)


def test_a_supply_that_is_off() -> None:
    power = np.where(TIME < 600, 0.4, np.where(TIME % 200 < 100, 300.0, 110.0))
    assert [state.name for state in load_profile(TIME, power).states] == [OFF, STANDBY, WORKING]
    nothing = load_profile(TIME, np.zeros(len(TIME)))
    assert [state.name for state in nothing.states] == [OFF]
    assert (nothing.energy, nothing.cycles) == (0.0, None)


def test_energy_of_the_hours_of_the_clock() -> None:
    time = np.arange(100.0, 100.0 + 7201.0, 60.0)
    hours = by_hour(time, np.full(len(time), 1000.0), into=1800.0)
    assert hours == pytest.approx([1800e3, 3600e3, 1800e3])
    assert sum(hours) == pytest.approx(load_profile(time, np.full(len(time), 1000.0)).energy)

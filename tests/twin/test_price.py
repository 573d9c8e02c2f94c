"""What a motion costs, and how sure the twin is of it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from tests.synthetic import arm, measure, swing

from irtwin.twin.files import from_json, load, to_json
from irtwin.twin.identify import identify
from irtwin.twin.price import kilogram_less, price, saving, with_standing

ROBOT = arm(2)


def fitted(noise: float, seed: int = 0):
    """A twin of runs with noise, N m and W."""
    return identify(ROBOT, [measure(ROBOT, swing(ROBOT, of, seconds=10.0), noise, seed=seed) for of in (1, 2)])


def test_energy_is_the_integral_of_power_and_runs_add_up():
    twin, first, second = fitted(0.1), swing(ROBOT, 7), swing(ROBOT, 8)
    one, other, both = price(twin, [first]), price(twin, [second]), price(twin, [first, second])
    assert one.energy.value == pytest.approx(twin.energy(first))
    assert one.peak.value == twin.power(first).max()
    assert one.mean.value == pytest.approx(one.energy.value / one.seconds)
    assert both.energy.value == pytest.approx(one.energy.value + other.energy.value)
    assert both.peak.value == max(one.peak.value, other.peak.value)
    assert both.energy.half_width <= one.energy.half_width + other.energy.half_width


@pytest.mark.slow
def test_the_interval_is_that_of_the_parameters():
    """Parameters drawn from their covariance spread the energy as the interval says."""
    twin, motion = fitted(3.0), swing(ROBOT, 7)
    root = np.linalg.cholesky(twin.covariance + 1e-12 * np.eye(len(twin.covariance)))
    random = np.random.default_rng(0)

    def drawn():
        moved = root @ random.standard_normal(len(root))
        parameters = tuple(
            replace(each, value=each.value + by) for each, by in zip(twin.parameters, moved, strict=True)
        )
        return replace(twin, parameters=parameters).energy(motion)

    spread = 1.96 * np.std([drawn() for _ in range(150)])
    assert price(twin, [motion]).energy.half_width == pytest.approx(spread, rel=0.25)


@pytest.mark.slow
def test_the_interval_holds_the_truth():
    """Of ten twins of noisy runs, of a robot that is as they model it, nearly all say the true energy."""
    motion = swing(ROBOT, 7)
    true = np.trapezoid(measure(ROBOT, motion).power, motion.time)
    found = [price(fitted(3.0, seed), [motion]).energy for seed in range(10)]
    assert sum(abs(each.value - true) <= each.half_width for each in found) >= 8


def test_a_saved_twin_keeps_its_intervals(tmp_path):
    twin, motion = fitted(0.5), swing(ROBOT, 7)
    (tmp_path / "twin.json").write_text(to_json(twin))
    loaded, kept = (price(each, [motion]).energy for each in (load(tmp_path / "twin.json"), twin))
    assert (loaded.value, loaded.half_width) == pytest.approx((kept.value, kept.half_width), rel=1e-9)


def test_a_twin_of_an_older_file_prices_without_intervals(tmp_path):
    twin = from_json(to_json(replace(fitted(0.5), covariance=None)), tmp_path / "twin.json")
    found = price(twin, [swing(ROBOT, 7)])
    assert found.energy.half_width is None
    assert "intervals not known" in str(found)


def test_what_was_never_seen_has_no_price():
    motions = [replace(measure(ROBOT, swing(ROBOT, seed, seconds=10.0)), power=None) for seed in (1, 2)]
    assert price(identify(ROBOT, motions), [swing(ROBOT, 7)]) is None


def test_what_effects_leave_of_power_is_in_the_interval():
    """Runs that take more or less than each other, for no reason that a twin knows, take no less from then on."""
    motions = [measure(ROBOT, swing(ROBOT, of, seconds=10.0), 0.1, seed=of) for of in range(6)]
    off = [replace(one, power=one.power + by) for one, by in zip(motions, (9, -7, 4, -8, 6, -4), strict=True)]
    steady, varying = (price(identify(ROBOT, of), [swing(ROBOT, 7)]).energy.half_width for of in (motions, off))
    assert varying > 3 * steady


def test_a_kilogram_less_saves_what_it_takes_and_what_effects_leave_of_the_way_drops_out():
    motions = [measure(ROBOT, swing(ROBOT, of, seconds=10.0), 0.1, seed=of) for of in range(6)]
    twin, motion = identify(ROBOT, motions), replace(swing(ROBOT, 7), payload_com=(0.0, 0.0, 0.1))
    for carried, heavier in ((0.0, 1.0), (2.5, 2.5)):
        loaded, lighter = (replace(motion, payload_mass=mass) for mass in (heavier, heavier - 1))
        less = kilogram_less(twin, replace(motion, payload_mass=carried))
        assert less.value == pytest.approx(twin.energy(loaded) - twin.energy(lighter))
        unsure = kilogram_less(replace(twin, remainder=replace(twin.remainder, mean=50.0)), motion)
        assert 0 < unsure.half_width < 5.0


def test_a_motion_stands_longer_where_it_stood_last():
    motion = swing(ROBOT, 7)
    speeds = motion.dq.copy()
    speeds[300:340] = 0.0
    longer = with_standing(replace(motion, dq=speeds), motion.time[-1] + 1.0)
    stood = slice(340, 340 + round(motion.rate))
    assert longer.time[-1] == pytest.approx(motion.time[-1] + 1.0, abs=1 / motion.rate)
    assert (longer.q[stood] == motion.q[339]).all() and not longer.dq[stood].any()
    assert (longer.dq[-1] == speeds[-1]).all()


def test_what_a_pause_leaves_is_unsure_by_how_much_longer_it_stands_there():
    twin, motion = fitted(0.1), swing(ROBOT, 7)
    speeds = motion.dq.copy()
    speeds[300:360] = 0.0
    stands = replace(motion, dq=speeds)
    longer = with_standing(stands, stands.time[-1] + 5.0)
    unsure = replace(twin, remainder=replace(twin.remainder, pause=3.0))
    without, widened = (saving(one, stands, longer).half_width for one in (twin, unsure))
    assert widened == pytest.approx(np.hypot(without, 1.96 * 3.0 * 5.0), rel=0.02)
    assert saving(unsure, stands, stands).half_width == pytest.approx(saving(twin, stands, stands).half_width)

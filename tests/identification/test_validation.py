from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.synthetic import arm, swing

from irtwin.identification.validation import energy, energy_error, r_squared, rmse, split

MOTION = swing(arm(1), 1, seconds=3)


def named(*names):
    return [replace(MOTION, run=name) for name in names]


def test_one_run_is_cut_in_time():
    parts = split(named("only"))
    (fit,), (held_out,) = parts.fit, parts.held_out
    assert len(fit.time) == 200 and len(held_out.time) == 100
    assert fit.time[-1] < held_out.time[0]
    assert parts.part("only") == "both"
    assert "cut in time" in parts.rule


def test_repeats_of_one_motion_stay_together():
    names = [f"run_{k}" for k in range(12)]
    repeats = {"run_1": "run_0", "run_2": "run_1", "run_7": "run_4", "run_5": "run_4"}
    parts = split(named(*names), repeats)
    for group in (("run_0", "run_1", "run_2"), ("run_4", "run_5", "run_7")):
        assert len({parts.part(run) for run in group}) == 1


def test_repeats_of_one_motion_alone_are_cut_in_time():
    parts = split(named("a", "b", "c"), {"b": "a", "c": "a"})
    assert {parts.part(run) for run in "abc"} == {"both"}


@given(count=st.integers(3, 60), period=st.integers(2, 6))
def test_a_third_is_held_out_whatever_the_order_of_the_log(count, period):
    parts = split(named(*map(str, range(count))))
    assert {motion.run for motion in parts.fit}.isdisjoint(motion.run for motion in parts.held_out)
    assert len(parts.fit) + len(parts.held_out) == count
    assert abs(len(parts.held_out) - count / 3) <= 1.5
    if count >= 8 * period:  # every kind of a log that repeats a pattern is on both sides
        assert {int(motion.run) % period for motion in parts.held_out} == set(range(period))


def test_the_split_is_the_same_every_time():
    names = [str(k) for k in range(9)]
    assert [m.run for m in split(named(*names)).held_out] == [m.run for m in split(named(*names)).held_out]


def test_measures():
    measured = np.array([[1.0, 2.0], [3.0, 2.0]])
    assert rmse(measured, measured + np.array([1, -2])).tolist() == [1, 2]
    explained = r_squared(measured, measured + np.array([0.5, 0]))
    assert explained[0] == pytest.approx(0.75)
    assert np.isnan(explained[1])


def test_energy_and_its_error_are_those_of_the_seed_paper():
    time = np.linspace(0, 2, 5)
    assert energy(time, 3 * time) == pytest.approx(6.0)
    assert energy_error(598.78, 559.59) == pytest.approx(6.54, abs=0.01)  # Yan 2018, eqs. 13 to 15

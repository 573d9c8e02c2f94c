"""Noise of positions: how large it is, what it puts into equations, and that no effect is blamed for it."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from tests.synthetic import arm, as_run, measure, swing

from irtwin.effects.catalogue import EXCITED, catalogue
from irtwin.effects.stack import Stack
from irtwin.gap.data.noise_floor import shaken
from irtwin.gap.isolation.structure_search import attribute
from irtwin.gap.regression.channel_equations import torque_system, with_load
from irtwin.gap.regression.cross_fitted import LeftOut
from irtwin.gap.regression.groups import Grouping
from irtwin.gap.regression.hypotheses import MISSING, hypotheses
from irtwin.gap.regression.moments import Summed
from irtwin.gap.regression.normal_equations import System
from irtwin.gap.thresholds import DEFAULT
from irtwin.signals.conditioning import condition_for_fit
from irtwin.signals.log import Run
from irtwin.signals.motion import Motion

ROBOT, CUTOFF, NOISE = arm(2), 12.0, 2e-4
MOTION = measure(ROBOT, swing(ROBOT, 1, rate=200.0), noise=0.05, seed=1)


def logged(seed: int, noise: float = NOISE) -> Run:
    """A run whose positions have noise, rad."""
    motion = measure(ROBOT, swing(ROBOT, seed, rate=200.0), noise=0.05, seed=seed)
    noisy = motion.q + noise * np.random.default_rng(seed).standard_normal(motion.q.shape)
    return replace(as_run(motion, q=noisy), name=f"run_{seed}", role="observed")


def rounded(motion: Motion, step: float, q: np.ndarray) -> Run:
    """The motion's log with these positions, (N, 2) rad, as an encoder of some step, rad, tells them."""
    return replace(as_run(motion, q=np.round(q / step) * step), name="rounded", role="observed")


def shaken_beside(run: Run) -> tuple[Motion, Motion]:
    """A run as it is taken, and with the noise of its positions put in once more."""
    taken = condition_for_fit(run, ROBOT, CUTOFF)
    ((same, again),) = shaken([run], {run.name: taken}, ROBOT, DEFAULT.data)
    assert same is taken
    return taken, again


def equations(runs: list[Run], *, told: bool) -> System:
    """The equations of torque with an elastic joint as the candidate; `told` what the noise of positions does."""
    motions = {run.name: condition_for_fit(run, ROBOT, CUTOFF) for run in runs}
    stack = Stack(ROBOT, EXCITED)
    grouping = Grouping({name: name for name in motions}, frozenset(motions))
    alone: Any = stack, list(motions.values()), grouping
    below = with_load(ROBOT, LeftOut(stack, torque_system(*alone, (), None)).below)
    elastic = [catalogue()["joint_elasticity"]]
    pairs = shaken(runs, motions, ROBOT, DEFAULT.data) if told else ()
    return torque_system(*alone, elastic, below, shaken=pairs)


def blamed(system: System) -> list[str]:
    """The effects that are found missing."""
    candidates = hypotheses(system.columns, system.base, MISSING)
    return [cause.effect for cause in attribute(system.by_speed, candidates, DEFAULT.criterion).causes]


def test_shaking_adds_as_much_noise_as_there_is() -> None:
    motion, again = shaken_beside(logged(1))
    clean = condition_for_fit(logged(1, noise=0.0), ROBOT, CUTOFF)
    for name in ("q", "dq", "ddq"):
        added, there = (np.std(getattr(a, name) - getattr(motion, name), axis=0) for a in (again, clean))
        assert added == pytest.approx(there, rel=0.15)
    assert again.torque is motion.torque


def test_of_a_coarse_encoder_shaking_adds_what_its_filter_passes() -> None:
    """Shaken positions lie on no grid; filtered as if their encoder were fine they would be several times as noisy."""
    taken, again = shaken_beside(rounded(MOTION, 2e-3, MOTION.q))
    added, there = (np.std(one.dq - other.dq, axis=0) for one, other in ((again, taken), (taken, MOTION)))
    assert added == pytest.approx(there, rel=0.3)


def test_rounding_at_a_steady_speed_is_noise_though_it_makes_lines() -> None:
    step = 2e-4
    taken, again = shaken_beside(rounded(MOTION, step, np.repeat(0.03 * MOTION.time[:, None], 2, axis=1)))
    assert np.all(np.std(again.q - taken.q, axis=0) > 0.4 * step / np.sqrt(12))


def test_rounding_of_what_stands_still_is_no_noise() -> None:
    second = len(MOTION.time) // 2
    q = np.where(MOTION.time[:, None] < MOTION.time[second], MOTION.q, MOTION.q[second])
    taken, again = shaken_beside(rounded(MOTION, 2e-4, q))
    at_rest = slice(second + 100, None)
    np.testing.assert_allclose(again.dq[at_rest], taken.dq[at_rest], atol=1e-9)
    assert np.std(again.dq[:second] - taken.dq[:second], axis=0).min() > 1e-4


def test_of_a_long_run_the_middle_is_shaken(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("irtwin.gap.data.noise_floor._ENOUGH", 100)
    run = logged(1)
    motion = condition_for_fit(run, ROBOT, CUTOFF)
    ((same, again),) = shaken([run, run], {run.name: motion}, ROBOT, DEFAULT.data)
    first = (len(motion.time) - 100) // 2
    np.testing.assert_array_equal(same.q, motion.q[first : first + 100])
    assert again.q.shape == same.q.shape
    assert same.whole is None  # what depends on the past begins there


def test_only_observed_runs_are_shaken() -> None:
    run = replace(logged(1), role="reference")
    assert not shaken([run], {run.name: condition_for_fit(run, ROBOT, CUTOFF)}, ROBOT, DEFAULT.data)


@pytest.mark.slow
def test_noise_of_positions_is_no_elastic_joint() -> None:
    runs = [logged(seed) for seed in range(1, 6)]
    assert blamed(equations(runs, told=False)) == ["joint_elasticity"]
    assert blamed(equations(runs, told=True)) == []


def test_noise_of_positions_explains_no_more_than_what_is_left() -> None:
    system = equations([logged(seed) for seed in range(1, 6)], told=True).by_speed
    coefficients = np.append(-system.solution((), Summed(system.group_moments(system.noise_before))), 1.0)
    ten_times = {name: tuple(100 * each for each in getattr(system, name)) for name in ("shaken", "shaken_twin")}
    more = replace(system, **ten_times)
    own, of_more = (one.shaken_products(coefficients, one.noise_before) for one in (system, more))
    made = coefficients @ of_more.sum(axis=0)
    assert made <= 1.001 * system.rows.sum()
    assert np.all(np.abs(own) <= 1.001 * np.abs(of_more))


@pytest.mark.slow
def test_what_noise_of_positions_makes_is_no_gap() -> None:
    noisy, clean = (
        equations([logged(seed, noise) for seed in range(1, 6)], told=True).with_columns(())[0].by_speed
        for noise in (NOISE, 0.0)
    )
    fast = noisy.halves[0]
    assert np.all(noisy.noise_before[fast] > 5 * clean.noise_before[fast])
    assert noisy.position_noise[fast] == pytest.approx(noisy.noise_before[fast], rel=0.15)
    assert np.all(noisy.position_noise <= noisy.noise_before)  # where friction turns, too
    assert np.all(clean.position_noise < 1e-3 * clean.noise_before)

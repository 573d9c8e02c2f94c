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
from irtwin.gap.regression.normal_equations import System
from irtwin.gap.thresholds import DEFAULT
from irtwin.signals.conditioning import condition_for_fit
from irtwin.signals.log import Run

ROBOT, CUTOFF, NOISE = arm(2), 12.0, 2e-4


def logged(seed: int, noise: float = NOISE) -> Run:
    """A run whose positions have noise, rad."""
    motion = measure(ROBOT, swing(ROBOT, seed, rate=200.0), noise=0.05, seed=seed)
    noisy = motion.q + noise * np.random.default_rng(seed).standard_normal(motion.q.shape)
    return replace(as_run(motion, q=noisy), name=f"run_{seed}", role="observed")


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
    return [cause.effect for cause in attribute(system, candidates, DEFAULT.criterion).causes]


def test_shaking_adds_as_much_noise_as_there_is() -> None:
    run = logged(1)
    motion = condition_for_fit(run, ROBOT, CUTOFF)
    clean = condition_for_fit(logged(1, noise=0.0), ROBOT, CUTOFF)
    ((same, again),) = shaken([run], {run.name: motion}, ROBOT, DEFAULT.data)
    assert same is motion
    for name in ("q", "dq", "ddq"):
        added, there = (np.std(getattr(a, name) - getattr(motion, name), axis=0) for a in (again, clean))
        assert added == pytest.approx(there, rel=0.15)
    assert again.torque is motion.torque


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


def test_noise_of_positions_is_no_elastic_joint() -> None:
    runs = [logged(seed) for seed in range(1, 6)]
    assert blamed(equations(runs, told=False)) == ["joint_elasticity"]
    assert blamed(equations(runs, told=True)) == []


def test_what_noise_of_positions_makes_is_no_gap() -> None:
    noisy, clean = (
        equations([logged(seed, noise) for seed in range(1, 6)], told=True).with_columns(())[0].by_speed
        for noise in (NOISE, 0.0)
    )
    fast = noisy.halves[0]
    assert np.all(noisy.noise_before[fast] > 5 * clean.noise_before[fast])
    assert noisy.position_noise[fast] == pytest.approx(noisy.noise_before[fast], rel=0.15)
    assert np.all(noisy.position_noise <= noisy.noise_before)  # where friction turns, too
    assert not clean.position_noise.any()

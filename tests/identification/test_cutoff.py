"""The cutoff by what sensors resolve: a coarse encoder lowers it, a fine one leaves it."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest
from tests.synthetic import arm, as_run, measure, swing

from irtwin.document.document import Cutoff
from irtwin.identification.cutoff import cutoff_for
from irtwin.robot.description import Robot
from irtwin.signals.conditioning import choose_cutoff, condition
from irtwin.signals.log import Run
from irtwin.twin.identify import identify

ROBOT = arm(2)


def runs(step: float, count: int = 2) -> list[Run]:
    """Logs of an encoder of so many rad a step, whose samples come late by up to two hundredths of an interval."""
    rng = np.random.default_rng(0)
    found = []
    for seed in range(1, count + 1):
        motion = measure(ROBOT, swing(ROBOT, seed, rate=200.0), noise=0.5, seed=seed)
        late = motion.dq * rng.uniform(0, 0.02 / 200.0, motion.q.shape)
        found.append(as_run(motion, q=np.round((motion.q - late) / step) * step))
    return found


def test_a_fine_encoder_leaves_ten_times_the_band() -> None:
    fine = runs(1e-6)
    found = cutoff_for(ROBOT, fine, None)
    why = "found: 10 times the bandwidth of the motion"
    assert found == Cutoff(hz=choose_cutoff(fine), stated=False, why=why)


def test_noise_of_a_coarse_encoder_is_no_louder_than_that_of_torque() -> None:
    coarse = runs(5e-3)
    highest, found = choose_cutoff(coarse), cutoff_for(ROBOT, coarse, None)
    assert found.hz <= highest / 2
    assert f"{highest:.3g} Hz, halved as noise of positions is louder than that of torque" in found.why


@pytest.mark.slow
def test_what_a_simulator_lacks_of_noise_says_nothing_of_the_robots_sensors() -> None:
    coarse, exact = runs(5e-3), [replace(run, name=f"{run.name} again", role="simulated") for run in runs(1e-9)]
    assert cutoff_for(ROBOT, [*coarse, *exact], None) == cutoff_for(ROBOT, coarse, None)
    assert cutoff_for(ROBOT, exact, None).hz == choose_cutoff(exact)


def test_a_stated_one_is_taken_as_it_is() -> None:
    assert cutoff_for(ROBOT, runs(1e-6), 7.25) == Cutoff(hz=7.25, stated=True, why="stated")


def with_steps(run: Run) -> Run:
    """Have a run's positions jump now and then, as those of a bus that loses packets do: the speed is widely spread."""
    rng = np.random.default_rng(1)
    q = run.signals.q.copy()
    for k in rng.integers(10, len(q) - 10, 60):
        q[k : k + 4] = q[k]
    return replace(run, signals=replace(run.signals, q=q))


def of_others(robot: Robot, fitted: list[Run], judged: Run, cutoff: float) -> np.ndarray:
    """Return the RMS, N m a joint, that a fit leaves in the torque of another run as it was logged."""
    twin = identify(robot, [condition(run, robot, cutoff) for run in fitted])
    motion = condition(judged, robot, cutoff)
    values = np.array([twin.value(effect.id, term) for effect, term in twin.stack.torque_terms])
    torque = judged.signals.torque
    return np.asarray(np.sqrt(np.mean((torque - twin.stack.shown_torque(motion, values)) ** 2, axis=0)))


@pytest.mark.slow
def test_a_lower_cutoff_is_taken_where_it_tells_another_run_better() -> None:
    coarse = [with_steps(run) for run in runs(5e-4, 3)]
    highest, found = choose_cutoff(coarse), cutoff_for(ROBOT, coarse, None).hz
    assert found < highest / 2
    left = of_others(ROBOT, coarse[:2], coarse[2], found)
    assert np.all(left < of_others(ROBOT, coarse[:2], coarse[2], highest))


def test_one_run_is_cut_in_halves() -> None:
    (coarse,) = (with_steps(run) for run in runs(5e-4, 1))
    highest, found = choose_cutoff([coarse]), cutoff_for(ROBOT, [coarse], None)
    assert found.hz < highest
    assert re.search("Hz, halved [2-9] times, as that tells held-out torque better$", found.why)


def test_without_torque_nothing_tells_it() -> None:
    silent = [replace(run, signals=replace(run.signals, torque=None)) for run in runs(5e-4)]
    assert cutoff_for(ROBOT, silent, None).hz == choose_cutoff(silent)


def test_what_cannot_be_cut_in_two_keeps_ten_times_the_band() -> None:
    (run,) = runs(1e-6, 1)
    short = replace(run, signals=run.signals.rows(slice(40)))
    assert cutoff_for(ROBOT, [short], None).hz == choose_cutoff([short])

"""Rows in which dry friction turns: how it does so may differ from side to side, is no change, and hides none."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tests.data_sets import write
from tests.synthetic import arm, as_run, measure, swing, truth

from irtwin.document.document import Document
from irtwin.effects.catalogue import catalogue
from irtwin.effects.effect import Predicted
from irtwin.effects.friction import turning
from irtwin.effects.stack import Stack
from irtwin.errors import InputError
from irtwin.gap.diagnosis import diagnose
from irtwin.gap.isolation.apart import Apart, closed_squares
from irtwin.gap.regression.channel_equations import torque_system
from irtwin.gap.regression.groups import Grouping
from irtwin.gap.regression.held_out import left_out
from irtwin.gap.regression.moments import Summed
from irtwin.gap.regression.normal_equations import System
from irtwin.signals.filter import low_pass
from irtwin.signals.log import Run, read_data_set

ROBOT = arm(2)
WIDTH = 0.01  # rad/s


def run(seed: int, role: str, width: float, stronger: float) -> Run:
    """A run whose dry friction turns over some speed, `stronger` times the truth's at the first joint."""
    motion = measure(ROBOT, swing(ROBOT, seed), noise=0.05, seed=seed)
    dry = truth(ROBOT)["Fc"]
    now = dry * [stronger, 1.0]
    torque = motion.torque + now * np.tanh(motion.dq / width) - dry * np.sign(motion.dq)
    return replace(as_run(replace(motion, torque=torque, current=None, power=None)), name=f"{role}_{seed}", role=role)


def causes(folder: Path, width: float, stronger: float = 1.0) -> dict[str, tuple[str, ...]]:
    """What is told of observed runs whose friction turns over another speed: effects of 0.5 and more, their joints."""
    runs = [run(seed, "reference", WIDTH, 1.0) for seed in (1, 2, 3)]
    runs += [run(seed, "observed", width, stronger) for seed in (4, 5, 6)]
    found = diagnose(read_data_set(write(folder / "set", ROBOT, runs))).document
    return {cause.effect: tuple(cause.joints) for cause in found.causes if cause.confidence >= 0.5}


@pytest.mark.slow
@pytest.mark.parametrize("width", [0.004, pytest.param(0.025, marks=pytest.mark.nightly)])
def test_a_turn_over_another_speed_is_no_change_of_friction(tmp_path: Path, width: float) -> None:
    assert causes(tmp_path, width) == {}


@pytest.mark.slow
def test_a_change_of_dry_friction_is_told_beside_a_turn_over_another_speed(tmp_path: Path) -> None:
    assert causes(tmp_path, 0.025, stronger=1.3) == {"coulomb_friction": ("joint_1",)}


def diagnosed(folder: Path, law: Callable[[np.ndarray], np.ndarray], way: float = 1.0) -> Document:
    """What is told of three runs of a robot whose dry friction goes with speed by a law, joint 2 a part of its way."""
    runs = []
    for seed in (1, 2, 3):
        moved, part = swing(ROBOT, seed), np.array([1.0, way])
        moved = replace(moved, q=part * moved.q, dq=part * moved.dq, ddq=part * moved.ddq)
        motion = measure(ROBOT, moved, noise=0.05, seed=seed)
        torque = motion.torque + truth(ROBOT)["Fc"] * (law(motion.dq) - np.sign(motion.dq))
        runs.append(as_run(replace(motion, torque=torque, current=None, power=None)))
    return diagnose(read_data_set(write(folder / "set", ROBOT, runs))).document


@pytest.mark.slow
@pytest.mark.parametrize(
    ("law", "way"),
    [
        pytest.param(lambda dq: np.tanh(dq / 0.008), 0.03, id="a joint that hardly moves"),
        pytest.param(lambda dq: np.arctan(dq / 0.015) * 2 / np.pi, 0.2, id="long tails", marks=pytest.mark.nightly),
    ],
)
def test_a_turn_that_few_blocks_show_or_no_width_describes_is_no_cause(tmp_path: Path, law, way: float) -> None:
    found = diagnosed(tmp_path, law, way)
    assert found.verdict == "no_gap"
    assert found.causes == ()


@pytest.mark.slow
def test_friction_that_falls_with_speed_is_told_beside_a_turn(tmp_path: Path) -> None:
    found = diagnosed(tmp_path, lambda dq: np.tanh(dq / 0.01) * (1 + 0.4 * np.exp(-((dq / 0.05) ** 2))))
    assert [(cause.effect, sorted(cause.joints)) for cause in found.causes] == [
        ("stribeck_friction", ["joint_1", "joint_2"])
    ]


def reduced(noise: float, last: float | None = None) -> System:
    """The equations of torque with viscous friction as the candidate; `noise` N m more where dry friction turns.

    `last`: so much in the last of five runs.
    """
    motions = []
    for seed in range(1, 6):
        motion = replace(measure(ROBOT, swing(ROBOT, seed), noise=0.05, seed=seed), cutoff=15.0)
        level = noise if last is None or seed < 5 else last
        more = level * np.random.default_rng(seed).standard_normal(motion.dq.shape)
        logged = low_pass(motion.torque + more * turning(ROBOT, motion.dq), motion.rate, 15.0)
        motions.append(replace(motion, torque=logged))
    grouping = Grouping({one.run: one.run for one in motions}, frozenset(one.run for one in motions))
    stack = Stack(ROBOT, ("rigid_body", "rotor_inertia", "coulomb_friction", "torque_offset"))
    return torque_system(stack, motions, grouping, [catalogue()["viscous_friction"]], lambda whole: Predicted(whole.q))


def test_what_friction_does_where_it_turns_is_noise_of_these_rows_alone() -> None:
    system = reduced(noise=3.0)
    viscous = [system.base, system.base + 1]
    together = system.residual_rms(viscous, system.noise_before)
    apart = system.by_speed.residual_rms(viscous, system.by_speed.residual_rms(viscous, system.by_speed.noise_before))
    assert np.all(together > 1.5 * apart[:2])
    assert np.all(apart[2:] > 5 * apart[:2])


def test_rows_that_stand_apart_say_together_what_they_said() -> None:
    system = reduced(noise=0.0)
    apart = system.by_speed
    noise = np.array([0.05, 0.08])
    every = np.arange(system.size + 1)
    whole, parts = Summed(system.moments(noise)).of(every), Summed(apart.moments(np.tile(noise, 2))).of(every)
    np.testing.assert_allclose(parts, whole, rtol=1e-9, atol=1e-9 * np.abs(whole).max())
    np.testing.assert_array_equal(apart.rows[:, :2] + apart.rows[:, 2:], system.rows)
    assert np.all(apart.rows > 0)
    assert len(apart.moments(np.tile(noise, 2))) == 2 * system.groups


def test_too_many_columns_are_refused_by_the_joints_there_are(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("irtwin.gap.regression.normal_equations._MOST_BYTES", 1000)
    with pytest.raises(InputError, match="trying every effect on 2 joints takes"):
        reduced(noise=0.0).by_speed.residual_rms((), np.ones(4))


def test_a_group_is_left_out_with_all_its_rows() -> None:
    system = reduced(noise=0.0)
    apart, noise, every = system.by_speed, np.array([0.05, 0.08]), np.arange(system.groups)
    whole = left_out(system, noise, (), every)
    parts = left_out(apart, np.tile(noise, 2), (), every)
    np.testing.assert_allclose(parts[:, :2] + parts[:, 2:], whole, rtol=1e-6)


def test_rows_are_never_less_noisy_where_friction_turns() -> None:
    apart = reduced(noise=0.0).by_speed
    fast, slow = np.split(apart.noise_before, 2)
    assert np.all(slow >= fast)


def test_what_is_left_where_friction_turns_is_no_gap() -> None:
    system, floor = reduced(noise=3.0), np.array([0.02, 0.02])
    first, second = [system.base], [system.base + 1]
    apart = Apart.of(system, system, [first, second], [True, True])
    before, after = apart.left
    assert np.all(before > 2 * after)
    assert np.all(1.5 * after < system.residual_rms(apart.chosen, system.noise_before))
    np.testing.assert_array_equal(apart.level(floor), floor)


@pytest.mark.parametrize(("noise", "otherwise"), [(3.0, False), (30.0, True)])
def test_friction_that_turns_otherwise_than_in_the_reference_runs_shows(noise: float, otherwise: bool) -> None:
    system = reduced(noise=3.0, last=noise)
    one = replace(system, observed=np.array([block.run == system.blocks[-1].run for block in system.blocks]))
    assert (Apart.of(one, one, [], []).turned(np.array([0.02, 0.02])).max() > 0) == otherwise
    assert Apart.of(system, system, [], []).turned(np.array([0.02, 0.02])).max() == -np.inf


def test_what_is_closed_where_friction_turns_counts_by_the_noise_there() -> None:
    system = reduced(noise=3.0)
    apart = Apart.of(system, system, [[system.base, system.base + 1]], [True])
    held_out = apart.held_out()
    plain = left_out(system, system.noise_before, (), np.arange(system.groups))
    assert np.all(held_out.before.sum(axis=0) < plain.sum(axis=0))
    np.testing.assert_array_equal(held_out.rows, system.rows)
    closed = closed_squares(apart)
    np.testing.assert_allclose(closed.sum(axis=0), held_out.before - held_out.after, rtol=1e-6)


@pytest.mark.parametrize("changed", [False, True])
def test_columns_that_nobody_asks_for_can_be_left_out(changed: bool) -> None:
    system = reduced(noise=0.0)
    if changed:  # the last run is held against the others
        system = replace(system, observed=np.array([block.run == system.blocks[-1].run for block in system.blocks]))
    second = system.base + 1 + 2 * changed
    kept, places = system.with_columns([second])
    assert places == [system.base + changed]
    assert len(kept.columns) == 1
    noise = np.array([0.05, 0.08])
    np.testing.assert_allclose(kept.residual_rms(places, noise), system.residual_rms([second], noise), rtol=1e-6)

"""Friction that differs from run to run: by how much is found, and equations in which it is noise alone."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from irtwin.effects.effect import Term
from irtwin.effects.friction import CoulombFriction, ViscousFriction
from irtwin.gap.isolation.steadied import Steadied
from irtwin.gap.regression.normal_equations import System
from irtwin.gap.regression.run_to_run import RunToRun
from irtwin.identification.accumulate import Block, triangle

JOINTS, BLOCKS, ROWS, NOISE = 5, 6, 200, 0.1
FRICTION = np.array([3.0, 2.0])  # N m, N m s/rad
KINDS = "dry", "viscous"


def system(share: float, runs: int, *, changed: float = 0.0, seed: int = 0) -> System:
    """Joints with dry and viscous friction that differ by a share from run to run; the later half is `changed`."""
    generator = np.random.default_rng(seed)
    blocks, observed = [], []
    for run in range(runs):
        later = run >= runs // 2
        of_run = FRICTION * (1 + changed * later) * (1 + share * generator.standard_normal((JOINTS, 2)))
        for number in range(BLOCKS):
            speed = generator.uniform(-1, 1, (ROWS, JOINTS))
            columns = np.stack([np.sign(speed), speed], axis=-1)
            measured = (columns * of_run).sum(axis=-1) + NOISE * generator.standard_normal((ROWS, JOINTS))
            factors = tuple(triangle(np.column_stack([columns[:, j], measured[:, j]])) for j in range(JOINTS))
            blocks.append(Block(f"run_{run}", number, number + 1.0, np.full(JOINTS, ROWS), factors))
            observed.append(later)
    effects = CoulombFriction(), ViscousFriction()
    terms = tuple((effect, Term(effect.id, "1", f"j{j}", spread=30.0)) for j in range(JOINTS) for effect in effects)
    pattern = np.kron(np.eye(JOINTS, dtype=bool), np.ones((1, 2), dtype=bool))
    return System(terms, (), pattern, tuple(blocks), np.arange(len(blocks)) // BLOCKS, np.array(observed))


def sides(runs: int) -> list[set[str]]:
    """The runs before, and those after."""
    names = [f"run_{run}" for run in range(runs)]
    return [set(names[: runs // 2]), set(names[runs // 2 :])]


@pytest.mark.parametrize("share", [0.01, 0.03, 0.1])
@pytest.mark.parametrize("changed", [0.0, 0.5])
def test_finds_by_how_much_friction_differs_whatever_has_changed_between_the_sides(
    share: float, changed: float
) -> None:
    found = RunToRun.of(system(share, 12, changed=changed), sides(12)).shares
    assert list(found) == list(KINDS)
    assert list(found.values()) == pytest.approx([share] * 2, rel=0.5)  # 50 numbers of each kind, and a coarse grid


def test_what_does_not_differ_is_left_as_it_is() -> None:
    equations = system(0.0, 12)
    found = RunToRun.of(equations, sides(12))
    assert max(found.shares.values()) <= 0.0025
    assert RunToRun(dict.fromkeys(KINDS, 0.0), found.frictions).steadied(equations) is equations


def test_what_differs_becomes_noise_as_loud_as_within_a_run() -> None:
    equations = system(0.05, 12)
    left = RunToRun.of(equations, sides(12)).steadied(equations).noise_before
    assert np.all(equations.noise_before > 1.2 * NOISE)
    assert left == pytest.approx(np.full(JOINTS, NOISE), rel=0.05)


def test_rows_are_multiplied_by_the_inverse_root_of_their_covariance() -> None:
    equations = system(0.05, 6)
    found = RunToRun.of(equations, sides(6))
    run = [k for k, block in enumerate(equations.blocks) if block.run == "run_2"]
    friction = found.frictions[0]
    before = np.concatenate([equations.blocks[k].factors[0] for k in run])
    after = np.concatenate([found.steadied(equations).blocks[k].factors[0] for k in run])
    columns = before[:, friction.places] * friction.values * list(found.shares.values())
    covariance = np.eye(len(before)) + columns @ columns.T / friction.noise
    np.testing.assert_allclose(after.T @ after, before.T @ np.linalg.solve(covariance, before), atol=1e-9)


def test_one_joint_that_is_modelled_badly_decides_nothing() -> None:
    equations = system(0.02, 12)
    generator = np.random.default_rng(9)
    wild = {f"run_{run}": 1 + 0.5 * generator.standard_normal() for run in range(12)}

    def spoilt(block: Block) -> Block:
        first = block.factors[0].copy()
        first[:, -1] *= wild[block.run]
        return replace(block, factors=(first, *block.factors[1:]))

    found = RunToRun.of(replace(equations, blocks=tuple(map(spoilt, equations.blocks))), sides(12)).shares
    assert max(found.values()) < 0.05


def test_repeats_that_differ_by_friction_have_a_floor_of_noise_within_a_run() -> None:
    equations = system(0.05, 12)
    found = RunToRun.of(equations, sides(12))
    rows = {f"run_{run}": np.full(JOINTS, float(BLOCKS * ROWS)) for run in range(12)}
    made = found.mean_squares([sorted(side) for side in sides(12)], rows)
    expected = np.sum((0.05 * FRICTION) ** 2 * [1.0, 1 / 3])  # speeds are even: their mean square is a third
    assert np.median(made) == pytest.approx(expected, rel=0.5)
    still, positions = np.zeros((1, JOINTS)), np.full((1, JOINTS), 2 * NOISE)
    steadied = Steadied(equations, found.shares, made, np.full(JOINTS, 0.9 * NOISE), still)
    signal = np.sqrt(made + NOISE**2)
    assert steadied.floor(signal) == pytest.approx(signal)
    assert steadied.within(signal) == pytest.approx(np.full(JOINTS, NOISE), rel=1e-6)
    assert steadied.within(np.sqrt(made)) == pytest.approx(np.full(JOINTS, 0.9 * NOISE))
    unknown = replace(steadied, sensors=np.full(JOINTS, np.inf))
    assert unknown.within(signal) == pytest.approx(signal)  # nobody knows what noise is without friction
    assert steadied.within(None) is None and steadied.floor(None) is None
    shaken = replace(steadied, positions=positions)  # noise of positions is in both
    assert shaken.within(signal) == pytest.approx(np.full(JOINTS, np.sqrt(5) * NOISE))
    assert shaken.floor(signal) == pytest.approx(np.sqrt(signal**2 + (2 * NOISE) ** 2))

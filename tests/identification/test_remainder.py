"""What a fit leaves of power that it did not see."""

from __future__ import annotations

import numpy as np
import pytest

from irtwin.effects.effect import Term
from irtwin.identification.accumulate import Block
from irtwin.identification.remainder import Remainder, of_pauses, of_rest, remainder

TERMS = [Term("P0", "W", spread=600.0, lowest=0.0), Term("F", "N m", spread=100.0)]
SECONDS, ROWS = 10.0, 200


def blocks(runs: int, lasting: float, noise: float, seed: int = 0) -> list[Block]:
    """Two blocks a run of 100 W and 3 x; each run is `lasting` W off by one draw, each row by `noise` W."""
    rng = np.random.default_rng(seed)
    found = []
    for run in range(runs):
        off = lasting * rng.standard_normal()
        for half in range(2):
            speed = rng.uniform(0, 2, ROWS)
            watts = 100 + off + 3 * speed + noise * rng.standard_normal(ROWS)
            rows = np.column_stack([np.ones(ROWS), speed, watts])
            start = half * SECONDS / 2
            found.append(Block(str(run), start, start + SECONDS / 2, np.array([ROWS]), (np.linalg.qr(rows, "r"),)))
    return found


def test_what_lasts_a_run_is_told_from_noise():
    found = left(blocks(60, 2.0, 1.0))
    assert found.sample == pytest.approx(5**0.5, rel=0.25)
    assert found.seconds == pytest.approx(50.0)  # five runs a group
    assert found.mean == pytest.approx(1.12 * 2.0 / 5**0.5, rel=0.5)  # by Student's t of twelve groups


def test_what_coefficients_are_unsure_by_is_no_remainder():
    noisy, lasting = (left(blocks(8, off, 1.0)).mean for off in (0.0, 2.0))
    assert noisy < 0.1 * lasting


def test_of_one_run_stretches_of_time_tell():
    runs = enumerate(blocks(10, 2.0, 0.1))
    long = [Block("one", k * SECONDS, (k + 1) * SECONDS, block.rows, block.factors) for k, block in runs]
    assert left(long).mean > 0.5
    assert left(long[:3]) is None


def test_what_predicted_torque_leaves_is_of_the_remainder():
    logged = blocks(60, 0.0, 1.0)
    offs = 2.0 * np.random.default_rng(1).standard_normal(60)
    predicted = [shifted(block, offs[int(block.run)]) for block in logged]
    assert remainder(logged, predicted, TERMS, None, 0).mean > 5 * left(logged).mean


def left(some: list[Block]) -> Remainder | None:
    return remainder(some, some, TERMS, None, 0)


def shifted(block: Block, watts: float) -> Block:
    (factor,) = block.factors
    return Block(block.run, block.start, block.stop, block.rows, (factor + watts * factor[:, :1] * [0, 0, 1],))


def test_it_lasts_a_motion_and_is_noise_in_a_shorter_one():
    left = Remainder(sample=3.0, mean=2.0, seconds=10.0)
    assert left.energy(20.0) == pytest.approx(40.0)
    assert left.energy(10.0) == pytest.approx(20.0)
    assert left.energy(2.5) == pytest.approx(10.0)


def test_each_pause_has_what_is_left_of_its_own():
    rng = np.random.default_rng(1)
    lengths = rng.integers(30, 100, 200)
    pauses = [2.0 * rng.standard_normal() + rng.standard_normal(n) for n in lengths]
    assert of_pauses(pauses) == pytest.approx(2.0, rel=0.2)
    assert of_pauses([rng.standard_normal(n) for n in lengths]) < 0.1
    assert of_pauses(pauses[:3]) == 0.0


def test_the_power_at_rest_is_known_better_by_more_pauses():
    rng = np.random.default_rng(0)
    few, many = ([np.full(100, 2.0 * rng.standard_normal()) for _ in range(count)] for count in (5, 500))
    assert of_rest(many) == pytest.approx(2.0 / 500**0.5, rel=0.15)
    assert of_rest(few) == pytest.approx(of_pauses(few) / 5**0.5)
    assert of_rest(few[:2]) == of_rest([]) == 0.0

from __future__ import annotations

import sys
from dataclasses import replace

import numpy as np
import pytest
from tests.synthetic import arm, measure, swing

from irtwin.effects.catalogue import BASELINE
from irtwin.effects.stack import Stack
from irtwin.errors import InputError
from irtwin.identification import accumulate as room
from irtwin.identification.accumulate import Rows, accumulate, accumulate_any, part_read
from irtwin.identification.estimators import combine
from irtwin.signals.filter import decimate, decimation, kernel

ROBOT = arm(3)
STACK = Stack(ROBOT, BASELINE)


def equations(motion):
    columns = STACK.torque_columns(motion)
    return Rows(columns, columns @ STACK.shift(motion), motion.torque)


def products(motion, step=1, taps=None):
    """What the factors must reproduce: the inner products of all columns, from all samples at once."""
    taps = np.ones(1) if taps is None else taps
    half = len(taps) // 2
    columns = decimate(STACK.torque_columns(motion), taps, step)
    measured = motion.torque[half : len(motion.time) - half : step]
    rows = np.concatenate([columns, measured[:, :, None]], axis=2)
    return np.einsum("tja,tjb->jab", rows, rows)


def reduced(motions):
    blocks = accumulate(motions, equations, STACK.pattern)
    factors = [combine([block.factors[e] for block in blocks], used) for e, used in enumerate(STACK.pattern)]
    return blocks, np.array([factor.T @ factor for factor in factors])


def test_factors_hold_every_inner_product():
    motion = measure(ROBOT, swing(ROBOT, 1))
    blocks, found = reduced([motion])
    np.testing.assert_allclose(found, products(motion), rtol=1e-9, atol=1e-6)
    assert sum(block.rows for block in blocks).tolist() == [len(motion.time)] * 3
    assert {block.run for block in blocks} == {"swing_1"}


def test_chunks_join_without_a_seam(monkeypatch):
    motion = measure(ROBOT, swing(ROBOT, 2))
    whole = reduced([motion])[1]
    monkeypatch.setattr(room, "_CHUNK", 17)
    np.testing.assert_allclose(reduced([motion])[1], whole, rtol=1e-9, atol=1e-6)


def test_columns_are_filtered_as_the_measurement_was(monkeypatch):
    monkeypatch.setattr(room, "_BLOCKS", 1)
    motion = replace(measure(ROBOT, swing(ROBOT, 3)), cutoff=4.0)
    expected = products(motion, decimation(100, 4.0), kernel(100, 4.0))
    np.testing.assert_allclose(reduced([motion])[1], expected, rtol=1e-9, atol=1e-6)


def test_blocks_are_long_enough_to_be_independent():
    motion = replace(measure(ROBOT, swing(ROBOT, 4)), cutoff=1.0)
    blocks, _ = reduced([motion])
    assert all(block.stop - block.start > 3.5 for block in blocks)
    assert len(reduced([replace(motion, cutoff=20.0)])[0]) == 40


def test_undecided_samples_are_left_out():
    motion = measure(ROBOT, swing(ROBOT, 6))
    undecided = np.zeros((2000, 3), dtype=bool)
    undecided[:500, 1] = True

    def partly(piece):
        first = round(piece.time[0] * 100)
        rows = equations(piece)
        return replace(rows, undecided=undecided[first : first + len(piece.time)])

    blocks = accumulate([motion], partly, STACK.pattern)
    assert sum(block.rows for block in blocks).tolist() == [2000, 1500, 2000]
    factor = combine([block.factors[1] for block in blocks], STACK.pattern[1])
    np.testing.assert_allclose(factor.T @ factor, products(motion.part(500, 2000))[1], rtol=1e-9, atol=1e-6)
    filtered = accumulate([replace(motion, cutoff=10.0)], partly, STACK.pattern)
    share = sum(block.rows for block in filtered)
    assert 0.7 < share[1] / share[0] < 0.76


def test_a_run_shorter_than_the_filter_gives_nothing():
    motion = replace(measure(ROBOT, swing(ROBOT, 5, seconds=0.5)), cutoff=1.0)
    assert reduced([measure(ROBOT, swing(ROBOT, 5)), motion])[0][-1].run == "swing_5"
    assert accumulate_any([motion], equations, STACK.pattern) == []
    with pytest.raises(InputError, match=r'longer than the filter, 3\.01 s; the longest, "swing_5", has 0\.49 s'):
        accumulate([motion], equations, STACK.pattern)


def test_runs_in_which_nothing_is_decided_are_refused():
    motion = replace(measure(ROBOT, swing(ROBOT, 5)), cutoff=10.0)

    def nowhere(piece):
        return replace(equations(piece), undecided=np.ones((len(piece.time), 3), dtype=bool))

    with pytest.raises(InputError, match=r'in no run does a joint move for as long .* in "swing_5"'):
        accumulate([motion], nowhere, STACK.pattern)


@pytest.mark.parametrize("count", [1, 3])
def test_a_factor_is_small_however_long_the_run(count):
    blocks, _ = reduced([measure(ROBOT, swing(ROBOT, k, seconds=30)) for k in range(count)])
    assert max(factor.shape[0] for block in blocks for factor in block.factors) <= len(STACK.torque_terms) + 1


def test_columns_may_come_in_several_arrays_or_when_asked_for():
    motions = [measure(ROBOT, swing(ROBOT, 1))]
    whole = accumulate(motions, equations, STACK.pattern)

    def apart(motion):
        rows = equations(motion)
        own = [rows.own(equation, used)[0] for equation, used in enumerate(STACK.pattern)]
        return replace(rows, columns=[[own[0][:, :2], own[0][:, 2:]], *((lambda one=one: [one]) for one in own[1:])])

    for one, other in zip(whole, accumulate(motions, apart, STACK.pattern), strict=True):
        for factor, same in zip(one.factors, other.factors, strict=True):
            np.testing.assert_allclose(same.T @ same, factor.T @ factor, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("rows", [5, 40, 3000])
def test_factors_by_products_hold_the_same_products_though_columns_repeat_or_are_empty(monkeypatch, rows):
    monkeypatch.setattr(room, "_BLOCKS", 1)
    rng = np.random.default_rng(rows)
    columns = rng.standard_normal((rows, 1, 12)) * np.logspace(-5, 5, 12)
    columns[..., 3], columns[..., 7] = columns[..., 2] + 2 * columns[..., 4], 0.0
    motion = replace(swing(ROBOT, 0, seconds=rows / 100), cutoff=None)
    measured = rng.standard_normal((rows, 1))

    def given(piece):
        cut = slice(piece.start, piece.start + len(piece.time))
        return Rows(columns[cut], np.zeros_like(measured[cut]), measured[cut])

    pattern = np.ones((1, 12), dtype=bool)
    (plain,), (fast,) = (accumulate([motion], given, pattern, by_products=fast) for fast in (False, True))
    expected, found = (block.factors[0].T @ block.factors[0] for block in (plain, fast))
    assert fast.factors[0].shape[0] <= 13
    assert fast.rows.tolist() == plain.rows.tolist()
    size = np.sqrt(np.diag(expected))
    scaled = (found - expected)[np.ix_(size > 0, size > 0)] / np.outer(size[size > 0], size[size > 0])
    assert np.abs(scaled).max() < 1e-13


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="only Linux copies processes")
@pytest.mark.parametrize("by_products", [False, True])
def test_a_copy_of_the_process_makes_the_same_blocks(monkeypatch, by_products):
    motions = [measure(ROBOT, swing(ROBOT, k, seconds=12)) for k in range(3)]
    alone = accumulate(motions, equations, STACK.pattern, by_products=by_products)
    monkeypatch.setattr(room, "_SHARED", 0)
    monkeypatch.setattr(room, "can_copy", lambda: True)
    halves = accumulate(motions, equations, STACK.pattern, by_products=by_products)
    for one, same in zip(alone, halves, strict=True):
        assert (one.run, one.start, one.stop) == (same.run, same.start, same.stop)
        np.testing.assert_array_equal(one.rows, same.rows)
        for factor, other in zip(one.factors, same.factors, strict=True):
            np.testing.assert_array_equal(factor, other)


def test_of_a_long_log_a_part_is_read_all_over_it(monkeypatch):
    motions = [measure(ROBOT, swing(ROBOT, k, seconds=30)) for k in range(2)]
    assert part_read(motions) == 1
    monkeypatch.setattr(room, "_ENOUGH", 1500)
    assert part_read(motions) == 4
    whole, some = (accumulate(motions, equations, STACK.pattern, every=every) for every in (1, 4))
    rows = [sum(block.rows[0] for block in blocks) for blocks in (whole, some)]
    assert rows[1] == pytest.approx(rows[0] / 4, rel=0.05)
    assert {block.run for block in some} == {motion.run for motion in motions}
    assert len(some) == len(whole)

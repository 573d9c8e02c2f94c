"""Intervals of coefficients: as wide however finely time is cut for random signs."""

from __future__ import annotations

import numpy as np
import pytest

from irtwin.effects.catalogue import catalogue
from irtwin.effects.effect import Term
from irtwin.gap.isolation.estimates import estimate_of
from irtwin.gap.regression.normal_equations import System
from irtwin.identification.accumulate import BLOCKS, Block

RUNS, SAMPLES = 10, 960
EFFECT = catalogue()["torque_offset"]


def offset(blocks_of_a_run: int) -> System:
    """A constant in noise that stays the same for the quarter of a run, in blocks of equal length."""
    generator = np.random.default_rng(0)
    blocks = []
    for run in range(RUNS):
        noise = np.repeat(generator.standard_normal(4), SAMPLES // 4)
        for number, part in enumerate(np.split(5.0 + noise, blocks_of_a_run)):
            rows = np.column_stack([np.ones(len(part)), part])
            blocks.append(Block(f"run_{run}", number, number + 1, np.array([len(part)]), (rows,)))
    observed, group = np.ones(len(blocks), dtype=bool), np.repeat(np.arange(RUNS), blocks_of_a_run)
    terms = ((EFFECT, Term("c", "N m", spread=100.0)),)
    return System(terms, (), np.ones((1, 1), dtype=bool), tuple(blocks), group, observed)


def test_intervals_are_as_wide_with_shorter_blocks():
    few, many = estimate_of(offset(BLOCKS // RUNS), []), estimate_of(offset(4 * BLOCKS // RUNS), [])
    assert many.values == pytest.approx(few.values)
    assert many.covariance == pytest.approx(few.covariance, rel=1e-6)
    assert many.blocks == few.blocks == BLOCKS

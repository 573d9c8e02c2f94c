"""A changed effect is new only where the reference runs lack it."""

from __future__ import annotations

import numpy as np
import pytest

from irtwin.effects.catalogue import catalogue
from irtwin.effects.effect import Term
from irtwin.gap.isolation.cause import Cause
from irtwin.gap.isolation.changes import shown_before
from irtwin.gap.regression.hypotheses import CHANGED, MISSING, Column, Variant
from irtwin.gap.regression.normal_equations import System
from irtwin.gap.thresholds import DEFAULT
from irtwin.identification.accumulate import Block, triangle

ROWS, RUNS = 300, 8  # half of them reference runs
CABLE = catalogue()["cable_drag"]
NOISE = np.ones(1)


def said(before, now, scope=CHANGED, inside=()):
    """What is said of a cable's drag of so many noises in the reference runs, and in the observed ones."""
    generator = np.random.default_rng(0)
    blocks = []
    for run in range(RUNS):
        column = generator.standard_normal((ROWS, 1))
        size = before if run < RUNS // 2 else now
        measured = size * column[:, 0] + generator.standard_normal(ROWS)
        factor = triangle(np.column_stack([np.ones((ROWS, 1)), column, measured]))
        blocks.append(Block(f"run_{run}", 0.0, 1.0, np.array([ROWS]), (factor,)))
    column = Column(CABLE, 0, Term("k", "1"))
    observed = np.arange(RUNS) >= RUNS // 2
    twin = ((CABLE, Term("constant", "1")),)
    system = System(twin, (column,), np.ones((1, 2), dtype=bool), tuple(blocks), np.arange(RUNS), observed)
    place = system.changed if scope == CHANGED else system.base
    cause = Cause("cable_drag", scope, ("j1",), (Variant(CABLE, (place,), (column.term,)),), 1.0, 9.0, 0.0)
    return shown_before(system, [cause], NOISE, frozenset(inside), DEFAULT.changes)


def test_what_the_reference_runs_show_as_well_has_not_changed() -> None:
    assert said(before=3.0, now=3.0) == {"cable_drag"}


@pytest.mark.parametrize("before", [0.0, 0.9, -3.0])
def test_what_they_lack_or_show_less_has(before: float) -> None:
    assert said(before, now=3.0) == frozenset()


def test_what_the_twin_has_changes_in_size() -> None:
    assert said(before=3.0, now=3.0, inside=("cable_drag",)) == frozenset()


def test_what_is_missing_is_missing_in_all_runs() -> None:
    assert said(before=3.0, now=3.0, scope=MISSING) == frozenset()

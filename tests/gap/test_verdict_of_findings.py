"""The verdict, by what is left of the gap and where."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from irtwin.gap.data.noise_floor import OUT_OF_BAND, REPEATS, Floor
from irtwin.gap.isolation.verdict import AMBIGUOUS, ATTRIBUTED, NO_GAP, UNEXPLAINED, verdict_of
from irtwin.gap.thresholds import DEFAULT

CAUSE = SimpleNamespace(rivals=())


def verdict(before, after, causes=(), source=REPEATS):
    """before, after: RMS of each joint, in floors."""
    system = SimpleNamespace(both=False)
    floor = np.ones(len(before))
    finding = SimpleNamespace(causes=causes, floor=floor, system=system, fitted=(np.array(before), np.array(after)))
    return verdict_of([finding], Floor(floor, None, source), DEFAULT.verdict)


def test_a_gap_that_is_closed_is_attributed():
    assert verdict([5.0, 1.0], [1.2, 1.0], [CAUSE]) == ATTRIBUTED
    assert verdict([5.0, 1.0], [1.2, 1.0], [SimpleNamespace(rivals=("viscous_friction",))]) == AMBIGUOUS


def test_a_gap_that_nothing_closes_is_unexplained():
    assert verdict([5.0, 1.0], [5.0, 1.0]) == UNEXPLAINED
    assert verdict([5.0, 1.0], [4.0, 1.0], [CAUSE]) == UNEXPLAINED


def test_a_gap_that_is_closed_at_the_worst_joint_alone_is_unexplained():
    assert verdict([5.0, 4.0], [1.2, 4.0], [CAUSE]) == UNEXPLAINED


@pytest.mark.parametrize("left", [[2.0, 1.0], [1.0, 2.0]])
def test_a_small_rest_is_what_differs_between_runs(left):
    assert verdict([2.0, 2.0], left) == NO_GAP


def test_without_repeats_nothing_is_called_unexplained():
    assert verdict([5.0, 1.0], [5.0, 1.0], source=OUT_OF_BAND) == NO_GAP

"""The verdict, by what is left of the gap and where."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from irtwin.effects.catalogue import catalogue
from irtwin.gap.data.noise_floor import OUT_OF_BAND, REPEATS, Floor
from irtwin.gap.isolation.closing import Closing
from irtwin.gap.isolation.verdict import AMBIGUOUS, ATTRIBUTED, NO_GAP, UNEXPLAINED, verdict_of
from irtwin.gap.thresholds import DEFAULT

MUCH = Closing(share=0.9, interval=(0.8, 0.95), floors=3.0, size=9.0)


def cause(rivals=()):
    variant = SimpleNamespace(effect=catalogue()["coulomb_friction"])
    return SimpleNamespace(rivals=rivals, scope="missing", joints=("j1",), variants=(variant,))


CAUSE = cause()


def verdict(before, after, causes=(), source=REPEATS, closing=MUCH):
    """before, after: RMS of each joint, in floors; `closing`: what the causes close."""
    system = SimpleNamespace(both=False)
    floor = np.ones(len(before))
    finding = SimpleNamespace(
        causes=causes,
        floor=floor,
        system=system,
        fitted=(np.array(before), np.array(after)),
        closing=lambda some: closing,
    )
    return verdict_of([finding], Floor(floor, None, source), DEFAULT)


def test_a_gap_that_is_closed_is_attributed():
    assert verdict([5.0, 1.0], [1.2, 1.0], [CAUSE]) == ATTRIBUTED
    assert verdict([5.0, 1.0], [1.2, 1.0], [cause(rivals=("viscous_friction",))]) == AMBIGUOUS


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


@pytest.mark.parametrize(
    "closing",
    [
        Closing(share=6.6e-9, interval=(1e-9, 2e-8), floors=9.0, size=81.0),
        Closing(share=0.018, interval=(-0.012, 0.049), floors=9.0, size=81.0),
        Closing(share=0.5, interval=(0.4, 0.6), floors=0.2, size=0.04),
    ],
)
def test_causes_that_close_nothing_make_no_gap(closing):
    assert verdict([1.2, 1.0], [1.1, 1.0], [CAUSE], closing=closing) == NO_GAP
    assert verdict([5.0, 1.0], [4.9, 1.0], [CAUSE], closing=closing) == UNEXPLAINED

"""The verdict, by what is left of the gap and where, and by how sure its causes are."""

from __future__ import annotations

from itertools import count
from types import SimpleNamespace

import numpy as np
import pytest

from irtwin.document import document
from irtwin.effects.catalogue import catalogue
from irtwin.gap.data.case import Case
from irtwin.gap.isolation import verdict
from irtwin.gap.isolation.closing import Closing
from irtwin.gap.isolation.verdict import (
    AMBIGUOUS,
    ATTRIBUTED,
    DOES_NOT_REPEAT,
    IMPOSSIBLE_NUMBER,
    MUCH_IS_LEFT,
    NO_GAP,
    UNEXPLAINED,
    left_open,
    verdict_of,
)
from irtwin.gap.thresholds import DEFAULT

COUNT = count()
MUCH = Closing(share=0.9, interval=(0.8, 0.95), floors=3.0, size=9.0)


VARIANT = SimpleNamespace(effect=catalogue()["coulomb_friction"])
CAUSE = SimpleNamespace(rivals=(), scope="missing", joints=("j1",), variants=(VARIANT,))


def disturbance(size, kind="line"):
    return SimpleNamespace(channel="torque", joint="j1", kind=kind, size=size)


def left(before, after, causes=(), closing=MUCH, turned=(-np.inf,), known=1.0, made=0.0, others=1.0, **more):
    """before, after: RMS of each joint, in floors; `closing`: what the causes close; `turned`, `known` as of `Apart`.

    `made`: what friction makes that differs from run to run, floors squared; `others`: RMS that the other runs leave,
    in floors; `more` as left_open.
    """
    floor = np.ones(len(before))
    finding = SimpleNamespace(
        name="torque",
        places=("j1", "j2")[: len(before)],
        causes=causes,
        floor_within=floor,
        apart=SimpleNamespace(
            plain=SimpleNamespace(halves=(slice(None),)),
            left=(np.array(before), np.array(after)),
            level=lambda floor: np.maximum(floor, others),
            turned=lambda floor: np.array(turned),
            known=np.array(known),
        ),
        steadied=SimpleNamespace(made=np.full(len(before), made)),
        closing=lambda some: closing,
    )
    return left_open([finding], DEFAULT, **more)[0]


def finding(*classes, matters=True, least=0.1, effect="stribeck_friction"):
    """A finding with a class of confidences for each cause: its own first, then of what cannot be told from it.

    It closes at least the share `least` for sure.
    """
    name = f"c{next(COUNT)}"
    members = [
        document.Member(cause=f"{name}.{k}", effect=effect, family="friction", confidence=sure)
        for k, some in enumerate(classes)
        for sure in some
    ]
    return SimpleNamespace(matters=matters, members=members, share_interval95=(least, 0.9))


@pytest.mark.parametrize(
    ("findings", "verdict"),
    [
        ([], NO_GAP),
        ([finding([0.9], matters=False)], NO_GAP),
        ([finding([0.9])], ATTRIBUTED),
        ([finding([0.9]), finding([0.2])], ATTRIBUTED),
        ([finding([0.6, 0.2])], AMBIGUOUS),
        ([finding([0.3, 0.25])], AMBIGUOUS),  # one of both is likely
        ([finding([0.9]), finding([0.2, 0.1])], ATTRIBUTED),  # guesses do not speak
        ([finding([0.4]), finding([0.3])], UNEXPLAINED),  # each is more likely wrong than right
        ([finding([0.4], [0.4])], UNEXPLAINED),
        ([finding([0.2, 0.1])], UNEXPLAINED),
        ([finding([0.3]), finding([0.9], matters=False)], UNEXPLAINED),
        ([finding([0.9], least=-0.1)], UNEXPLAINED),  # it is there; that it closes anything is not sure
        ([finding([0.9], least=-0.1), finding([0.9])], ATTRIBUTED),
        ([finding([0.6, 0.3], least=-0.1), finding([0.9])], ATTRIBUTED),
        ([finding([0.9], least=-0.1, effect="periodic_disturbance")], ATTRIBUTED),  # runs differ: a gap by itself
    ],
)
def test_causes_that_are_likely_make_the_verdict(findings, verdict):
    assert verdict_of(findings) == verdict


@pytest.mark.parametrize(
    ("before", "after", "more", "why"),
    [
        ([5.0, 1.0], [1.2, 1.0], {"causes": [CAUSE]}, None),
        ([5.0, 1.0], [1.2, 1.0], {"causes": [CAUSE], "unmatched": True}, IMPOSSIBLE_NUMBER),
        ([5.0, 1.0], [5.0, 1.0], {}, MUCH_IS_LEFT),
        ([5.0, 1.0], [4.0, 1.0], {"causes": [CAUSE]}, MUCH_IS_LEFT),
        ([5.0, 4.0], [1.2, 4.0], {"causes": [CAUSE]}, MUCH_IS_LEFT),  # it is closed at the worst joint alone
        ([5.0, 1.0], [5.0, 1.0], {"known": [0.2, 1.0]}, MUCH_IS_LEFT),
        ([5.0, 1.0], [5.0, 1.0], {"known": [0.1, 1.0]}, None),  # a mean over all rows; where friction turns is no gap
        ([2.0, 2.0], [2.0, 1.0], {}, None),  # a small rest is what differs between runs
        ([2.0, 2.0], [1.0, 2.0], {}, None),
    ],
)
def test_a_gap_is_left_open_unless_possible_numbers_close_it_at_each_joint(before, after, more, why):
    assert left(before, after, **more) == why


LITTLE = Closing(share=0.2, interval=(-0.1, 0.5), floors=0.6, size=0.4)


@pytest.mark.parametrize(
    ("said", "why"),
    [
        ({"spread": 0.8}, MUCH_IS_LEFT),  # 1.25 floors squared are left
        ({"spread": 1.3}, None),  # as much as reference runs leave over one another
        ({"spread": None}, None),  # too few of them to say
        ({"spread": 0.8, "alike": False}, None),
        ({"spread": 0.8, "causes": [CAUSE]}, None),  # something that matters is named
        ({"spread": 0.8, "causes": [CAUSE], "closing": LITTLE}, MUCH_IS_LEFT),
    ],
)
def test_without_a_cause_more_than_reference_runs_leave_over_one_another_is_left_open(monkeypatch, said, why):
    more = dict(said)
    found = more.pop("spread")
    monkeypatch.setattr(verdict, "spread", lambda system, floor, rows: found)
    assert left([1.5, 1.0], [1.5, 1.0], **{"alike": True, **more}) == why


def test_a_tenth_of_a_floor_squared_is_no_gap_however_alike_reference_runs_are(monkeypatch):
    monkeypatch.setattr(verdict, "spread", lambda system, floor, rows: 0.04)
    assert left([1.05, 1.0], [1.05, 1.0], alike=True) is None
    assert left([1.15, 1.0], [1.15, 1.0], alike=True) == MUCH_IS_LEFT


@pytest.mark.parametrize(
    ("said", "why"),
    [
        ({}, MUCH_IS_LEFT),
        ({"between": True}, None),  # a simulator leaves it, too
        ({"causes": [CAUSE]}, None),  # what changed is named, beside what the twin lacks in all runs
    ],
)
def test_what_the_twin_lacks_in_reference_runs_too_is_a_gap_where_nothing_is_named(said, why):
    assert left([3.0, 1.0], [3.0, 1.0], others=3.0, **said) == why


@pytest.mark.parametrize(
    ("said", "why"),
    [
        ({}, MUCH_IS_LEFT),
        ({"alike": False}, None),
        ({"causes": [CAUSE]}, None),  # something that matters is named
        ({"turned": [-0.5, 2.0]}, None),  # rows about reversals are few
    ],
)
def test_friction_that_turns_otherwise_than_in_the_reference_runs_is_left_open(monkeypatch, said, why):
    monkeypatch.setattr(verdict, "spread", lambda system, floor, rows: 1.0)
    assert left([1.0, 1.0], [1.0, 1.0], **{"turned": [-0.5, 4.0], "alike": True, **said}) == why


def test_what_does_not_repeat_is_left_open_where_nothing_else_is_found():
    first, second = disturbance(1.0), disturbance(1.0)
    assert left([1.0], [1.0], differing=[first, second]) == DOES_NOT_REPEAT
    assert left([1.0], [1.0], differing=[first, second], explained=[second]) == DOES_NOT_REPEAT
    assert left([1.0], [1.0], differing=[first, second], explained=[first]) is None
    assert left([5.0], [1.2], [CAUSE], differing=[first]) is None


def test_what_was_taken_out_counts_in_the_gap_that_there_was():
    swings = disturbance(100.0)
    assert left([1.0, 3.0], [1.0, 3.0]) == MUCH_IS_LEFT
    assert left([1.0, 3.0], [1.0, 3.0], differing=[swings], explained=[swings]) is None
    assert left([1.0, 7.0], [1.0, 7.0], differing=[swings], explained=[swings]) == MUCH_IS_LEFT


def test_what_is_left_is_what_does_not_repeat_where_that_is_nearly_all():
    drifts = disturbance(20.0)
    assert left([5.0, 1.0], [5.0, 1.0], differing=[drifts]) == DOES_NOT_REPEAT
    assert left([5.0, 5.0], [5.0, 5.0], differing=[drifts]) == MUCH_IS_LEFT
    assert left([5.0, 1.0], [4.0, 1.0], [CAUSE], differing=[drifts]) == MUCH_IS_LEFT


def test_causes_that_close_nothing_do_not_close_a_gap():
    nothing = Closing(share=0.5, interval=(0.4, 0.6), floors=0.2, size=0.04)
    assert left([1.0], [1.0], [CAUSE], closing=nothing, differing=[disturbance(1.0)]) == DOES_NOT_REPEAT


@pytest.mark.parametrize(
    ("kind", "made", "why"),
    [("offset", 2.0, None), ("drift", 2.0, None), ("offset", 0.5, DOES_NOT_REPEAT), ("line", 2.0, DOES_NOT_REPEAT)],
)
def test_an_offset_between_repeats_is_none_where_friction_differs_by_as_much(kind, made, why):
    assert left([1.0], [1.0], differing=[disturbance(1.0, kind)], made=made) == why


@pytest.mark.parametrize(
    ("role", "step", "alike"),
    [("reference", 0.004, True), ("reference", 0.0042, True), ("reference", 0.008, False), ("simulated", 0.004, False)],
)
def test_reference_runs_are_alike_where_they_were_logged_at_the_rate_of_the_observed_ones(role, step, alike):
    def run(role, step):
        return SimpleNamespace(role=role, signals=SimpleNamespace(time=np.arange(0, 8, step)))

    case = Case(None, (), (run("observed", 0.004), run(role, step)), {}, (None, {}), DEFAULT)
    assert case.alike is alike

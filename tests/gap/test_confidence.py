"""The chance that a cause is right: more evidence, more of it; always between 0 and 1."""

from __future__ import annotations

from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from irtwin.gap.isolation.confidence import as_large_as, confidence, of_family, of_rivals, where_runs_are_few
from irtwin.gap.thresholds import DEFAULT

PLENTY = {"t": 8.0, "gain": 0.5, "closed": 0.9, "share": 1.0, "count": 1, "weights": DEFAULT.confidence}


@given(
    t=st.floats(-1e6, 1e6),
    gain=st.floats(0, 1e9),
    closed=st.floats(0, 1),
    share=st.floats(1e-9, 1),
    count=st.integers(1, 100),
    unexplained=st.booleans(),
)
def test_it_is_a_chance(t, gain, closed, share, count, unexplained) -> None:
    assert 0 <= confidence(t, gain, closed, share, count, DEFAULT.confidence, unexplained=unexplained) <= 1


def test_weaker_evidence_lowers_it() -> None:
    sure = confidence(**PLENTY, unexplained=False)
    assert sure > 0.9
    for name, weaker in {"t": 1.0, "gain": 0.01, "closed": 0.1, "share": 0.1, "count": 4}.items():
        assert confidence(**(PLENTY | {name: weaker}), unexplained=False) < sure, name
    assert confidence(**PLENTY, unexplained=True) < sure


RIVALS = st.dictionaries(st.sampled_from(["a", "b", "c", "d"]), st.floats(-1, 10))


@given(own=st.floats(0, 1), gains=RIVALS, more=st.lists(st.floats(0, 1), min_size=1, max_size=4))
def test_no_rival_is_likelier_than_its_cause_and_no_cause_than_its_family(own, gains, more) -> None:
    rivals = of_rivals(own, list(gains), gains, DEFAULT.confidence)
    assert rivals.keys() == gains.keys()
    assert all(0 <= one <= own for one in rivals.values())
    assert own + sum(rivals.values()) <= 1 + 1e-9
    assert max(more) - 1e-9 <= of_family(more, DEFAULT.confidence) <= 1


def test_rivals_share_by_their_gains() -> None:
    rivals = of_rivals(0.6, ["load", "position"], {"load": 3.0, "position": 1.0}, DEFAULT.confidence)
    assert rivals == pytest.approx({"load": 0.15, "position": 0.05})


def test_what_calibration_adds_raises_a_family() -> None:
    assert of_family([0.5], replace(DEFAULT.confidence, family_more=1.0)) == pytest.approx(0.731, abs=1e-3)


@given(own=st.floats(0, 1), p=st.floats(0, 1), repeats=st.floats(0, 1), halves=st.tuples(st.booleans(), st.booleans()))
def test_chance_and_halves_that_differ_only_lower_it(own, p, repeats, halves) -> None:
    weights = DEFAULT.confidence
    by_chance, by_size = (where_runs_are_few(own, p, each, None, weights) for each in (None, repeats))
    assert 0 <= where_runs_are_few(own, p, repeats, halves, weights) <= by_size <= by_chance <= own
    assert where_runs_are_few(own, None, None, None, weights) == own


def test_a_p_value_leaves_what_it_can_tell_at_most() -> None:
    told = [where_runs_are_few(1.0, p, None, None, DEFAULT.confidence) for p in (0.0, 0.001, 0.01, 0.05, 0.1, 0.5)]
    assert told == pytest.approx([1.0, 0.982, 0.889, 0.711, 0.615, 0.5], abs=1e-3)


def test_what_does_not_repeat_is_no_certain_error() -> None:
    assert where_runs_are_few(0.9, None, 0.0, None, DEFAULT.confidence) == pytest.approx(0.09)


@pytest.mark.parametrize("halves, left", [((True, True), 0.9), ((True, False), 0.45), ((False, False), 0.45)])
def test_what_one_half_does_not_show_is_not_sure(halves, left) -> None:
    assert where_runs_are_few(0.9, None, None, halves, DEFAULT.confidence) == pytest.approx(left)


def test_crumbs_do_not_unsay_the_cause_that_explains_nearly_everything() -> None:
    gains = [1.0, *[0.005] * 5]
    assert as_large_as(1.0, gains) == pytest.approx(1.025)
    assert as_large_as(0.005, gains) == pytest.approx(6.0)


@given(gains=st.lists(st.floats(1e-6, 1e3), min_size=1, max_size=8))
def test_a_cause_stands_beside_as_many_as_gain_as_much(gains) -> None:
    counts = [as_large_as(gain, gains) for gain in gains]
    assert all(1 <= count <= len(gains) + 1e-9 for count in counts)
    assert counts[gains.index(min(gains))] == pytest.approx(len(gains))

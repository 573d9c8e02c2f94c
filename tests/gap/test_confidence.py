"""The chance that a cause is right: more evidence, more of it; always between 0 and 1."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from irtwin.gap.isolation.confidence import confidence
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

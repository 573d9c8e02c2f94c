"""Which form an Accept header gets."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from irtwin.serve.negotiation import SOLUTIONS, TRIPLES, best

JSON, XML, CSV = "application/sparql-results+json", "application/sparql-results+xml", "text/csv"


@pytest.mark.parametrize(
    ("accept", "expected"),
    [
        ("", JSON),
        ("*/*", JSON),
        (XML, XML),
        ("text/*", CSV),
        ("TEXT/CSV", CSV),
        (f"{CSV};q=0.2, {XML};q=0.7, */*;q=0.1", XML),
        (f"{JSON};q=0, */*", XML),
        (f"{XML} ; q=0.5 , {JSON} ; q=0.6", JSON),
        ("application/json", "application/json"),
        ("text/html, application/xhtml+xml, */*;q=0.8", JSON),
        ("image/png", None),
        ("*/*;q=0", None),
        ("text/csv;q=high", None),
        ("text/csv;q=2", None),
        ("text/csv;q=nan", None),
        (";;,,/;q=1,text/,/csv", None),
        (f"rubbish, {CSV}", CSV),
    ],
)
def test_of_solutions(accept: str, expected: str | None) -> None:
    assert best(accept, SOLUTIONS) == expected


QUALITY = st.integers(0, 1000).map(lambda thousandths: thousandths / 1000)


@pytest.mark.slow
@given(st.dictionaries(st.sampled_from(list(TRIPLES)), QUALITY, min_size=1), st.randoms())
def test_exact_types_get_the_highest_quality_in_any_order(wanted, random) -> None:
    parts = [f"{media_type};q={quality}" for media_type, quality in wanted.items()]
    random.shuffle(parts)
    chosen = best(", ".join(parts), TRIPLES)
    if max(wanted.values()) == 0:
        assert chosen is None
    else:
        assert wanted[chosen] == max(wanted.values())


@given(st.text(max_size=200))
def test_any_header_is_read(accept: str) -> None:
    assert best(accept, SOLUTIONS) in (None, *SOLUTIONS)


@given(st.sampled_from(list(SOLUTIONS)), QUALITY.filter(bool))
def test_a_closer_range_says_more_than_a_wide_one(media_type: str, quality: float) -> None:
    assert best(f"*/*;q=0, {media_type};q={quality}", SOLUTIONS) == media_type

"""Times as HermiT reads them."""

from __future__ import annotations

import pytest
from pyoxigraph import Literal, NamedNode, Triple

from irtwin.knowledge.literals import to_milliseconds
from irtwin.knowledge.vocabulary import XSD

A, P = NamedNode("https://example.org/a"), NamedNode("https://example.org/p")


@pytest.mark.parametrize(
    ("given", "cut"),
    [
        ("2026-03-01T12:00:00.123456Z", "2026-03-01T12:00:00.123Z"),
        ("2026-03-01T12:00:00.12+01:00", "2026-03-01T12:00:00.12+01:00"),
        ("2026-03-01T12:00:00", "2026-03-01T12:00:00"),
    ],
)
def test_a_time_is_cut_to_milliseconds(given: str, cut: str) -> None:
    time = NamedNode(XSD + "dateTime")
    triple = Triple(A, P, Literal(given, datatype=time))
    assert to_milliseconds(triple) == Triple(A, P, Literal(cut, datatype=time))


@pytest.mark.parametrize("value", [A, Literal("12.123456"), Literal(0.123456)])
def test_anything_else_stays(value) -> None:
    assert to_milliseconds(Triple(A, P, value)) == Triple(A, P, value)

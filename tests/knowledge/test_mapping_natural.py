from __future__ import annotations

import re
from datetime import UTC, date, datetime, time, timedelta, timezone
from decimal import Decimal
from uuid import UUID

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pyoxigraph import NamedNode

from irtwin.knowledge.mapping.natural import (
    BOOLEAN,
    DATE,
    DATE_TIME,
    DECIMAL,
    DOUBLE,
    HEX_BINARY,
    INTEGER,
    STRING,
    TIME,
    by_declared_type,
    by_value,
    is_lexical,
)


@given(st.floats(allow_nan=False, allow_infinity=False))
def test_a_double_is_canonical_and_loses_nothing(value: float) -> None:
    lexical, datatype = by_value(value)
    assert datatype == DOUBLE
    assert re.fullmatch(r"-?([1-9]\.\d+|0\.0)E(0|-?[1-9]\d*)", lexical)
    assert re.fullmatch(r"[^.]*\.(\d|\d*[1-9])E.*", lexical)  # no zeros at the end but a single one
    assert float(lexical) == value


@given(st.decimals(allow_nan=False, allow_infinity=False, places=6))
def test_a_decimal_loses_nothing(value: Decimal) -> None:
    lexical, datatype = by_value(value)
    assert datatype == DECIMAL
    assert is_lexical(lexical, DECIMAL)
    assert Decimal(lexical) == value


@pytest.mark.parametrize(
    ("value", "lexical", "datatype"),
    [
        (True, "true", BOOLEAN),
        (-7, "-7", INTEGER),
        (float("nan"), "NaN", DOUBLE),
        (float("-inf"), "-INF", DOUBLE),
        (Decimal("1E+3"), "1000", DECIMAL),
        (date(2026, 1, 2), "2026-01-02", DATE),
        (time(3, 4, 5, 100_000), "03:04:05.1", TIME),
        (datetime(2026, 1, 2, 3, 4, 50), "2026-01-02T03:04:50", DATE_TIME),
        (datetime(2026, 1, 2, 3, 4, 5, 120, UTC), "2026-01-02T03:04:05.00012Z", DATE_TIME),
        (datetime(2026, 1, 2, tzinfo=timezone(timedelta(hours=2))), "2026-01-02T00:00:00+02:00", DATE_TIME),
        (b"\x01\xff", "01FF", HEX_BINARY),
        ({"a": [1]}, '{"a": [1]}', STRING),
        (UUID(int=1), "00000000-0000-0000-0000-000000000001", STRING),
    ],
)
def test_drivers_values(value: object, lexical: str, datatype: NamedNode) -> None:
    assert by_value(value) == (lexical, datatype)


@pytest.mark.parametrize(
    ("datatype", "right", "wrong"),
    [
        (INTEGER, ["1", "-01", "+7"], ["1.0", "", "one"]),
        (DOUBLE, ["1", "1.5e3", "-INF", "NaN", ".5"], ["1,5", "e3", "inf"]),
        (DECIMAL, ["1.50", "-3"], ["1e3", "."]),
        (BOOLEAN, ["true", "0"], ["TRUE", "yes"]),
        (DATE, ["2026-01-02", "2026-01-02Z"], ["02.01.2026"]),
        (DATE_TIME, ["2026-01-02T03:04:05.6+01:00"], ["2026-01-02 03:04:05", "2026-01-02"]),
        (HEX_BINARY, ["", "0aFF"], ["0", "xx"]),
        (NamedNode("http://example.com/own"), ["anything"], []),
    ],
)
def test_lexical_spaces(datatype: NamedNode, right: list[str], wrong: list[str]) -> None:
    assert all(is_lexical(text, datatype) for text in right)
    assert not any(is_lexical(text, datatype) for text in wrong)


def test_declared_types_in_other_spellings() -> None:
    assert by_declared_type("  double PRECISION ")(1.0) == ("1.0E0", DOUBLE)
    assert by_declared_type("character(4)")("ab") == ("ab  ", STRING)
    assert by_declared_type("character varying(4)")("ab") == ("ab", STRING)
    assert by_declared_type("no;type(")(3) == ("3", INTEGER)

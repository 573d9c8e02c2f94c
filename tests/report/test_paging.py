"""Long tables in pages."""

from __future__ import annotations

import pytest

from irtwin.report.plant.page import PAGE, on_page, page_number, pages


def test_each_line_is_on_one_page() -> None:
    lines = list(range(2 * PAGE + 1))
    assert pages(lines) == 3
    assert [line for number in (1, 2, 3) for line in on_page(lines, number)] == lines
    assert list(on_page(lines, 99)) == [2 * PAGE]
    assert pages([]) == 1
    assert not on_page([], 4)


@pytest.mark.parametrize(
    ("said", "page"), [(None, 1), ("", 1), ("7", 7), ("0", 1), ("-3", 1), ("x", 1), ("²", 1), ("9" * 40, 1)]
)
def test_an_address_says_its_page_or_nonsense(said: str | None, page: int) -> None:
    assert page_number(said) == page

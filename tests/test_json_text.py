"""JSON that nobody sound wrote is a ValueError, however it is wrong."""

from __future__ import annotations

import pytest

from irtwin.json_text import parse_json


def test_what_is_json_is_returned() -> None:
    assert parse_json(b'{"a": [1, null]}') == {"a": [1, None]}


@pytest.mark.parametrize("text", ["", "{", "[" * 100_000, b"\xff", '{"a":' * 100_000])
def test_what_is_none_is_a_value_error(text: str | bytes) -> None:
    with pytest.raises(ValueError):
        parse_json(text)

"""TOML of users, whichever file it is, is held to one set of bounds."""

from __future__ import annotations

from pathlib import Path

import pytest

from irtwin.errors import InputError
from irtwin.storage.base_iri import said
from irtwin.storage.tariff import read_tariff
from irtwin.toml_file import read_toml


def test_what_is_toml_is_returned(tmp_path: Path) -> None:
    file = tmp_path / "x.toml"
    file.write_bytes(b"\xef\xbb\xbfa = 1\r\n[b]\r\nc = [true]\r\n")
    assert read_toml(file) == {"a": 1, "b": {"c": [True]}}


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("a = ", "not valid TOML: Invalid value"),
        ("a = " + "9" * 5000, "not valid TOML: Exceeds the limit"),
        ("a = " + "[" * 5000, "not valid TOML: nested too deeply"),
        (".".join("a" * 40) + " = 1", "not valid TOML: nested too deeply"),
        ("a = " + "[" * 40 + "]" * 40, "not valid TOML: nested too deeply"),
        ('a = "\\u0000"', "a contains a null character"),
        ("".join(f"a{n} = 1\n" for n in range(1001)), "the file has 1001 keys"),
    ],
)
def test_what_is_none_or_beyond_bounds_is_said_with_the_file(text: str, message: str, tmp_path: Path) -> None:
    file = tmp_path / "plant.toml"
    file.write_text(text)
    for read in (read_toml, said, lambda file: read_tariff(file.parent)):
        with pytest.raises(InputError, match=rf"plant\.toml: {message}"):
            read(file)

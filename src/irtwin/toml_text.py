"""TOML files of users, read as hostile input."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path
from typing import Any

from irtwin.errors import InputError
from irtwin.input_file import read_text

_LARGEST = 2_000_000  # bytes, of thousands of runs; a million takes the parser up to 2 s
_GREATEST = 1e300  # of a number
_DEEPEST = 32  # tables in tables
_MOST_KEYS = 1000  # of a table: each that nobody knows is held against those that are known
_KEY = r"""(?:[\w-]+|"[^"\n]*"|'[^'\n]*')"""
_DOTTED = re.compile(rf"(?:^|[\[{{,])[ \t]*{_KEY}(?:[ \t]*\.[ \t]*{_KEY}){{{_DEEPEST},}}[ \t]*[=\]]", re.MULTILINE)


def read_toml(file: Path) -> dict[str, Any]:
    """Read a TOML file. Raises InputError, naming the file, where it cannot be read, is no TOML or beyond bounds."""
    text = read_text(file, _LARGEST)
    try:
        if _DOTTED.search(text):  # the parser's memory grows with the square of a key's parts
            raise InputError(f"{file}: not valid TOML: nested too deeply")
        document = tomllib.loads(text)
    except ValueError as error:  # an integer of thousands of digits is no TOMLDecodeError
        raise InputError(f"{file}: not valid TOML: {error}") from error
    except RecursionError as error:
        raise InputError(f"{file}: not valid TOML: nested too deeply") from error
    _check_values(document, file, "", 0)
    return document


def _check_values(value: Any, file: Path, name: str, depth: int) -> None:
    """Raise on numbers beyond a float, null characters, which neither paths nor databases take, and deep nesting."""
    if depth > _DEEPEST:
        raise InputError(f"{file}: not valid TOML: nested too deeply")
    if isinstance(value, int) and not -_GREATEST <= value <= _GREATEST:
        raise InputError(f"{file}: {name} is a number beyond {_GREATEST:g}")
    if isinstance(value, str) and "\0" in value:
        raise InputError(f"{file}: {name} contains a null character")
    if isinstance(value, dict) and len(value) > _MOST_KEYS:
        raise InputError(
            f"{file}: {name[:100] or 'the file'} has {len(value)} keys; keep at most {_MOST_KEYS} in a table"
        )
    if isinstance(value, dict):
        for key, inner in value.items():
            _check_values(key, file, f"a key of {name}", depth)
            _check_values(inner, file, f"{name}.{key}".removeprefix("."), depth + 1)
    if isinstance(value, list):
        for inner in value:
            _check_values(inner, file, name, depth + 1)

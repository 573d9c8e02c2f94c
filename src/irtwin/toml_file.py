"""TOML files of users, read as hostile input, and their tables: every fault names the file, the table and the key."""

from __future__ import annotations

import difflib
import math
import re
import tomllib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from irtwin.errors import InputError
from irtwin.input_file import read_text, real_path

BAG_FOLDER = "metadata.yaml"  # what a folder that is a ROS 2 bag holds
_NEAR, _VERY_NEAR = 0.7, 0.8  # share of letters in common of a key and its misspelling (`difflib`)
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


@dataclass(frozen=True)
class TomlTable:
    """A TOML table whose faults name it; `name` is empty of a whole file."""

    file: Path
    name: str
    values: dict[str, Any]

    def text(self, key: str, default: str | None = None) -> str | None:
        """Return the text of a key. Raises InputError where it is no text, or blank."""
        value = self.values.get(key, default)
        if value is not None and not (isinstance(value, str) and value.strip()):
            raise self.fault(key, f"should be text, not {shown(value)}")
        return value

    def choice(self, key: str, known: Sequence[str], default: str | None = None) -> Any:
        """Return the text of a key. Raises InputError as `text`, and where it is none of those that are known."""
        text = self.text(key, default)
        if text is not None and text not in known:
            raise self.fault(key, f'= "{text}"; use {(" or " if len(known) == 2 else ", ").join(known)}')
        return text

    def needed(self, key: str) -> str:
        """Return the text of a key that has to be there. Raises InputError as `text`, and where it is absent."""
        text = self.text(key)
        if text is None:
            raise self.fault(key, "is missing")
        return text

    def number(self, key: str, *, least: float = -math.inf) -> float | None:
        """Return the number of a key, None where it is absent. Raises InputError where it is none, or below `least`."""
        value = self.values.get(key)
        if value is None:
            return None
        if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value) or value < least:
            bound = "" if least == -math.inf else f" of at least {least:g}"
            raise self.fault(key, f"should be a number{bound}, not {shown(value)}")
        return float(value)

    def numbers(self, key: str, count: int, expected: str) -> Any:
        """Return a tuple of so many numbers, None where none are. Raises InputError, saying what is `expected`."""
        value = self.values.get(key)
        if value is None:
            return None
        if not (isinstance(value, list) and len(value) == count):
            raise self.fault(key, f"should be {expected}, not {shown(value)}")
        parts = (TomlTable(self.file, f"{self.name} {key}", {"part": part}).number("part") for part in value)
        return tuple(0.0 if part is None else part for part in parts)

    def check_keys(self, known: Sequence[str]) -> None:
        """Raise InputError on a key that is none of these, naming the nearest."""
        for key in self.values:
            if key not in known:
                raise self._misspelt(key, difflib.get_close_matches(key, known, 1, _NEAR) or known)

    def check_notes(self, known: Sequence[str]) -> None:
        """Raise InputError on a key that is nearly one of these; any other is a note."""
        for key, near in self.near_misses(known, _NEAR):
            raise self._misspelt(key, [near])

    def near_misses(self, known: Sequence[str], share: float = _VERY_NEAR) -> list[tuple[str, str]]:
        """Return the keys that are nearly one of these, and not said otherwise, each with that one."""
        others = [key for key in known if key not in self.values]
        matches = ((key, difflib.get_close_matches(key, others, 1, share)) for key in self.values if key not in known)
        return [(key, near[0]) for key, near in matches if near]

    def fault(self, key: str, problem: str) -> InputError:
        """Return the error that says what is wrong with a key."""
        return InputError(f"{self.file}: {f'{self.name} {key}'.lstrip()} {problem}")

    def _misspelt(self, key: str, known: Sequence[str]) -> InputError:
        hint = f"did you mean {known[0]}?" if len(known) == 1 else f"it may have {', '.join(known)}"
        return self.fault(shown(key)[1:-1], f"is not known; {hint}")

    def path(self, key: str, folder: Path) -> Path:
        """Return the file that a key names, or a folder's bag. Raises InputError where there is none in the folder."""
        text = self.needed(key)
        path = folder / text
        real = real_path(path)
        if real is None:
            raise self.fault(key, f'= "{text[:200]}" is not a usable path')
        if not real.is_relative_to(folder.resolve()):
            raise self.fault(key, f'= "{text}" leads outside the data set; copy the file into it')
        if not (real.is_file() or (real / BAG_FOLDER).is_file()):
            raise self.fault(key, f'= "{text}": there is no such file')
        return path


def shown(value: Any) -> str:
    """Return a value as a message shows it: its beginning where it is long."""
    text = repr(value)
    return text if len(text) < 60 else f"{text[:60]}..."


def take(document: dict[str, Any], key: str, kind: type, file: Path, name: str) -> Any:
    """Return a part of a document. Raises InputError where it is absent, empty or of another kind."""
    value = document.get(key)
    if not isinstance(value, kind) or not value:
        raise InputError(f"{file}: {name} is missing")
    return value

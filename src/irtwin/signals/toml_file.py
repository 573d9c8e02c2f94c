"""A table of a TOML file: every fault names the file, the table and the key."""

from __future__ import annotations

import difflib
import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from irtwin.errors import InputError
from irtwin.input_file import real_path

BAG_FOLDER = "metadata.yaml"  # what a folder that is a ROS 2 bag holds
_NEAR, _VERY_NEAR = 0.7, 0.8  # share of letters in common of a key and its misspelling (`difflib`)


@dataclass(frozen=True)
class TomlTable:
    """A TOML table whose faults name it."""

    file: Path
    name: str
    values: dict[str, Any]

    def text(self, key: str, default: str | None = None) -> str | None:
        """Return the text of a key. Raises InputError where it is no text, or blank."""
        value = self.values.get(key, default)
        if value is not None and not (isinstance(value, str) and value.strip()):
            raise InputError(f"{self.file}: {self.name} {key} should be text, not {shown(value)}")
        return value

    def number(self, key: str, *, least: float = -math.inf) -> float | None:
        """Return the number of a key, None where it is absent. Raises InputError where it is none, or below `least`."""
        value = self.values.get(key)
        if value is None:
            return None
        if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value) or value < least:
            bound = "" if least == -math.inf else f" of at least {least:g}"
            raise InputError(f"{self.file}: {self.name} {key} should be a number{bound}, not {shown(value)}")
        return float(value)

    def numbers(self, key: str, count: int, what: str) -> Any:
        """Return a tuple of so many numbers, None where none are. Raises InputError, saying `what` they should be."""
        value = self.values.get(key)
        if value is None:
            return None
        if not (isinstance(value, list) and len(value) == count):
            raise InputError(f"{self.file}: {self.name} {key} should be {what}, not {shown(value)}")
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

    def _misspelt(self, key: str, known: Sequence[str]) -> InputError:
        hint = f"did you mean {known[0]}?" if len(known) == 1 else f"it may have {', '.join(known)}"
        named = f"{self.name} {shown(key)[1:-1]}".lstrip()
        return InputError(f"{self.file}: {named} is no key of the log format; {hint}")

    def path(self, key: str, folder: Path) -> Path:
        """Return the file that a key names, or a folder's bag. Raises InputError where there is none in the folder."""
        text = self.text(key)
        if text is None:
            raise InputError(f"{self.file}: {self.name} {key} is missing")
        path = folder / text
        real = real_path(path)
        if real is None:
            raise InputError(f'{self.file}: {self.name} {key} = "{text[:200]}" is not a usable path')
        if not real.is_relative_to(folder.resolve()):
            raise InputError(
                f'{self.file}: {self.name} {key} = "{text}" leads outside the data set; copy the file into it'
            )
        if not (real.is_file() or (real / BAG_FOLDER).is_file()):
            raise InputError(f'{self.file}: {self.name} {key} = "{text}": there is no such file')
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

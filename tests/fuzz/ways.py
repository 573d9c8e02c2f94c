"""The ways in which what a case has is spoilt, each by its name and a seed: "cell", or "archive: rows"."""

from __future__ import annotations

import sqlite3
import zipfile
import zlib
from collections.abc import Callable, Mapping
from contextlib import suppress
from pathlib import Path

import numpy as np
import pyarrow as pa
from hypothesis import strategies as st
from openpyxl.utils.exceptions import IllegalCharacterError
from tests.fuzz import archives, extensions, recordings, spoil, workspaces

_Ways = Mapping[str, Callable[[Path, np.random.Generator], None]]
_BEYOND_READING = (
    *(pa.ArrowException, OverflowError, OSError, LookupError, RecursionError, ValueError),
    *(zipfile.BadZipFile, zlib.error, sqlite3.Error, IllegalCharacterError),
)
_WHERE: dict[str, tuple[str, _Ways]] = {  # what is spoilt -> where it is in a case's folder, and how
    "data": ("data", spoil.WAYS),
    "archive": ("given.zip", archives.WAYS),
    "workspace": ("workspace", workspaces.WAYS),
    "extension": ("workspace", extensions.WAYS),
    "fleet": ("fleet", workspaces.OF_FOLDERS),
    "log": ("data/runs", recordings.WAYS),
}


def spoil_case(folder: Path, way: str, seed: int) -> None:
    """Spoil what is in the folder of a case in one way; what is spoilt beyond reading stays as it is."""
    what, _, name = way.rpartition(": ")
    where, ways = _WHERE[what or "data"]
    with suppress(*_BEYOND_READING):
        ways[name](folder / where, np.random.default_rng(seed))


def spoils(*what: str, least: int = 0) -> st.SearchStrategy[tuple[tuple[str, int], ...]]:
    """Draw one or two ways to spoil these, or none, each with its seed."""
    names = [f"{one}: {name}" if one != "data" else name for one in what for name in sorted(_WHERE[one][1])]
    one = st.tuples(st.sampled_from(names), st.integers(0, 999_999))
    return st.lists(one, min_size=least, max_size=2).map(tuple)

"""Where a fleet's data sets are: below a folder, or in a list."""

from __future__ import annotations

import hashlib
from pathlib import Path

from irtwin.errors import InputError
from irtwin.input_file import read_text

_FILE = "dataset.toml"
_LONGEST = 100_000_000  # bytes of a list: a million places


def find_data_sets(source: Path) -> list[str]:
    """Return the folders of data sets, sorted.

    `source` is a folder (every folder below that has a dataset.toml), or a text file with one folder a line. Raises
    InputError where there is none.
    """
    places = [file.parent for file in source.rglob(_FILE)] if source.is_dir() else _listed(source)
    if not places:
        raise InputError(f"{source}: holds no data set; a data set is a folder with {_FILE}")
    return sorted({str(place.resolve()) for place in places})


def _listed(source: Path) -> list[Path]:
    places = []
    for number, line in enumerate(read_text(source, _LONGEST).splitlines(), start=1):
        place = line.strip()
        if not place or place.startswith("#"):
            continue
        if not (source.parent / place / _FILE).is_file():
            raise InputError(f"{source}, line {number}: {place} holds no {_FILE}")
        places.append(source.parent / place)
    return places


def checksum(data_set: Path) -> str:
    """Return the SHA-256 of a data set: of its files' names and bytes."""
    whole = hashlib.sha256()
    for file in sorted(path for path in data_set.rglob("*") if path.is_file()):
        whole.update(str(file.relative_to(data_set)).encode() + b"\0")
        with file.open("rb") as content:
            hashlib.file_digest(content, lambda: whole)
    return whole.hexdigest()

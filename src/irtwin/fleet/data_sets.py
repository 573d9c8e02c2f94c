"""Where a fleet's data sets are: below a folder, in a list, or in object storage."""

from __future__ import annotations

import hashlib
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from irtwin.errors import InputError
from irtwin.input_file import read_text

_FILE = "dataset.toml"
_LONGEST = 100_000_000  # bytes of a list: a million places
_BLOCK = 1 << 20  # bytes read at once


def find_data_sets(source: str) -> list[str]:
    """Return the places of data sets, sorted: folders, or URLs of object storage.

    `source` is a folder (every folder below that has a dataset.toml), a text file with one place a line, or a URL that
    fsspec knows, such as s3://bucket/robots. Raises InputError where there is none.
    """
    places = _in_storage(source) if "://" in source else _on_disk(Path(source))
    if not places:
        raise InputError(f"{source}: holds no data set; a data set is a folder with {_FILE}")
    return sorted(dict.fromkeys(places))


def _on_disk(source: Path) -> list[str]:
    if source.is_dir():
        return [str(file.parent.resolve()) for file in source.rglob(_FILE)]
    places = []
    for number, line in enumerate(read_text(source, _LONGEST).splitlines(), start=1):
        place = line.strip()
        if not place or place.startswith("#"):
            continue
        folder = source.parent / place
        if "://" not in place and not (folder / _FILE).is_file():
            raise InputError(f"{source}, line {number}: {place} holds no {_FILE}")
        places.append(place if "://" in place else str(folder.resolve()))
    return places


def _in_storage(url: str) -> list[str]:
    files, root = _fsspec(url).core.url_to_fs(url)
    names = files.find(root)
    return [files.unstrip_protocol(path[: -len(_FILE) - 1]) for path in names if path.endswith(f"/{_FILE}")]


@contextmanager
def at_hand(place: str) -> Iterator[Path]:
    """Give a data set as a folder of this machine; what comes from object storage is gone at the end."""
    if "://" not in place:
        yield Path(place)
        return
    files, root = _fsspec(place).core.url_to_fs(place)
    with tempfile.TemporaryDirectory(prefix="irtwin-fleet-") as folder:
        files.get(root, folder, recursive=True)
        here = Path(folder, Path(root).name)  # some storages copy the folder, some what is in it
        yield here if here.is_dir() else Path(folder)


def checksum(data_set: Path) -> str:
    """Return the SHA-256 of a data set: of its files' names and bytes."""
    whole = hashlib.sha256()
    for file in sorted(path for path in data_set.rglob("*") if path.is_file()):
        whole.update(str(file.relative_to(data_set)).encode() + b"\0")
        with file.open("rb") as content:
            while block := content.read(_BLOCK):
                whole.update(block)
    return whole.hexdigest()


def _fsspec(url: str) -> Any:
    try:
        import fsspec
    except ModuleNotFoundError:
        raise InputError(f'{url}: object storage needs fsspec; pip install "irtwin[fleet]"') from None
    if url.split("://")[0] not in fsspec.available_protocols():
        raise InputError(f"{url}: no such kind of storage; fsspec knows {', '.join(fsspec.available_protocols())}")
    return fsspec

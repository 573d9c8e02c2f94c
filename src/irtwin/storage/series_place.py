"""Where the series of a workspace are: in its folder, or in object storage, which `series.toml` of the folder names."""

from __future__ import annotations

import tomllib
import uuid
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

from irtwin.errors import InputError
from irtwin.input_file import read_input
from irtwin.storage import files
from irtwin.storage.object_storage import ObjectStorage

FILE = "series.toml"
_MOST_BYTES = 10_000
_MOVE = "`irtwin backup FILE`, then `irtwin restore FILE --workspace NEW --series URL` moves them"


@dataclass(frozen=True)
class _Said:
    """What `series.toml` says: the URL, and by which name the workspace claims what lies there."""

    url: str
    workspace: str


def elsewhere(folder: Path) -> ObjectStorage | None:
    """Return the object storage that holds a workspace's series; None where its folder does.

    Raises InputError where `series.toml` is damaged, or s3fs is missing.
    """
    said = _said(folder)
    return None if said is None else _storage(said.url)


def are_elsewhere(folder: Path) -> bool:
    """Whether the series of a workspace are in object storage."""
    return (folder / FILE).exists()


def look(url: str) -> None:
    """Raise InputError where object storage cannot be read, before anything is made of it."""
    _storage(url).owner()


def choose(folder: Path, url: str, has_series: bool) -> None:
    """Let the series of a workspace be in object storage from now on.

    Raises InputError where it has series already, in another place, or where another workspace has its series there.
    """
    storage, said = _storage(url), _said(folder)
    if said is not None:
        if said.url != storage.url:
            raise InputError(f"{folder}: its series are in {said.url}, not in {storage.url}; {_MOVE}")
        return
    if has_series:
        raise InputError(f"{folder}: its series are in its folder already; {_MOVE}")
    if storage.owner() is not None:
        raise InputError(f"{storage.url}: holds the series of another workspace; choose another prefix")
    name = str(uuid.uuid4())
    text = f"# Where the series of this workspace are. Written by irtwin.\nurl = {_quoted(storage.url)}\n"
    files.write(folder / FILE, f'{text}workspace = "{name}"\n'.encode())
    try:
        storage.claim(name)
    except InputError:
        (folder / FILE).unlink()
        raise


def check(folder: Path) -> None:
    """Raise InputError where the series are in object storage that cannot be read, or has become another's."""
    said = _said(folder)
    if said is not None:
        storage = _storage(said.url)
        if storage.owner() != said.workspace:
            storage.claim(said.workspace)


def _said(folder: Path) -> _Said | None:
    file = folder / FILE
    if not file.exists():
        return None
    try:
        said = tomllib.loads(read_input(file, _MOST_BYTES).decode("utf-8"))
        return _Said(str(said["url"]), str(said["workspace"]))
    except (tomllib.TOMLDecodeError, UnicodeDecodeError, KeyError):
        raise InputError(
            f"{file}: damaged: it has to say url and workspace, as it did; put the file back, or `irtwin restore` a "
            "backup into another folder"
        ) from None


def _quoted(text: str) -> str:
    return '"' + text.replace("\\", "\\\\").replace('"', '\\"') + '"'


@lru_cache(maxsize=16)
def _storage(url: str) -> ObjectStorage:
    return ObjectStorage(url)

"""Where the series of a workspace are: in its folder, or in object storage, which `series.toml` of the folder names."""

from __future__ import annotations

import uuid
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

from irtwin.errors import InputError
from irtwin.storage import files
from irtwin.storage.object_storage import ObjectStorage, checked_url
from irtwin.toml_text import read_toml
from irtwin.trust import how, trust, trusted

FILE = "series.toml"
_MOVE = "`irtwin workspace backup FILE`, then `irtwin workspace restore FILE --workspace NEW --series URL` moves them"


@dataclass(frozen=True)
class _Said:
    """What `series.toml` says: the URL, and by which name the workspace claims what lies there."""

    url: str
    workspace: str


def elsewhere(folder: Path) -> ObjectStorage | None:
    """Return the object storage that holds a workspace's series; None where its folder does.

    Raises InputError where `series.toml` is damaged, names storage that the user has not trusted it with, or s3fs is
    missing.
    """
    said = _said(folder)
    return None if said is None else _storage(said.url)


def asked(url: str) -> str:
    """Return the name by which a user trusts a workspace with object storage."""
    return f"{FILE}: {checked_url(url)}"


def asks(folder: Path) -> list[str]:
    """Return what `series.toml` of a workspace asks for, by name: nothing where there is none."""
    return [asked(_read(folder / FILE).url)] if (folder / FILE).exists() else []


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
    trust(folder, [asked(url)])
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
    said = _read(file)
    if asked(said.url) not in trusted(folder):
        raise InputError(f"{file}: names {said.url}, which nothing is read from or written to yet; {how(folder)}")
    return said


def _read(file: Path) -> _Said:
    try:
        said = read_toml(file)
        return _Said(checked_url(str(said["url"])), str(said["workspace"]))
    except (KeyError, InputError):
        raise InputError(
            f"{file}: damaged: it has to say url and workspace, as it did; put the file back, or restore "
            "a backup into another folder"
        ) from None


def _quoted(text: str) -> str:
    return '"' + text.replace("\\", "\\\\").replace('"', '\\"') + '"'


@lru_cache(maxsize=16)
def _storage(url: str) -> ObjectStorage:
    return ObjectStorage(url)

"""What the files of a workspace may do, by the user's word: `irtwin workspace trust WORKSPACE`.

A workspace may come from elsewhere, and its files may ask for something: rules and templates to run, hosts to send to,
variables of the environment. Each is asked for by a name that says what. The user's word is
kept in the user's own folder, by that name and the workspace's place; a folder made anew at a place has none.
"""

from __future__ import annotations

import fcntl
import json
import os
from collections.abc import Callable, Iterable
from pathlib import Path

from irtwin.errors import InputError
from irtwin.input_file import read_text
from irtwin.json_text import parse_json
from irtwin.storage.files import locked, write

_MOST_BYTES = 100_000_000
_Given = dict[str, dict[str, object]]  # of each place: the folder's number there, and the names that are trusted


def trusted(workspace: Path) -> frozenset[str]:
    """Return what a workspace's files may do, by name. Raises InputError where the user's file cannot be read."""
    given = _read().get(_place(workspace))
    names = given["names"] if given is not None and given.get("folder") == _number(workspace) else ()
    return frozenset(names if isinstance(names, list) else ())


def trust(workspace: Path, names: Iterable[str]) -> None:
    """Let a workspace's files do these too, from now on. Raises InputError where that cannot be written down."""
    known = trusted(workspace).union(names)
    entry: dict[str, object] = {"folder": _number(workspace), "names": sorted(known)}
    _change(lambda given: given | ({_place(workspace): entry} if known else {}))


def withdraw(workspace: Path) -> None:
    """Let the files of a workspace, or of what will be one at that place, do nothing any more."""
    _change(lambda given: {place: value for place, value in given.items() if place != _place(workspace)})


def how(workspace: Path) -> str:
    """Say what lets a workspace's files do what they ask for."""
    return f"`irtwin workspace trust {workspace}` lists what it asks for, and allows it"


def _file() -> Path:
    return Path(os.environ.get("XDG_CONFIG_HOME") or Path.home() / ".config") / "irtwin" / "trust.json"


def _place(workspace: Path) -> str:
    return str(workspace.resolve())


def _number(workspace: Path) -> int | None:
    """Return what tells a folder from another that was at its place before."""
    return workspace.stat().st_ino if workspace.exists() else None


def _read() -> _Given:
    file = _file()
    try:
        given = parse_json(read_text(file, _MOST_BYTES)) if file.exists() else {}
        if isinstance(given, dict) and all(isinstance(value, dict) and "names" in value for value in given.values()):
            return given
    except (InputError, OSError, ValueError):
        pass
    raise InputError(f"{file}: cannot be read; remove it, and trust your workspaces again")


def _change(change: Callable[[_Given], _Given]) -> None:
    if change(before := _read()) == before:
        return
    file = _file()
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"{file.parent}: cannot be made ({error.strerror}); set XDG_CONFIG_HOME") from None
    with locked(file.parent, fcntl.LOCK_EX):  # another command may change it too
        write(file, json.dumps(change(_read()), indent=1).encode())

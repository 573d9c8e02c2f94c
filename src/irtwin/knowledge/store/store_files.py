"""The files that a store consists of, looked through before it is opened.

RocksDB opens sixteen of its tables at once and the others when they are read. An aggregate over a table that is then
missing or altered never ends, and takes all memory; one that opens a manifest cut between two records shows an older
state, or an empty store. So what was noted when the store was closed is compared: the CRC-32 of its tables, which never
change once they are written, and that of its manifest, which only grows. Tables that were noted are all there as long
as the manifest is what it was: a store that is opened to write begins a new one. A table is read again only where its
modification time is not the one noted.
"""

from __future__ import annotations

import json
from contextlib import suppress
from pathlib import Path
from typing import Any
from zlib import crc32

from irtwin.errors import InputError
from irtwin.input_file import read_text
from irtwin.json_text import parse_json

_SUMS = "irtwin-sums.json"  # {"read": {name: [CRC-32, mtime in ns]}, "manifest": [name, size, CRC-32]}
_MOST_BYTES = 100_000_000  # of it
_PIECE = 1 << 20
_TRIES = 20

Sums = dict[str, list[int]]  # name -> CRC-32, modification time in ns


def fault(folder: Path) -> str | None:
    """Return what is wrong with a store's files; None where nothing is, or it is for RocksDB to tell."""
    damage = None
    for _ in range(_TRIES):
        before = _manifest(folder)
        damage = _fault(folder)
        if damage is None or before == _manifest(folder):  # else another process changed the files meanwhile
            return damage
    return damage


def note_sums(folder: Path) -> None:
    """Note the CRC-32 of the tables and of the manifest, so that a later change of them is found."""
    before = _noted(folder)
    known, sums = _sums(before), Sums()
    for table in sorted(folder.glob("*.sst")):
        with suppress(FileNotFoundError):  # the store has merged it into another meanwhile
            summed, noted = _sum(table, known.get(table.name)), known.get(table.name)
            sums[table.name] = noted if noted and noted[0] != summed[0] else summed  # altered: told at the next opening
    now = {"read": sums, "manifest": _of_manifest(folder)}
    if now != before:
        temporary = folder / f".{_SUMS}"
        temporary.write_text(json.dumps(now))
        temporary.replace(folder / _SUMS)


def _fault(folder: Path) -> str | None:
    if (folder / "CURRENT").exists() and not _manifest(folder):
        return "the manifest that CURRENT names is missing"
    noted = _noted(folder)
    if _is_altered(folder, noted):
        return "the manifest was altered"
    is_as_noted = noted.get("manifest") == _of_manifest(folder)
    for name, known in _sums(noted).items():
        try:
            if _sum(folder / name, known)[0] != known[0]:
                return f"{name} was altered"
        except FileNotFoundError:
            if is_as_noted:  # else it may have been merged into another since
                return f"{name} is missing"
    return None


def _noted(folder: Path) -> dict[str, Any]:
    try:
        noted = parse_json(read_text(folder / _SUMS, _MOST_BYTES))
    except (InputError, ValueError):
        return {}
    return noted if isinstance(noted, dict) else {}


def _sums(noted: dict[str, Any]) -> Sums:
    read = noted.get("read")
    if not isinstance(read, dict):
        return {}
    return {name: value for name, value in read.items() if isinstance(value, list) and len(value) == 2}


def _sum(table: Path, known: list[int] | None) -> list[int]:
    """Return a table's CRC-32 and modification time: those known, where that time is the same."""
    modified = table.stat().st_mtime_ns
    return known if known and known[1] == modified else [_crc(table), modified]


def _is_altered(folder: Path, noted: dict[str, Any]) -> bool:
    """Return whether the manifest is the one that was noted, and does not begin with what it was."""
    match noted.get("manifest"):
        case [name, int(size), crc]:
            manifest = _manifest(folder)
            return bool(name == _manifest_name(folder) and (len(manifest) < size or crc32(manifest[:size]) != crc))
    return False


def _of_manifest(folder: Path) -> list[Any]:
    manifest = _manifest(folder)
    return [_manifest_name(folder), len(manifest), crc32(manifest)]


def _crc(file: Path) -> int:
    crc = 0
    with file.open("rb") as stream:
        while piece := stream.read(_PIECE):
            crc = crc32(piece, crc)
    return crc


def _manifest_name(folder: Path) -> str:
    try:
        return (folder / "CURRENT").read_text().strip()
    except (OSError, ValueError):
        return ""


def _manifest(folder: Path) -> bytes:
    try:
        return (folder / _manifest_name(folder)).read_bytes()
    except OSError:
        return b""

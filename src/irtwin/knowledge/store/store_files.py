"""The files that a store consists of, looked through before it is opened.

RocksDB opens sixteen of its tables at once and the others when they are read. An aggregate over a table that is then
missing or altered never ends, and takes all memory; one that opens a manifest cut between two records shows an older
state, or an empty store. So what was noted when the store was closed is compared: the CRC-32 of the tables that the
manifest names, which never change once they are written, and that of the manifest, which only grows. A store that is
opened to write begins a new manifest. A table is read again only where its modification time is not the one noted.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any
from zlib import crc32

from irtwin.errors import InputError
from irtwin.input_file import read_text
from irtwin.json_text import parse_json

_SUMS = "irtwin-sums.json"  # {"read": {name: [CRC-32, mtime in ns]}, "manifest": [name, size, CRC-32]}
_MOST_BYTES = 100_000_000  # of it
_BLOCK, _HEADER = 32768, 7
_PIECE = 1 << 20
_TRIES = 20
_NUMBERS = {2: 1, 3: 1, 4: 1, 6: 2, 9: 1, 10: 1, 200: 1, 202: 0, 203: 1, 300: 1}  # fields of a tag, all numbers
_TEXT, _CURSOR, _DELETED, _NEW, _IGNORABLE = (1, 201), 5, 6, 103, 8192

Tables = dict[str, int]  # name -> size
Sums = dict[str, list[int]]  # name -> CRC-32, modification time in ns


def fault(folder: Path) -> str | None:
    """Return what is wrong with a store's files; None where nothing is, or its manifest is for RocksDB to judge."""
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
    for name in _tables(folder) or {}:
        with suppress(FileNotFoundError):  # the store has merged it into another meanwhile
            summed, noted = _sum(folder / name, known.get(name)), known.get(name)
            sums[name] = noted if noted and noted[0] != summed[0] else summed  # altered: told at the next opening
    manifest = _manifest(folder)
    now = {"read": sums, "manifest": [_manifest_name(folder), len(manifest), crc32(manifest)]}
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
    sums = _sums(noted)
    for name, size in (_tables(folder) or {}).items():
        try:
            if (folder / name).stat().st_size != size:
                return f"{name} has another size"
            if name in sums and _sum(folder / name, sums[name])[0] != sums[name][0]:
                return f"{name} was altered"
        except FileNotFoundError:
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


def _tables(folder: Path) -> Tables | None:
    """Return the tables that the manifest names; None where it cannot be read."""
    tables: Tables = {}
    try:
        for record in _records(_manifest(folder)):
            _apply(record, tables)
    except (IndexError, ValueError):
        return None
    return tables


def _records(manifest: bytes) -> Iterator[bytes]:
    """Yield the records of a file in RocksDB's log format."""
    record = b""
    for block in range(0, len(manifest), _BLOCK):
        place, end = block, min(block + _BLOCK, len(manifest))
        while place + _HEADER <= end:
            length, kind = int.from_bytes(manifest[place + 4 : place + 6], "little"), manifest[place + 6]
            if kind == 0:
                break
            if kind > 4:
                raise ValueError("a kind of record that manifests do not have")
            record += manifest[place + _HEADER : place + _HEADER + length]
            if kind in (1, 4):  # whole, or the last part of one
                yield record
                record = b""
            place += _HEADER + length


def _apply(record: bytes, tables: Tables) -> None:
    """Follow one edit of the store's version."""
    fields = _Fields(record)
    while fields.place < len(record):
        tag = fields.number()
        if tag == _NEW:
            fields.number()  # level
            name, size = f"{fields.number():06d}.sst", fields.number()
            fields.skip_texts(2)  # smallest and largest key
            fields.number(), fields.number()  # and sequence number
            while fields.number() != 1:
                fields.skip_texts(1)
            tables[name] = size
        elif tag == _DELETED:
            fields.number()
            tables.pop(f"{fields.number():06d}.sst", None)
        elif tag == _CURSOR:
            fields.number()
            fields.skip_texts(1)
        elif tag in _TEXT or tag & _IGNORABLE:
            fields.skip_texts(1)
        else:
            for _ in range(_NUMBERS[tag] if tag in _NUMBERS else _unknown(tag)):
                fields.number()


class _Fields:
    """The fields of a record: numbers of seven bits a byte, and texts after their length."""

    def __init__(self, record: bytes) -> None:
        self._record = record
        self.place = 0

    def number(self) -> int:
        value = shift = 0
        while True:
            byte = self._record[self.place]
            self.place += 1
            value |= (byte & 127) << shift
            shift += 7
            if byte < 128:
                return value

    def skip_texts(self, count: int) -> None:
        for _ in range(count):
            length = self.number()
            self.place += length


def _unknown(tag: int) -> int:
    raise ValueError(f"unknown tag {tag}")

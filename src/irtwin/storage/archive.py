"""Files in one ZIP archive with the SHA-256 of each, so that a damaged or foreign one is told before it is restored."""

from __future__ import annotations

import hashlib
import json
import re
import shutil
import zipfile
import zlib
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import IO, Any

from irtwin.errors import InputError
from irtwin.json_text import parse_json
from irtwin.storage import files

_FORMAT = {"format": "irtwin backup", "version": 1}
_MANIFEST = "manifest.json"
_MOST_MANIFEST = 1 << 26  # bytes: some 400,000 files
_PIECE = 1 << 20


def pack(contents: Mapping[str, Path], archive: Path, about: Mapping[str, Any], known: Mapping[str, str]) -> list[str]:
    """Write files, by their names in the archive, and what is to be said of them; whole or not at all.

    known: SHA-256 that files are to have. Where one has another nothing is written; returns the names of such files.
    """
    sums: dict[str, dict[str, Any]] = {}
    with files.temporary_beside(archive.parent) as temporary:
        with zipfile.ZipFile(temporary, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as target:
            for name, file in contents.items():
                entry = zipfile.ZipInfo(name)
                packed = file.suffix == ".parquet"  # compressed already
                entry.compress_type = zipfile.ZIP_STORED if packed else zipfile.ZIP_DEFLATED
                with file.open("rb") as source, target.open(entry, "w", force_zip64=True) as sink:
                    sums[name] = dict(zip(("sha256", "size"), _copy(source, sink), strict=True))
            altered = [name for name, checksum in known.items() if sums[name]["sha256"] != checksum]
            if altered:
                return altered
            manifest = {**_FORMAT, **about, "files": sums}
            target.writestr(_MANIFEST, json.dumps(manifest, indent=1))
        files.put_in_place(temporary, archive)
    return []


def unpack(archive: Path, folder: Path, names: re.Pattern[str]) -> Iterator[tuple[str, str]]:
    """Write an archive's files into a folder and yield their names and SHA-256, each once that agreed.

    names: what a name must be, and no other is written.

    Raises InputError where it is no archive of ours, is damaged, or names what does not belong into the folder.
    """
    with _reading(archive) as source:
        listed = _manifest(archive, source)
        for name in listed:
            if not names.fullmatch(name):
                raise InputError(f"{archive}: the name {name!r} does not belong in a workspace; nothing was restored")
        room = shutil.disk_usage(folder).free
        if sum(size for _, size in listed.values()) > room:
            raise InputError(f"{archive}: needs more than the {room >> 20} MB that are free; free some space")
        for name, (checksum, _) in listed.items():
            file = folder / name
            file.parent.mkdir(parents=True, exist_ok=True)
            with source.open(name) as content, file.open("xb") as sink:
                if _copy(content, sink)[0] != checksum:
                    raise InputError(f"{archive}: {name} is damaged, its checksum differs; use another backup")
            yield name, checksum


@contextmanager
def _reading(archive: Path) -> Iterator[zipfile.ZipFile]:
    try:
        with zipfile.ZipFile(archive) as source:
            yield source
    except OSError as error:
        raise InputError(f"{archive}: cannot be read: {error.strerror}") from None
    except (zipfile.BadZipFile, zlib.error, EOFError, NotImplementedError, RuntimeError, ValueError) as error:
        raise InputError(f"{archive}: damaged, or not a backup ({error}); use another one") from None


def _manifest(archive: Path, source: zipfile.ZipFile) -> dict[str, tuple[str, int]]:
    """Return checksum and size of each file, in the order of the archive; what the ZIP says itself must agree."""
    entries = {entry.filename: entry for entry in source.infolist()}
    manifest = entries.pop(_MANIFEST, None)
    foreign = InputError(f"{archive}: not an irtwin backup; make one with `irtwin workspace backup FILE`")
    if manifest is None or manifest.file_size > _MOST_MANIFEST:
        raise foreign
    content = parse_json(source.read(manifest))
    if not isinstance(content, dict) or content.get("format") != _FORMAT["format"]:
        raise foreign
    if content.get("version") != _FORMAT["version"]:
        raise InputError(
            f"{archive}: made by another irtwin version ({content.get('software')}); restore it with that one"
        )
    try:
        listed = {str(name): (str(entry["sha256"]), entry["size"]) for name, entry in content["files"].items()}
    except (AttributeError, KeyError, TypeError):
        raise foreign from None
    agree = len(source.infolist()) == len(listed) + 1 and set(entries) == set(listed)
    if not agree or any(entries[name].file_size != size for name, (_, size) in listed.items()):
        raise InputError(f"{archive}: damaged: its files do not match its list; use another backup")
    return listed  # so its sizes are whole numbers, equal to those of the ZIP


def _copy(source: IO[bytes], sink: IO[bytes]) -> tuple[str, int]:
    """Copy a file; return its SHA-256 and its size."""
    checksum, size = hashlib.sha256(), 0
    while piece := source.read(_PIECE):
        checksum.update(piece)
        size += len(piece)
        sink.write(piece)
    return checksum.hexdigest(), size

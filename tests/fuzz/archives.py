"""Ways in which an archive is not what `irtwin workspace backup` wrote: its ZIP, list, rows, graph, files."""

from __future__ import annotations

import hashlib
import json
import stat
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from tests.fuzz.extensions import FILES
from tests.fuzz.tables_of_toml import toml
from tests.fuzz.values import as_json, odd, some

Entries = dict[str, bytes]
_MANIFEST = "manifest.json"
_NAMES = (
    *("../x", "../../x", "/etc/x", "OUTSIDE/x", "rows/../../x", "reports/..", "reports/x/y", "rows/x\0y", "a\\..\\x"),
    *("reports/" + "n" * 300, "irtwin.db", "graph/CURRENT", "series.toml", "alarms.toml", ".hidden", "reports/.x"),
    *("rows/other.jsonl", "reports/x.html/", "live/x.journal", "series/x.parquet", "", " ", "manifest.json/x"),
)
_GRAPH = (
    *("<urn:a> <urn:b> <urn:c> <urn:d> .", "<urn:a b> <urn:b> <urn:c> .", "<a> <b> <c> .", "_:a <urn:b> _:a .", "x"),
    *('<urn:a> <urn:b> "' + "x" * 100_000 + '" .', '<urn:a> <urn:b> "\\uD800" .', '<urn:a> <urn:b> "x"@' + "a" * 99),
    '<https://w3id.org/irtwin#x> <http://www.w3.org/2002/07/owl#sameAs> "x" <https://w3id.org/irtwin/graph/inferred> .',
    '<urn:a> <urn:b> "NaN"^^<http://www.w3.org/2001/XMLSchema#dateTime> <https://w3id.org/irtwin/graph/source/robot> .',
    "<urn:a> <http://www.w3.org/1999/02/22-rdf-syntax-ns#type> <http://www.w3.org/2002/07/owl#Nothing> .",
    "<< <urn:a> <urn:b> <urn:c> >> <urn:b> <urn:c> .",
)


def _rows(entries: Entries, rng: np.random.Generator) -> None:
    """Change up to three values of a row."""
    name, lines, place = _row(entries, rng)
    row = json.loads(lines[place])
    for _ in range(rng.integers(1, 4)):
        row[some(rng, row)] = odd(rng)
    lines[place] = as_json(row)
    _put_lines(entries, name, lines)


def _key(entries: Entries, rng: np.random.Generator) -> None:
    """Change a name wherever it stands, so that all rows agree on it."""
    old = some(rng, ["arm.live_", "arm.", '"arm"', "joint_1", "swing"])
    new = as_json(str(odd(rng)))[1:-1].encode()
    for name in [name for name in entries if name.startswith("rows/")]:
        entries[name] = entries[name].replace(old.encode(), b'"' + new + b'"' if old == '"arm"' else new)


def _lines(entries: Entries, rng: np.random.Generator) -> None:
    """Spoil the lines of a table."""
    name, lines, place = _row(entries, rng)
    row = json.loads(lines[place])
    how = rng.integers(7)
    if how == 0:
        lines.insert(place, lines[place])
    elif how == 1:
        del lines[place]
    elif how == 2:
        row.pop(some(rng, row))
        lines[place] = as_json(row)
    elif how == 3:
        lines[place] = as_json(row | {"more": 1})
    elif how == 4:
        lines[place] = some(rng, ["{", "[]", "1", "", "[" * 100_000, "\ufeff{}", "null", as_json(row) * 2])
    elif how == 5:
        lines.clear()
    else:
        lines *= 3
    _put_lines(entries, name, lines)


def _tables(entries: Entries, rng: np.random.Generator) -> None:
    """Exchange, remove or invent a table."""
    one, other = (some(rng, [name for name in entries if name.startswith("rows/")]) for _ in range(2))
    how = rng.integers(3)
    if how == 0:
        entries[one], entries[other] = entries[other], entries[one]
    elif how == 1:
        del entries[one]
    else:
        entries["rows/sqlite_master.jsonl"] = entries[one]


def _entry(entries: Entries, rng: np.random.Generator) -> None:
    """Put a file in, under a name that may lead out of the workspace."""
    entries[some(rng, _NAMES)] = b"x"


def _extension(entries: Entries, rng: np.random.Generator) -> None:
    """Put in what extends or settles a workspace."""
    kind = some(rng, FILES)
    name, text = some(rng, FILES[kind][0]), some(rng, FILES[kind][1])
    entries[f"{kind}/{name}"] = text.encode("utf-8", "surrogatepass")
    if rng.integers(2):
        entries["plant.toml"] = toml("plant.toml", rng)


def _graph(entries: Entries, rng: np.random.Generator) -> None:
    """Add to the graph, or put another in its place."""
    more = "\n".join(some(rng, _GRAPH) for _ in range(rng.integers(1, 4))).encode("utf-8", "surrogatepass")
    entries["graph.nq"] = more if rng.integers(3) == 0 else entries["graph.nq"] + more + b"\n"


def _file(entries: Entries, rng: np.random.Generator) -> None:
    """Put garbage in place of a file that rows name, with the checksum that they say."""
    folders = ("series/", "twins/", "diagnoses/", "next_experiment/", "reports/", "live/")
    name = some(rng, [name for name in entries if name.startswith(folders)])
    old = hashlib.sha256(entries[name]).hexdigest().encode()
    text = entries[name]
    where = int(rng.integers(len(text)))
    begin = text[:where]
    garbage = [b"", b"[" * 100_000, b"{}", b"null", begin, begin + b"\xff\x00" + text[where + 2 :], text * 2]
    entries[name] = some(rng, [*garbage, _numbers(text, rng)])
    new = hashlib.sha256(entries[name]).hexdigest().encode()
    for rows in [name for name in entries if name.startswith("rows/")]:
        entries[rows] = entries[rows].replace(old, new)


def _numbers(text: bytes, rng: np.random.Generator) -> bytes:
    """Change a value in a file of JSON."""
    try:
        said = json.loads(text)
    except ValueError:
        return b"\x00" * 1000
    inner: Any = said
    while True:
        key = some(rng, inner if isinstance(inner, dict) else range(len(inner)))
        if not (isinstance(inner[key], dict | list) and inner[key]) or rng.integers(6) == 0:
            inner[key] = odd(rng)
            return as_json(said).encode()
        inner = inner[key]


def _bomb(entries: Entries, rng: np.random.Generator) -> None:
    """Put in much that is packed small."""
    entries[some(rng, ["graph.nq", "rows/robot.jsonl", "rows/run.jsonl", "reports/x.html"])] = (
        some(rng, [b" ", b"[", b"\0", b"\n", b"x"]) * 120_000_000
    )


def _row(entries: Entries, rng: np.random.Generator) -> tuple[str, list[str], int]:
    name = some(rng, [name for name, text in entries.items() if name.startswith("rows/") and text])
    lines = entries[name].decode().splitlines()
    return name, lines, int(rng.integers(len(lines)))


def _put_lines(entries: Entries, name: str, lines: list[str]) -> None:
    entries[name] = "".join(f"{line}\n" for line in lines).encode("utf-8", "surrogatepass")


def _sums(said: dict[str, Any], rng: np.random.Generator) -> None:
    """Change what the list says of a file."""
    file = said["files"][some(rng, said["files"])]
    file[some(rng, file)] = odd(rng)


def _manifest(said: dict[str, Any], rng: np.random.Generator) -> None:
    """Change what the list says of the backup."""
    said[some(rng, said)] = odd(rng)


def _unlisted(said: dict[str, Any], rng: np.random.Generator) -> None:
    """Take a file out of the list, or put one in."""
    name = some(rng, said["files"])
    entry = said["files"].pop(name)
    if rng.integers(2):
        said["files"][some(rng, _NAMES)] = entry


def _cut(archive: Path, rng: np.random.Generator) -> None:
    content = archive.read_bytes()
    archive.write_bytes(content[: rng.integers(len(content))])


def _flip(archive: Path, rng: np.random.Generator) -> None:
    content = bytearray(archive.read_bytes())
    for _ in range(rng.integers(1, 20)):
        tail = rng.integers(min(len(content), 6000)) if rng.integers(2) else rng.integers(len(content))
        content[-1 - int(tail)] = rng.integers(256)
    archive.write_bytes(content)


def _twice(archive: Path, rng: np.random.Generator) -> None:
    """Give two entries one name."""
    with zipfile.ZipFile(archive, "a") as target:
        target.writestr(some(rng, target.namelist()), b"x")


def _link(archive: Path, rng: np.random.Generator) -> None:
    """Put in a symbolic link."""
    with zipfile.ZipFile(archive, "a") as target:
        entry = zipfile.ZipInfo(some(rng, ["reports/x.html", "series/x.parquet", "live", "rows"]))
        entry.external_attr = (stat.S_IFLNK | 0o777) << 16
        outside = archive.parents[1]
        target.writestr(entry, some(rng, [str(outside / "etc/passwd"), "../../x", str(outside / "x")]))


def _nested(archive: Path, rng: np.random.Generator) -> None:
    """Wrap the archive in another, or put something before it."""
    content = archive.read_bytes()
    if rng.integers(2):
        archive.write_bytes(some(rng, [b"x", b"\0" * 1000, content]) + content)
        return
    with zipfile.ZipFile(archive, "w") as target:
        target.writestr(_MANIFEST, content)


def _of_entries(change: Callable[[Entries, np.random.Generator], None]) -> Callable[[Path, np.random.Generator], None]:
    """Change the files of an archive, whose list is true again afterwards."""

    def changed(archive: Path, rng: np.random.Generator) -> None:
        entries, said = _read(archive)
        change(entries, rng)
        said["files"] = {
            name: {"sha256": hashlib.sha256(content).hexdigest(), "size": len(content)}
            for name, content in entries.items()
        }
        _write(archive, entries, said)

    return changed


def _of_list(change: Callable[[Any, np.random.Generator], None]) -> Callable[[Path, np.random.Generator], None]:
    """Change the list of an archive alone."""

    def changed(archive: Path, rng: np.random.Generator) -> None:
        entries, said = _read(archive)
        change(said, rng)
        _write(archive, entries, said)

    return changed


def _read(archive: Path) -> tuple[Entries, Any]:
    with zipfile.ZipFile(archive) as source:
        entries = {name: source.read(name) for name in source.namelist()}
    return entries, json.loads(entries.pop(_MANIFEST))


def _write(archive: Path, entries: Entries, said: Any) -> None:
    outside = str(archive.parents[1])
    with zipfile.ZipFile(archive, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as target:
        for name, content in entries.items():
            target.writestr(name.replace("OUTSIDE", outside), content)
        target.writestr(_MANIFEST, as_json(said).replace("OUTSIDE", outside))


WAYS: dict[str, Callable[[Path, np.random.Generator], None]] = {
    "rows": _of_entries(_rows),
    "key": _of_entries(_key),
    "lines": _of_entries(_lines),
    "tables": _of_entries(_tables),
    "entry": _of_entries(_entry),
    "extension": _of_entries(_extension),
    "graph": _of_entries(_graph),
    "file": _of_entries(_file),
    "bomb": _of_entries(_bomb),
    "sums": _of_list(_sums),
    "manifest": _of_list(_manifest),
    "unlisted": _of_list(_unlisted),
    "cut": _cut,
    "flip": _flip,
    "twice": _twice,
    "link": _link,
    "nested": _nested,
}

"""Delimited text and workbooks that ask their reader for much."""

from __future__ import annotations

import struct
import zipfile
from collections.abc import Iterator
from pathlib import Path

from tests.hostile.hostile_files import Files
from tests.hostile.xml_attacks import entities

FILES = Files()
_SHEET = "http://schemas.openxmlformats.org/spreadsheetml/2006/main"
_PACKAGE = "http://schemas.openxmlformats.org/package/2006"
_OFFICE = "http://schemas.openxmlformats.org/officeDocument/2006/relationships"
_HEAD = "time,q_joint_1,tau_joint_1"
_ROWS = "".join(f"{row / 100},0.1,1\n" for row in range(30))


def _wide(name: str, count: int) -> str:
    lines = [",".join(name.format(k) for k in range(count)), *[",".join(["1"] * count)] * 25]
    return "\n".join(lines)


TEXTS = {
    "100000 columns.csv": lambda: _wide("c{}", 100_000),
    "10000 columns.csv": lambda: _wide("q{}_deg_s_x_y", 10_000),
    "a column whose name is long.csv": lambda: "time,q_" + "a_1_" * 200_000 + ",tau_joint_1\n" + _ROWS,
    "a line of quotes.csv": lambda: _HEAD + "\n" + '"' * 9_000_000 + "\n" + _ROWS,
    "a cell of 9 MB.csv": lambda: _HEAD + "\n" + "1" * 9_000_000 + ",0,0\n" + _ROWS,
    "a cell of 9 MB in the last line.csv": lambda: _HEAD + "\n" + _ROWS * 10 + "1" * 9_000_000 + ",0,0\n",
    "one line of blanks.csv": lambda: "1 " * 4_500_000,
    "lines without end.csv": lambda: _HEAD + "\n" + _ROWS + "\n" * 9_000_000 + "1,2,3",
    "short lines of commas.csv": lambda: "a,b\n" + "1,1\n" * 2_200_000,
    "a column of times without digits.csv": lambda: (
        "time,x\n" + "".join(f"2026-01-01T00:00:{row:02d}.²,1\n" for row in range(30))
    ),
    "times before time.csv": lambda: (
        "time,q_joint_1\n" + "".join(f"0001-01-01T00:00:{row:02d}+14:00,1\n" for row in range(30))
    ),
}
for _name, _text in TEXTS.items():
    FILES[_name] = lambda path, text=_text: path.write_text(text())  # type: ignore[misc]


def _workbook(path: Path, sheet: Iterator[bytes] | bytes, **parts: Iterator[bytes] | bytes) -> None:
    kinds = {"sheet1": "worksheet", "sharedStrings": "sharedStrings", "styles": "styles"}
    places = {"sheet1": "worksheets/sheet1.xml", "sharedStrings": "sharedStrings.xml", "styles": "styles.xml"}
    written = {"sheet1": sheet, **parts}
    types = "".join(
        f'<Override PartName="/xl/{places[name]}" '
        f'ContentType="application/vnd.openxmlformats-officedocument.spreadsheetml.{kinds[name]}+xml"/>'
        for name in written
    )
    links = "".join(
        f'<Relationship Id="{name}" Type="{_OFFICE}/{kinds[name]}" Target="{places[name]}"/>' for name in written
    )
    plain = {
        "[Content_Types].xml": f'<Types xmlns="{_PACKAGE}/content-types">'
        '<Default Extension="rels" ContentType="application/vnd.openxmlformats-package.relationships+xml"/>'
        '<Override PartName="/xl/workbook.xml" '
        'ContentType="application/vnd.openxmlformats-officedocument.spreadsheetml.sheet.main+xml"/>'
        f"{types}</Types>",
        "_rels/.rels": f'<Relationships xmlns="{_PACKAGE}/relationships"><Relationship Id="r" '
        f'Type="{_OFFICE}/officeDocument" Target="xl/workbook.xml"/></Relationships>',
        "xl/workbook.xml": f'<workbook xmlns="{_SHEET}" xmlns:r="{_OFFICE}"><sheets>'
        '<sheet name="log" sheetId="1" r:id="sheet1"/></sheets></workbook>',
        "xl/_rels/workbook.xml.rels": f'<Relationships xmlns="{_PACKAGE}/relationships">{links}</Relationships>',
    }
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED, compresslevel=6) as packed:
        for name, text in plain.items():
            packed.writestr(name, text)
        for name, content in written.items():
            with packed.open(f"xl/{places[name]}", "w") as part:
                for piece in [content] if isinstance(content, bytes) else content:
                    part.write(piece)


def _sheet(rows: bytes, times: int = 1, before: bytes = b"", after: bytes = b"") -> Iterator[bytes]:
    yield f'<worksheet xmlns="{_SHEET}">'.encode() + before + b"<sheetData>"
    many = max(1, 100_000 // max(1, len(rows)))
    for _ in range(times // many):
        yield rows * many
    yield rows * (times % many) + b"</sheetData>" + after + b"</worksheet>"


def _part(tag: str, inside: bytes, times: int) -> Iterator[bytes]:
    yield f'<{tag} xmlns="{_SHEET}">'.encode()
    many = max(1, 100_000 // max(1, len(inside)))
    for _ in range(times // many):
        yield inside * many
    yield f"</{tag}>".encode()


SHEETS = {
    "a row far below.xlsx": lambda: _sheet(b'<row r="2000000000"><c r="A2000000000"><v>1</v></c></row>'),
    "many rows.xlsx": lambda: _sheet(b"<row/>", 15_000_000),
    "a row of many cells.xlsx": lambda: _sheet(b"<row>" + b"<c/>" * 100_000 + b"</row>"),
    "cells far to the right.xlsx": lambda: _sheet(b'<row><c r="ZZZ1"><v>1</v></c></row>', 1000),
    "many cells.xlsx": lambda: _sheet(b"<row>" + b"<c><v>1</v></c>" * 60 + b"</row>", 100_000),
    "deep XML.xlsx": lambda: _sheet(b"<row>" + b"<c>" * 200 + b"</c>" * 200 + b"</row>"),
    "many columns described.xlsx": lambda: _sheet(
        b"<row/>", before=b"<cols>" + b'<col min="1" max="2"/>' * 2_000_000 + b"</cols>"
    ),
    "a number of many digits.xlsx": lambda: _sheet(b"<row><c><v>" + b"9" * 5_000 + b"</v></c></row>"),
    "an integer of many digits.xlsx": lambda: _sheet(
        b"<row><c><v>1</v></c><c><v>" + b"9" * 1000 + b"</v></c></row>", 30
    ),
    "many attributes.xlsx": lambda: _sheet(b"<row " + b" ".join(b'a%d="1"' % k for k in range(200_000)) + b"/>"),
    "entities.xlsx": lambda: (
        entities(9, 10) + f'<worksheet xmlns="{_SHEET}"><sheetData>&e9;</sheetData></worksheet>'
    ).encode(),
}
for _name, _content in SHEETS.items():
    FILES[_name] = lambda path, content=_content: _workbook(path, content())  # type: ignore[misc]


@FILES.named("a bomb of shared strings.xlsx")
def _strings(path: Path) -> None:
    _workbook(path, _sheet(b"<row/>"), sharedStrings=_part("sst", b"<si/>", 2_000_000))


@FILES.named("one long shared string.xlsx")
def _string(path: Path) -> None:
    def text() -> Iterator[bytes]:
        yield f'<sst xmlns="{_SHEET}"><si><t>'.encode()
        for _ in range(800):
            yield b"x" * 100_000
        yield b"</t></si></sst>"

    _workbook(path, _sheet(b'<row><c t="s"><v>0</v></c></row>', 100), sharedStrings=text())


@FILES.named("a long shared string in many cells.xlsx")
def _shared(path: Path) -> None:
    strings = f'<sst xmlns="{_SHEET}"><si><t>{"x" * 1_000_000}</t></si></sst>'.encode()
    row = b'<row><c><v>1</v></c><c><v>1</v></c><c t="s"><v>0</v></c></row>'
    _workbook(path, _sheet(row, 50_000), sharedStrings=strings)


@FILES.named("many styles.xlsx")
def _styles(path: Path) -> None:
    def text() -> Iterator[bytes]:
        yield f'<styleSheet xmlns="{_SHEET}"><cellXfs>'.encode()
        for _ in range(100):
            yield b"<xf/>" * 10_000
        yield b"</cellXfs></styleSheet>"

    _workbook(path, _sheet(b"<row/>"), styles=text())


@FILES.named("a part that hides its size.xlsx")
def _hidden(path: Path) -> None:
    """The directory says 100 bytes of a part of many."""
    _workbook(path, _sheet(b"<row/>", 1_000_000))
    content = path.read_bytes()
    with zipfile.ZipFile(path) as packed:
        size = packed.getinfo("xl/worksheets/sheet1.xml").file_size
    path.write_bytes(content.replace(struct.pack("<L", size), struct.pack("<L", 100)))

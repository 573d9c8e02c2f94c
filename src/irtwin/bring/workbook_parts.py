"""The parts of a workbook's file, counted before openpyxl reads them: it holds a row whole, and all that is no row."""

from __future__ import annotations

import zipfile
from pathlib import Path
from typing import Any, NoReturn
from xml.parsers import expat

from irtwin.errors import InputError
from irtwin.input_file import Unpacking
from irtwin.signals.sources.source import MOST_COLUMNS

_MOST_BYTES = 1_000_000_000  # unpacked
_LONGEST_TAG = 1_000_000  # bytes
_DEEPEST = 100  # elements in elements
_PIECE = 1 << 16  # bytes
_BYTES = 20  # of an element: a cell and its value are 25 and more
_IN_A_ROW = 5 * MOST_COLUMNS  # elements: a cell with a formula, a value or a text of several parts
_OTHER = 8  # elements in rows that one elsewhere takes as much time as: a text, a style


def check_parts(path: Path) -> None:
    """Raise InputError where a file unpacks to more than openpyxl is to hold, BadZipFile where it is no archive."""
    unpacking = Unpacking(path, path.stat().st_size)
    most = min(unpacking.most, _MOST_BYTES) // _BYTES
    with zipfile.ZipFile(path) as packed:
        for part in packed.infolist():
            unpacking.take(part.file_size, part.filename[:100], "save the log as CSV")
        if sum(part.file_size for part in packed.infolist()) > _MOST_BYTES:
            raise InputError(f"{path}: is larger than {_MOST_BYTES // 1_000_000} MB unpacked; save the log as CSV")
        for part in packed.infolist():
            count = _Count(path, part.filename[:100], most)
            with packed.open(part) as content:
                count.read(content)
            most = count.left


class _Count:
    """The elements of a part in XML, counted as they pass; `left`: how many more the file may have."""

    def __init__(self, path: Path, part: str, left: int) -> None:
        self.left = left
        self._path, self._part = path, part
        self._row, self._in_row, self._depth, self._row_depth = 0, 0, 0, 0
        self._parser = expat.ParserCreate()
        self._parser.ordered_attributes = True  # a list takes less than a dict
        self._parser.StartElementHandler = self._start
        self._parser.EndElementHandler = self._end
        self._parser.StartDoctypeDeclHandler = self._doctype

    def read(self, content: Any) -> None:
        """Read a part to its end, or to where it is no XML; what that means is openpyxl's to say."""
        taken = 0
        while piece := content.read(_PIECE):
            taken += len(piece)
            try:
                self._parser.Parse(piece)
            except expat.ExpatError:
                return
            if taken - self._parser.CurrentByteIndex > _LONGEST_TAG:
                self._refuse(f"a tag of more than {_LONGEST_TAG // 1_000_000} MB")

    def _start(self, name: str, attributes: list[str]) -> None:
        self._depth += 1
        if not self._row_depth and name.rpartition(":")[2] == "row":
            self._row, self._in_row, self._row_depth = self._row + 1, 0, self._depth
        self.left -= 1 if self._row_depth else _OTHER
        self._in_row += 1
        if self._row_depth and self._in_row > _IN_A_ROW:
            self._refuse(f"more than {MOST_COLUMNS:,} cells in row {self._row}")
        if self.left < 0:
            self._refuse("more elements than a log of this size has")
        if self._depth > _DEEPEST:
            self._refuse(f"elements more than {_DEEPEST} deep")

    def _end(self, _: str) -> None:
        if self._depth == self._row_depth:
            self._row_depth = 0
        self._depth -= 1

    def _doctype(self, *_: object) -> None:
        self._refuse("a document type, which no workbook needs")

    def _refuse(self, obstacle: str) -> NoReturn:
        raise InputError(f"{self._path}: {self._part} has {obstacle}; save the log as CSV")

"""Parquet files, opened and read within bounds: by their footer, and by the headers of their pages; runs as such."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, BinaryIO, ClassVar

import pyarrow as pa
import pyarrow.parquet
from pyarrow.parquet import ColumnChunkMetaData, ParquetFile

from irtwin.errors import InputError, first_line
from irtwin.input_file import Unpacking, check_file
from irtwin.signals.sources.source import LONGEST_NAME, Source, check_names, check_values

_BYTES = 8  # of a value that is read
_PAGE = 1000  # bytes that a page counts for beside what it holds: pages without any would take time without end
_REMEDY = "leave the column out, or cut the log into several"
_TRUE, _FALSE, _BYTE, _WHOLE, _DOUBLE, _BINARY, _STRUCT = 1, 2, 3, (4, 5, 6), 7, 8, 12  # of Thrift's compact protocol
_PAGE_SIZE, _PACKED_SIZE, _PAGES_OF_VALUES = 2, 3, (5, 8)  # fields of a page's header


@contextmanager
def open_parquet(path: Path) -> Iterator[ParquetFile]:
    """Give a file whose columns each have one short name. Raises InputError as long as it is open: it is read then."""
    check_file(path)
    try:
        with ParquetFile(path) as file:
            check_names(path, file.schema_arrow.names)
            yield file
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({first_line(error)}); export the run again") from error
    except (pa.ArrowException, UnicodeDecodeError) as error:
        raise InputError(f"{path}: not a readable Parquet file ({first_line(error)}); export the run again") from error


def count_rows(file: ParquetFile) -> int:
    """Return how many rows a file has, by its footer or by its groups, whichever says more."""
    groups = (file.metadata.row_group(group) for group in range(file.num_row_groups))
    return max(int(file.metadata.num_rows), sum(int(group.num_rows) for group in groups))


def read_columns(path: Path, file: ParquetFile, columns: Sequence[str]) -> pa.Table:
    """Return columns that have one value a row; texts stay in dictionaries, where a long one stands once.

    Raises InputError where they are more than the memory is to hold: by the count of their values, or by what their
    pages, or the values that these repeat, unpack to.
    """
    rows = count_rows(file)
    check_values(path, rows, len(columns))
    values, pages = (Unpacking(path, path.stat().st_size) for _ in range(2))
    # a page may repeat a value at no cost
    values.take(rows * len(columns) * _BYTES, f"{rows} samples of {len(columns)} columns", "cut it into several")
    parts, schema = file.schema, file.schema_arrow  # each is made anew when it is asked for
    leaves = [parts.column(place).path for place in range(len(parts))]  # of nested columns, their parts
    if repeated := [name for name, count in Counter(leaves).items() if count > 1]:
        raise InputError(f"{path}: column {repeated[0][:LONGEST_NAME]} occurs twice; keep one")
    places = {name: place for place, name in enumerate(leaves)}
    groups = [file.metadata.row_group(group) for group in range(file.num_row_groups)]
    with path.open("rb") as content:
        for name in columns:
            for group in groups:
                for size in _page_sizes(content, group.column(places[name])):
                    pages.take(size, f"column {name}", _REMEDY)
    texts = [name for name in columns if is_text(schema.field(name).type)]
    with ParquetFile(path, metadata=file.metadata, read_dictionary=texts) as again:
        return again.read(columns=list(columns))


def is_text(kind: pa.DataType) -> bool:
    """Whether a type is of texts, as they are or in a dictionary."""
    kind = kind.value_type if pa.types.is_dictionary(kind) else kind
    return bool(pa.types.is_string(kind) or pa.types.is_large_string(kind) or pa.types.is_string_view(kind))


def _page_sizes(file: BinaryIO, chunk: ColumnChunkMetaData) -> Iterator[int]:
    """Yield what each page of a column unpacks to, by its own header: the reader believes that, not the footer."""
    place = min(chunk.data_page_offset, chunk.dictionary_page_offset or chunk.data_page_offset)
    end, left = place + chunk.total_compressed_size, chunk.num_values
    while left > 0 and place < end:
        file.seek(place)
        header = _struct(file, 0)
        size, packed = header.get(_PAGE_SIZE, -1), header.get(_PACKED_SIZE, -1)
        if size < 0 or packed < 0:
            raise pa.ArrowInvalid("a page without a size")
        yield size + _PAGE
        place = file.tell() + packed
        left -= sum(header[kind].get(1, 0) for kind in _PAGES_OF_VALUES if kind in header)


def _struct(file: BinaryIO, depth: int) -> dict[int, Any]:
    """Return a struct of Thrift's compact protocol by the numbers of its fields; of texts, nothing."""
    if depth > 4:
        raise pa.ArrowInvalid("a page's header is nested too deeply")
    fields: dict[int, Any] = {}
    number = 0
    while head := _byte(file):
        number = number + (head >> 4) if head >> 4 else _zigzag(file)
        kind = head & 15
        if kind == _STRUCT:
            fields[number] = _struct(file, depth + 1)
        elif kind in _WHOLE:
            fields[number] = _zigzag(file)
        elif kind not in (_TRUE, _FALSE):
            _pass(file, kind)
    return fields


def _pass(file: BinaryIO, kind: int) -> None:
    if kind not in (_BYTE, _DOUBLE, _BINARY):
        raise pa.ArrowInvalid("a page's header has a field of an unknown type")
    file.seek({_BYTE: 1, _DOUBLE: 8}.get(kind) or _varint(file), 1)


def _zigzag(file: BinaryIO) -> int:
    value = _varint(file)
    return (value >> 1) ^ -(value & 1)


def _varint(file: BinaryIO) -> int:
    value = 0
    for shift in range(0, 70, 7):
        byte = _byte(file)
        value |= (byte & 127) << shift
        if byte < 128:
            return value
    raise pa.ArrowInvalid("a page's header has a number of too many digits")


def _byte(file: BinaryIO) -> int:
    read = file.read(1)
    if not read:
        raise pa.ArrowInvalid("a page's header is cut off")
    return read[0]


class ParquetSource(Source):
    """A Parquet file, read once its own account of itself promises numbers that fit into the memory."""

    suffixes: ClassVar[tuple[str, ...]] = (".parquet",)

    def columns(self) -> Sequence[str]:
        """Return the names in the file's schema."""
        with open_parquet(self.path) as file:
            return list(file.schema_arrow.names)

    def read(self, columns: Sequence[str], *, repair: bool) -> tuple[pa.Table, list[str]]:
        """Return some of the columns, of numbers; there is nothing to repair."""
        with open_parquet(self.path) as file:
            self.check_size(count_rows(file), len(columns))
            for name in columns:
                kind = file.schema_arrow.field(name).type
                if not (pa.types.is_floating(kind) or pa.types.is_integer(kind) or pa.types.is_decimal(kind)):
                    raise InputError(
                        f"{self.path}: column {name} is of type {str(kind)[:60]}; export it as numbers, in SI units"
                    )
            return read_columns(self.path, file, columns), []

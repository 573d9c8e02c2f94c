"""Runs as Parquet files."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import ClassVar

import pyarrow as pa
import pyarrow.parquet

from irtwin.errors import InputError
from irtwin.input_file import check_file
from irtwin.signals.sources.source import Source, first_line


class ParquetSource(Source):
    """A Parquet file, read once its own account of itself promises numbers that fit into the memory."""

    suffixes: ClassVar[tuple[str, ...]] = (".parquet",)

    def columns(self) -> Sequence[str]:
        """Return the names in the file's schema."""
        with self._opened() as file:
            return list(file.schema_arrow.names)

    def read(self, columns: Sequence[str], *, repair: bool) -> tuple[pa.Table, list[str]]:
        """Return some of the columns, of numbers; there is nothing to repair."""
        with self._opened() as file:
            groups = range(file.num_row_groups)
            rows = max(file.metadata.num_rows, sum(file.metadata.row_group(group).num_rows for group in groups))
            self.check_size(rows, len(columns))
            for name in columns:
                kind = file.schema_arrow.field(name).type
                if not (pa.types.is_floating(kind) or pa.types.is_integer(kind) or pa.types.is_decimal(kind)):
                    raise InputError(
                        f"{self.path}: column {name} is of type {str(kind)[:60]}; export it as numbers, in SI units"
                    )
            return file.read(columns=list(columns)), []

    @contextmanager
    def _opened(self) -> Iterator[pyarrow.parquet.ParquetFile]:
        check_file(self.path)
        try:
            with pyarrow.parquet.ParquetFile(self.path) as file:
                yield file
        except OSError as error:
            raise InputError(f"{self.path}: cannot be read ({first_line(error)}); export the run again") from error
        except (pa.ArrowException, UnicodeDecodeError) as error:
            raise InputError(
                f"{self.path}: not a readable Parquet file ({first_line(error)}); export the run again"
            ) from error

"""Runs as Parquet files."""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar

import pyarrow as pa

from irtwin.errors import InputError
from irtwin.signals.sources.parquet_file import count_rows, open_parquet, read_columns
from irtwin.signals.sources.source import Source


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

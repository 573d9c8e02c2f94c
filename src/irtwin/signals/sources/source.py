"""What a log format has to do so that runs can be read from it."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import ClassVar

import pyarrow as pa

from irtwin.errors import InputError
from irtwin.robot.description import Robot

MOST_COLUMNS = 10_000
MOST_VALUES = 125_000_000  # of the columns that are read: 1 GB
LONGEST_NAME = 500  # characters of a column's name
LONGEST_LINE = 1_000_000  # bytes of a line of text


class Source(ABC):
    """A file with a run's samples. A format is a subclass, and the end of its files' names.

    `columns` are those of `docs/LOG_FORMAT.md`, by which the joints of `robot` are named, and others that nobody asks
    for. A format of several streams, each with a clock of its own, brings them onto one `time` in `read`.
    What is checked of the samples is the same for all formats, and not done here. `topics`: what [topics] of
    dataset.toml says, for formats of several streams.
    """

    suffixes: ClassVar[tuple[str, ...]]  # in small letters, as ".csv"; "/" of a folder
    counted: ClassVar[str] = "row"  # what a message calls a sample's place in the file
    first: ClassVar[int] = 0  # place of the first sample

    def __init__(self, path: Path, robot: Robot, topics: Mapping[str, str] | None = None) -> None:
        self.path = path
        self.robot = robot
        self.topics = topics or {}

    @abstractmethod
    def columns(self) -> Sequence[str]:
        """Return the names of the file's columns. Raises InputError where it cannot be read."""

    @abstractmethod
    def read(self, columns: Sequence[str], *, repair: bool) -> tuple[pa.Table, list[str]]:
        """Return some of the columns, and with `repair` a line for each kind of sample that was dropped.

        A column is of numbers, or of text that may be numbers. Raises InputError where the file cannot be read, or is
        beyond `check_size`.
        """

    def place(self, sample: int) -> str:
        """Return what a message calls a sample, counted from 0."""
        return f"{self.counted} {sample + self.first}"

    def check_size(self, rows: int, columns: int) -> None:
        """Raise InputError where there is no sample, or there are more values than the memory is to hold."""
        if rows == 0:
            raise InputError(f"{self.path}: has no sample; an empty run cannot be used")
        check_values(self.path, rows, columns)


def check_names(path: Path, names: Sequence[str]) -> None:
    """Raise InputError where columns are too many, two have one name, or one has no name but a text."""
    if len(names) > MOST_COLUMNS:
        raise InputError(f"{path}: {len(names)} columns; a run has at most {MOST_COLUMNS}: leave out what nobody needs")
    long = next((number for number, name in enumerate(names, start=1) if len(name) > LONGEST_NAME), None)
    if long is not None:
        raise InputError(
            f"{path}: the name of column {long}, {names[long - 1][:40]!r}..., has {len(names[long - 1])} characters; "
            f"give it one of at most {LONGEST_NAME}"
        )
    repeated = [name for name, count in Counter(names).items() if count > 1]
    if repeated:
        raise InputError(f"{path}: column {repeated[0]} occurs twice; keep one, or give each a name of its own")


def check_values(path: Path, rows: int, columns: int) -> None:
    """Raise InputError where there are more values than the memory is to hold."""
    if rows * columns > MOST_VALUES:
        raise InputError(
            f"{path}: {rows} samples of {columns} columns; a run may have {MOST_VALUES:,} values: cut it into several"
        )

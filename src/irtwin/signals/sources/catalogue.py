"""Every log format that runs are read from, those of other installed packages among them."""

from __future__ import annotations

from functools import cache
from importlib.metadata import entry_points
from pathlib import Path

from irtwin.errors import InputError
from irtwin.robot.description import Robot
from irtwin.signals.sources.csv_source import CsvSource
from irtwin.signals.sources.parquet_source import ParquetSource
from irtwin.signals.sources.source import Source

GROUP = "irtwin.sources"

_OWN: tuple[type[Source], ...] = (CsvSource, ParquetSource)


def source_of(path: Path, robot: Robot) -> Source:
    """Return a run's file as a source, by the end of its name. Raises InputError where no format ends so."""
    known = sources()
    kind = known.get(path.suffix.lower())
    if kind is None:
        raise InputError(f"{path}: a run is a {' or '.join(known)} file; convert it to one of these")
    return kind(path, robot)


def sources() -> dict[str, type[Source]]:
    """Return every format, by the end of its files' names.

    An installed package adds its own: an entry point of the group `irtwin.sources` that names a class. ValueError where
    two take the same files.
    """
    found: dict[str, type[Source]] = {}
    for kind in (*_OWN, *_registered()):
        for suffix in kind.suffixes:
            if suffix in found:
                raise ValueError(f"two sources take {suffix} files: {found[suffix]} and {kind}")
            found[suffix] = kind
    return found


@cache
def _registered() -> tuple[type[Source], ...]:
    points = sorted(entry_points(group=GROUP), key=lambda point: point.name)
    return tuple(point.load() for point in points)

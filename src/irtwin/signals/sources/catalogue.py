"""Every log format that runs are read from, those of other installed packages among them."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from importlib.metadata import entry_points
from pathlib import Path

from irtwin.errors import InputError
from irtwin.robot.description import Robot
from irtwin.signals.sources.bag_source import BagSource
from irtwin.signals.sources.csv_source import CsvSource
from irtwin.signals.sources.parquet_file import ParquetSource
from irtwin.signals.sources.source import Source

GROUP = "irtwin.sources"

_OWN: tuple[type[Source], ...] = (CsvSource, ParquetSource, BagSource)


def source_of(path: Path, robot: Robot, topics: Mapping[str, str] | None = None) -> Source:
    """Return a run's file, or folder, as a source, by the end of its name. Raises InputError where no format ends so.

    topics: what [topics] of dataset.toml says.
    """
    known = sources()
    kind = known.get("/" if path.is_dir() else path.suffix.lower())
    if kind is None:
        ends = " or ".join(end for end in known if end != "/")
        raise InputError(f"{path}: a run is a {ends} file, or a ROS 2 bag's folder; convert it to one of these")
    return kind(path, robot, topics)


def sources() -> dict[str, type[Source]]:
    """Return every format, by the end of its files' names.

    An installed package adds its own: an entry point of the group `irtwin.sources` that names a class. ValueError where
    two take the same files.
    """
    by_ending: dict[str, type[Source]] = {}
    for kind in (*_OWN, *_registered()):
        for suffix in kind.suffixes:
            if suffix in by_ending:
                raise ValueError(f"two sources take {suffix} files: {by_ending[suffix]} and {kind}")
            by_ending[suffix] = kind
    return by_ending


def registered() -> set[str]:
    """Return the ends of files that installed packages read."""
    return {suffix for kind in _registered() for suffix in kind.suffixes}


@cache
def _registered() -> tuple[type[Source], ...]:
    points = sorted(entry_points(group=GROUP), key=lambda point: point.name)
    return tuple(point.load() for point in points)

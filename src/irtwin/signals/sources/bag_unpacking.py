"""What rosbags unpacks of a bag, counted: it takes a chunk whole, and as often as an index says."""

from __future__ import annotations

import bz2
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from typing import TYPE_CHECKING, Any

from irtwin.input_file import Unpacking

if TYPE_CHECKING:
    import apsw

_LARGEST_CHUNK = 256_000_000  # bytes; recorders take chunks of a MB or so
_RECORD = 128  # bytes that a record of ROS 1 counts for: its header is parsed field by field
_ENTRY = 8  # bytes that one of ROS 1's index counts for: it is held as an object
_LEAST = 10_000  # bytes of a text that SQLite is to take from a bag of fewer: questions are such texts, too
_STEPS = 10_000  # of SQLite's machine, of which a row takes some twenty, and counts as many bytes
_REMEDY = "record the run again, or keep its topics alone"


@contextmanager
def counted(unpacking: Unpacking) -> Iterator[None]:
    """Have rosbags count, as long as this lasts. InputError passes through it where a bag unpacks to too much."""
    import apsw
    from backports import zstd
    from lz4.frame import LZ4FrameDecompressor
    from rosbags.rosbag1 import reader as ros1
    from rosbags.rosbag2 import reader as ros2
    from rosbags.rosbag2 import storage_mcap as mcap
    from rosbags.rosbag2 import storage_sqlite3 as sqlite3

    plain, lz4 = _plain(unpacking), _inflating(LZ4FrameDecompressor, unpacking)
    changed = [
        (ros1, "decompressors", {"none": plain, "bz2": _inflating(bz2.BZ2Decompressor, unpacking), "lz4": lz4}),
        (mcap, "DECOMPRESSORS", {"": plain, "lz4": lz4, "zstd": _inflating(zstd.ZstdDecompressor, unpacking)}),
        (ros1, "Header", _header(ros1.Header, unpacking)),
        (ros1.Reader, "read_index_data", _index(ros1.Reader.read_index_data, unpacking)),
        # the quality of service is YAML of any length, and nobody asks for it here
        *((module, "parse_qos", lambda _: []) for module in (ros2, mcap, sqlite3)),
    ]
    limit = _database(unpacking)
    with ExitStack() as restoring:
        for place, name, value in changed:
            restoring.callback(setattr, place, name, getattr(place, name))
            setattr(place, name, value)
        restoring.callback(apsw.connection_hooks.remove, limit)
        apsw.connection_hooks.append(limit)
        yield


def _plain(unpacking: Unpacking) -> Callable[..., bytes]:
    def take(data: bytes, _: int = 0) -> bytes:
        unpacking.take(len(data), "a chunk, or one many times", _REMEDY)
        return data

    return take


def _inflating(kind: Any, unpacking: Unpacking) -> Callable[..., bytes]:
    take = _plain(unpacking)

    def inflate(data: bytes, size: int = _LARGEST_CHUNK) -> bytes:
        made = take(kind().decompress(data, min(size, _LARGEST_CHUNK, unpacking.left) + 1))
        if len(made) > _LARGEST_CHUNK:
            raise ValueError(f"a chunk of more than {_LARGEST_CHUNK // 1_000_000} MB")
        return made

    return inflate


def _header(plain: Any, unpacking: Unpacking) -> Any:
    """Return the class of ROS 1's headers, counting them: an index may lead to the same ones again and again."""

    class Header(plain):  # type: ignore[misc]
        @classmethod
        def read(cls, *arguments: Any) -> Any:
            unpacking.take(_RECORD, "its index", _REMEDY)
            return super().read(*arguments)

    return Header


def _index(plain: Callable[..., None], unpacking: Unpacking) -> Callable[..., None]:
    def read(reader: Any, *arguments: Any) -> None:
        before = reader.bio.tell()
        plain(reader, *arguments)
        unpacking.take(_ENTRY * (reader.bio.tell() - before), "its index", _REMEDY)

    return read


def _database(unpacking: Unpacking) -> Callable[[apsw.Connection], None]:
    """Return what bounds a database that is opened: a table may be made of formulas, and have no end."""

    def step() -> bool:
        unpacking.take(_STEPS, "its database", _REMEDY)
        return False

    def limit(connection: apsw.Connection) -> None:
        import apsw

        connection.limit(apsw.SQLITE_LIMIT_LENGTH, max(_LEAST, unpacking.packed))
        connection.set_progress_handler(step, _STEPS)

    return limit

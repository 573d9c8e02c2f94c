"""Messages of ROS bags, by the package rosbags: ROS 1, ROS 2 (SQLite or MCAP), a folder or a file alone.

What that unpacks is counted: it takes a chunk whole, and as often as an index says.
"""

from __future__ import annotations

import bz2
import re
import struct
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from irtwin.errors import InputError
from irtwin.input_file import Unpacking, check_file, read_input

if TYPE_CHECKING:
    import apsw
    from rosbags.interfaces import Connection

JOINT_STATE = "sensor_msgs/msg/JointState"
NUMBERS = ("std_msgs/msg/Float64", "std_msgs/msg/Float32")
_LARGEST = 1_000_000_000  # bytes of a bag
_LARGEST_METADATA = 1_000_000  # bytes
_METADATA = "metadata.yaml"
_ALIAS = re.compile(r"(?:^|[\s\[{,:-])[&*]\w", re.MULTILINE)  # of YAML: a value that is taken again elsewhere
_COMPRESSED = re.compile(r"^\s*compression_mode:\s*[\"']?(file|message)\b", re.IGNORECASE | re.MULTILINE)
_DAMAGE = (
    *(AssertionError, AttributeError, EOFError, LookupError, MemoryError, OSError, OverflowError),
    *(RuntimeError, TypeError, ValueError, struct.error),
)  # what rosbags, which trusts its input, raises on bytes that are no bag
_LARGEST_CHUNK = 256_000_000  # bytes; recorders take chunks of a MB or so
_RECORD = 128  # bytes that a record of ROS 1 counts for: its header is parsed field by field
_ENTRY = 8  # bytes that one of ROS 1's index counts for: it is held as an object
_LEAST = 10_000  # bytes of a text that SQLite is to take from a bag of fewer: questions are such texts, too
_STEPS = 10_000  # of SQLite's machine, of which a row takes some twenty, and counts as many bytes
_REMEDY = "record the run again, or keep its topics alone"


@dataclass(frozen=True)
class Topic:
    """A topic of a bag with messages of one type."""

    name: str
    kind: str
    count: int


class BagFile:
    """A bag that is open to read."""

    def __init__(self, path: Path, reader: Any) -> None:
        from rosbags.typesys import Stores, get_typestore

        self.path = path
        self._reader = reader
        self._of_ros1 = path.suffix.lower() == ".bag"
        self._types = get_typestore(Stores.ROS1_NOETIC if self._of_ros1 else Stores.ROS2_HUMBLE)

    @property
    def topics(self) -> list[Topic]:
        """The topics that may hold a run's channels, in the order of their names."""
        counts: dict[tuple[str, str], int] = {}
        for connection in self._wanted():
            key = (connection.topic, connection.msgtype)
            counts[key] = counts.get(key, 0) + connection.msgcount
        return [Topic(*key, count) for key, count in sorted(counts.items())]

    def messages(self, topics: Sequence[str]) -> Iterator[tuple[str, int, Any]]:
        """Yield topic, time of recording (ns since 1970) and message of what the topics hold, in that order of time."""
        chosen = [connection for connection in self._wanted() if connection.topic in topics]
        parse = self._types.deserialize_ros1 if self._of_ros1 else self._types.deserialize_cdr
        for connection in chosen:
            self._check_type(connection)
        for connection, time, content in self._reader.messages(chosen) if chosen else ():
            yield connection.topic, time, parse(content, connection.msgtype)

    def _wanted(self) -> list[Connection]:
        return [one for one in self._reader.connections if one.msgtype in (JOINT_STATE, *NUMBERS)]

    def _check_type(self, connection: Connection) -> None:
        if self._of_ros1 and connection.digest != self._types.generate_msgdef(connection.msgtype)[1]:
            raise InputError(
                f"{self.path}: topic {connection.topic} has a {connection.msgtype} that is not ROS' own; convert it"
            )


@contextmanager
def open_bag(path: Path) -> Iterator[BagFile]:
    """Give a bag. Raises InputError where it cannot be read, as long as it is open: it is read on the way."""
    unpacking = Unpacking(path, _size(path))
    try:
        import apsw
        from rosbags.rosbag1 import Reader as Reader1
        from rosbags.rosbag1 import ReaderError as ReaderError1
        from rosbags.rosbag2 import Reader as Reader2
        from rosbags.rosbag2 import ReaderError as ReaderError2
        from rosbags.serde import SerdeError
    except ImportError as error:
        raise InputError('bags need the package rosbags; install it with: pip install "irtwin[ros]"') from error
    kind = Reader1 if path.suffix.lower() == ".bag" else Reader2
    try:
        with _counted(unpacking), kind(path) as reader:
            yield BagFile(path, reader)
    except (ReaderError1, ReaderError2, SerdeError, apsw.Error, *_DAMAGE) as error:
        message = f"{type(error).__name__}: {error}".strip().partition("\n")[0][:200]
        raise InputError(f"{path}: not a readable bag, or damaged ({message}); record or convert it again") from error


def _size(path: Path) -> int:
    """Return how many bytes a bag has. Raises InputError where it is none that can be read."""
    size = _folder_size(path) if path.is_dir() else check_file(path)
    if size > _LARGEST:
        raise InputError(f"{path}: is larger than {_LARGEST // 1_000_000} MB; keep the topics of the run alone")
    return size


def _folder_size(path: Path) -> int:
    metadata = path / _METADATA
    if not metadata.is_file():
        raise InputError(f"{path}: is a folder without {_METADATA}, so no bag of ROS 2; name the bag's folder")
    text = read_input(metadata, _LARGEST_METADATA).decode(errors="replace")
    if (mode := _COMPRESSED.search(text)) is not None:
        raise InputError(f"{path}: its {mode[1].lower()}s are compressed one by one; unpack it with `ros2 bag convert`")
    if _ALIAS.search(text):
        raise InputError(f"{metadata}: repeats a part of itself, as no recorder writes it; record the run again")
    return sum(check_file(file) for file in path.iterdir() if not file.is_dir())


@contextmanager
def _counted(unpacking: Unpacking) -> Iterator[None]:
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

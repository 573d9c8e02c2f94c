"""Messages of ROS bags, by the package rosbags: ROS 1, ROS 2 (SQLite or MCAP), a folder or a file alone."""

from __future__ import annotations

import re
import struct
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from irtwin.errors import InputError
from irtwin.input_file import Unpacking, check_file, read_input
from irtwin.signals.sources.bag_unpacking import counted

if TYPE_CHECKING:
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
        return [connection for connection in self._reader.connections if connection.msgtype in (JOINT_STATE, *NUMBERS)]

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
        with counted(unpacking), kind(path) as reader:
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

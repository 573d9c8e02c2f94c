"""Bags of ROS 2 and ROS 1 that ask their reader for much."""

from __future__ import annotations

import bz2
import sqlite3
import struct
from contextlib import closing
from pathlib import Path

import pyarrow as pa
from tests.hostile.hostile_files import Files

FILES = Files()


def _joint_state(name: bytes = b"joint_1") -> bytes:
    """A JointState in CDR, of one joint without speed and torque."""
    text = name + b"\0"
    names = struct.pack("<L", 1) + struct.pack("<L", len(text)) + text
    body = struct.pack("<lL", 1, 0) + struct.pack("<L", 1) + b"\0"
    body += bytes(-len(body) % 4) + names
    body += bytes(-len(body) % 4) + struct.pack("<L", 1)
    body += bytes(-len(body) % 8) + struct.pack("<d", 0.1)
    return b"\0\1\0\0" + body + struct.pack("<LL", 0, 0)


def _text(value: bytes) -> bytes:
    return struct.pack("<L", len(value)) + value


def _record(kind: int, body: bytes) -> bytes:
    return bytes([kind]) + struct.pack("<Q", len(body)) + body


def _message(time: int) -> bytes:
    return _record(5, struct.pack("<HLQQ", 1, 0, time, time) + _joint_state())


def _mcap(path: Path, chunk: bytes, size: int, kind: bytes = b"", times: int = 1, metadata: bytes = b"") -> None:
    """An MCAP file with a chunk, which its index names so many times."""
    head = b"\x89MCAP0\r\n" + _record(1, _text(b"ros2") + _text(b""))
    packed = _record(6, struct.pack("<QQQL", 1, 100, size, 0) + _text(kind) + struct.pack("<Q", len(chunk)) + chunk)
    body = struct.pack("<QQQQ", 1, 100, len(head), len(packed))
    body += struct.pack("<LHQQ", 10, 1, len(head) + len(packed), 15 + 16 * 100)
    index = _record(8, body + _text(kind) + struct.pack("<QQ", len(chunk), size)) * times
    topic = _record(3, struct.pack("<H", 1) + _text(b"sensor_msgs/msg/JointState") + _text(b"ros2msg") + _text(b""))
    topic += _record(4, struct.pack("<HH", 1, 1) + _text(b"/joint_states") + _text(b"cdr") + _text(metadata))
    counts = struct.pack("<QHLLLLQQ", 100, 1, 1, 0, 0, times, 1, 100) + struct.pack("<LHQ", 10, 1, 100)
    summary = topic + index + _record(11, counts)
    foot = struct.pack("<QQL", len(head) + len(packed), 0, 0)
    path.write_bytes(head + packed + summary + _record(2, foot) + b"\x89MCAP0\r\n")


@FILES.named("a chunk of zeros.mcap")
def _zero_chunk(path: Path) -> None:
    size = 70_000_000
    _mcap(path, pa.compress(bytes(size), codec="zstd", asbytes=True), size, b"zstd")


@FILES.named("a chunk of 4 GB by its own account.mcap")
def _huge_chunk(path: Path) -> None:
    _mcap(path, pa.compress(bytes(1_000_000), codec="zstd", asbytes=True), 4_000_000_000, b"zstd")


@FILES.named("a chunk that is named 50000 times.mcap")
def _same_chunk(path: Path) -> None:
    chunk = _message(1) + _record(0x80, bytes(4_000_000))
    _mcap(path, chunk, len(chunk), times=50_000)


@FILES.named("many messages that pack well.mcap")
def _messages(path: Path) -> None:
    chunk = b"".join(_message(time) for time in range(500_000))
    _mcap(path, pa.compress(chunk, codec="zstd", asbytes=True), len(chunk), b"zstd")


@FILES.named("a long quality of service.mcap")
def _service(path: Path) -> None:
    service = b"- {history: 1}\n" * 30_000
    _mcap(path, _message(1), len(_message(1)), metadata=_text(b"offered_qos_profiles") + _text(service))


def _database(path: Path, *statements: str) -> None:
    """A bag in SQLite with messages of 30 joint states, changed by statements."""
    with closing(sqlite3.connect(path)) as base:
        base.execute(
            "CREATE TABLE topics(id INTEGER PRIMARY KEY, name, type, serialization_format, offered_qos_profiles, "
            "type_description_hash)"
        )
        base.execute("CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id, timestamp, data)")
        base.execute("INSERT INTO topics VALUES(1, '/joint_states', 'sensor_msgs/msg/JointState', 'cdr', '', '')")
        rows = [(time, time * 10**7, _joint_state()) for time in range(1, 31)]
        base.executemany("INSERT INTO messages VALUES(?, 1, ?, ?)", rows)
        for statement in statements:
            base.execute(statement)
        base.commit()


@FILES.named("values made by a formula.db3")
def _formula(path: Path) -> None:
    made = "CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id, timestamp, data AS (zeroblob(900000000)))"
    rows = "WITH RECURSIVE n(k) AS (SELECT 1 UNION ALL SELECT k + 1 FROM n WHERE k < 100) SELECT k, 1, k FROM n"
    _database(path, "DROP TABLE messages", made, f"INSERT INTO messages {rows}")


@FILES.named("a table without end.db3")
def _endless(path: Path) -> None:
    endless = "WITH RECURSIVE n(k) AS (SELECT 1 UNION ALL SELECT k + 1 FROM n) SELECT k, '', '', '', '' FROM n"
    _database(
        path,
        "CREATE TABLE schema(schema_version)",
        "INSERT INTO schema VALUES(4)",
        "CREATE VIEW message_definitions(id, topic_type, encoding, encoded_message_definition, "
        "type_description_hash) AS " + endless,
    )


@FILES.named("a metadata of aliases")
def _aliases(path: Path) -> None:
    path.mkdir(exist_ok=True)
    _database(path / "run.db3")
    bomb = "".join(f"b{n}: &b{n} [{', '.join([f'*b{n - 1}'] * 10) if n else 'x'}]\n" for n in range(12))
    (path / "metadata.yaml").write_text(
        bomb
        + "rosbag2_bagfile_information:\n  version: 5\n  storage_identifier: sqlite3\n  relative_file_paths: [run.db3]"
        "\n  compression_mode: x\n  compression_format: *b11\n"
    )


@FILES.named("a metadata of 9 MB")
def _metadata(path: Path) -> None:
    path.mkdir(exist_ok=True)
    _database(path / "run.db3")
    (path / "metadata.yaml").write_text("rosbag2_bagfile_information:\n" + "  - {a: 1}\n" * 800_000)


def _ros1(fields: dict[str, bytes], data: bytes) -> bytes:
    header = b"".join(_text(name.encode() + b"=" + value) for name, value in fields.items())
    return _text(header) + _text(data)


def _long(value: int) -> bytes:
    return struct.pack("<L", value)


_TOPIC = _ros1(
    {"op": b"\x07", "conn": _long(0), "topic": b"/joint_states"},
    b"".join(
        _text(field)
        for field in (
            b"topic=/joint_states",
            b"type=sensor_msgs/JointState",
            b"md5sum=3066dcd76a6cfaef579bd0f34173e9fd",
            b"message_definition=",
        )
    ),
)
_STATE = _long(0) + struct.pack("<LL", 1, 0) + _text(b"") + _long(1) + _text(b"joint_1")
_MESSAGE = _ros1(
    {"op": b"\x02", "conn": _long(0), "time": struct.pack("<LL", 1, 0)},
    _STATE + _long(1) + struct.pack("<d", 0.1) + _long(0) + _long(0),
)


def _bag(path: Path, chunks: list[tuple[bytes, list[int]]], kind: bytes = b"none", times: int = 1) -> None:
    """A bag with chunks, each with the places of messages in it; the index names each chunk so many times."""
    head = b"#ROSBAG V2.0\n"
    length = 4096 + 8
    content, infos = b"", b""
    for packed, places in chunks:
        place = len(head) + length + len(content)
        content += _ros1({"op": b"\x05", "compression": kind, "size": _long(0)}, packed)
        entries = b"".join(struct.pack("<LLL", 1, 0, one) for one in places)
        content += _ros1({"op": b"\x04", "ver": _long(1), "conn": _long(0), "count": _long(len(places))}, entries)
        times_said = {"start_time": struct.pack("<LL", 1, 0), "end_time": struct.pack("<LL", 1, 0)}
        fields = {"op": b"\x06", "ver": _long(1), "chunk_pos": struct.pack("<Q", place), **times_said}
        infos += _ros1({**fields, "count": _long(1)}, _long(0) + _long(len(places)))
    fields = {
        "op": b"\x03",
        "index_pos": struct.pack("<Q", len(head) + length + len(content)),
        "conn_count": _long(1),
        "chunk_count": _long(len(chunks) * times),
    }
    size = len(b"".join(_text(name.encode() + b"=" + value) for name, value in fields.items()))
    path.write_bytes(head + _ros1(fields, b" " * (4096 - size)) + content + _TOPIC + infos * times)


@FILES.named("a chunk of zeros.bag")
def _zeros1(path: Path) -> None:
    _bag(path, [(bz2.compress(bytes(70_000_000)), [0])], b"bz2")


@FILES.named("chunks that take turns.bag")
def _turns(path: Path) -> None:
    chunk = _MESSAGE + bytes(4_000_000)
    _bag(path, [(chunk, [0] * 40_000), (chunk, [0] * 40_000)])


@FILES.named("an index that is named 50000 times.bag")
def _named(path: Path) -> None:
    _bag(path, [(_MESSAGE, [0] * 200_000)], times=50_000)


@FILES.named("many topics before each message.bag")
def _before(path: Path) -> None:
    _bag(path, [(_TOPIC * 30_000 + _MESSAGE, [0] * 200_000)])

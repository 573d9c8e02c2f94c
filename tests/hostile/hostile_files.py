"""Small files that ask their reader for much: a name each, and a function that writes it.

`FILES` are logs; the end of a name is that of the file. Each is below 10 MB, a little beyond what is allowed, and made
in a moment.
"""

from __future__ import annotations

import struct
import zipfile
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

FILES: dict[str, Callable[[Path], None]] = {}
_SHEET = "http://schemas.openxmlformats.org/spreadsheetml/2006/main"
_PACKAGE = "http://schemas.openxmlformats.org/package/2006"
_OFFICE = "http://schemas.openxmlformats.org/officeDocument/2006/relationships"
_HEAD = "time,q_joint_1,tau_joint_1"
_ROWS = "".join(f"{row / 100},0.1,1\n" for row in range(30))


def _file(name: str) -> Callable[[Callable[[Path], None]], Callable[[Path], None]]:
    def keep(write: Callable[[Path], None]) -> Callable[[Path], None]:
        FILES[name] = write
        return write

    return keep


# text


@_file("100000 columns.csv")
def _columns(path: Path) -> None:
    count = 100_000
    lines = [",".join(f"c{k}" for k in range(count)), *[",".join(["1"] * count)] * 25]
    path.write_text("\n".join(lines))


@_file("10000 columns.csv")
def _some_columns(path: Path) -> None:
    count = 10_000
    lines = [",".join(f"q{k}_deg_s_x_y" for k in range(count)), *[",".join(["1"] * count)] * 25]
    path.write_text("\n".join(lines))


@_file("a column whose name is long.csv")
def _long_name(path: Path) -> None:
    path.write_text("time,q_" + "a_1_" * 200_000 + ",tau_joint_1\n" + _ROWS)


@_file("a line of quotes.csv")
def _quotes(path: Path) -> None:
    path.write_text(_HEAD + "\n" + '"' * 9_000_000 + "\n" + _ROWS)


@_file("a cell of 9 MB.csv")
def _long_cell(path: Path) -> None:
    path.write_text(_HEAD + "\n" + "1" * 9_000_000 + ",0,0\n" + _ROWS)


@_file("a cell of 9 MB in the last line.csv")
def _last_cell(path: Path) -> None:
    path.write_text(_HEAD + "\n" + _ROWS * 10 + "1" * 9_000_000 + ",0,0\n")


@_file("one line of blanks.csv")
def _blanks(path: Path) -> None:
    path.write_text("1 " * 4_500_000)


@_file("lines without end.csv")
def _lines(path: Path) -> None:
    path.write_text(_HEAD + "\n" + _ROWS + "\n" * 9_000_000 + "1,2,3")


@_file("short lines of commas.csv")
def _commas(path: Path) -> None:
    path.write_text("a,b\n" + "1,1\n" * 2_200_000)


@_file("a column of times without digits.csv")
def _times(path: Path) -> None:
    path.write_text("time,x\n" + "".join(f"2026-01-01T00:00:{row:02d}.²,1\n" for row in range(30)))


@_file("times before time.csv")
def _early(path: Path) -> None:
    path.write_text("time,q_joint_1\n" + "".join(f"0001-01-01T00:00:{row:02d}+14:00,1\n" for row in range(30)))


# workbooks


def _workbook(path: Path, sheet: Iterator[bytes] | bytes, **parts: Iterator[bytes] | bytes) -> None:
    kinds = {"sheet1": "worksheet", "sharedStrings": "sharedStrings", "styles": "styles"}
    places = {"sheet1": "worksheets/sheet1.xml", "sharedStrings": "sharedStrings.xml", "styles": "styles.xml"}
    written = {"sheet1": sheet, **parts}
    types = "".join(
        f'<Override PartName="/xl/{places[name]}" '
        f'ContentType="application/vnd.openxmlformats-officedocument.spreadsheetml.{kinds[name]}+xml"/>'
        for name in written
    )
    links = "".join(
        f'<Relationship Id="{name}" Type="{_OFFICE}/{kinds[name]}" Target="{places[name]}"/>' for name in written
    )
    plain = {
        "[Content_Types].xml": f'<Types xmlns="{_PACKAGE}/content-types">'
        '<Default Extension="rels" ContentType="application/vnd.openxmlformats-package.relationships+xml"/>'
        '<Override PartName="/xl/workbook.xml" '
        'ContentType="application/vnd.openxmlformats-officedocument.spreadsheetml.sheet.main+xml"/>'
        f"{types}</Types>",
        "_rels/.rels": f'<Relationships xmlns="{_PACKAGE}/relationships"><Relationship Id="r" '
        f'Type="{_OFFICE}/officeDocument" Target="xl/workbook.xml"/></Relationships>',
        "xl/workbook.xml": f'<workbook xmlns="{_SHEET}" xmlns:r="{_OFFICE}"><sheets>'
        '<sheet name="log" sheetId="1" r:id="sheet1"/></sheets></workbook>',
        "xl/_rels/workbook.xml.rels": f'<Relationships xmlns="{_PACKAGE}/relationships">{links}</Relationships>',
    }
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED, compresslevel=6) as packed:
        for name, text in plain.items():
            packed.writestr(name, text)
        for name, content in written.items():
            with packed.open(f"xl/{places[name]}", "w") as part:
                for piece in [content] if isinstance(content, bytes) else content:
                    part.write(piece)


def _sheet(rows: bytes, times: int = 1, before: bytes = b"", after: bytes = b"") -> Iterator[bytes]:
    yield f'<worksheet xmlns="{_SHEET}">'.encode() + before + b"<sheetData>"
    many = max(1, 100_000 // max(1, len(rows)))
    for _ in range(times // many):
        yield rows * many
    yield rows * (times % many) + b"</sheetData>" + after + b"</worksheet>"


def _part(tag: str, inside: bytes, times: int) -> Iterator[bytes]:
    yield f'<{tag} xmlns="{_SHEET}">'.encode()
    many = max(1, 100_000 // max(1, len(inside)))
    for _ in range(times // many):
        yield inside * many
    yield f"</{tag}>".encode()


@_file("a row far below.xlsx")
def _far_row(path: Path) -> None:
    _workbook(path, _sheet(b'<row r="2000000000"><c r="A2000000000"><v>1</v></c></row>'))


@_file("many rows.xlsx")
def _many_rows(path: Path) -> None:
    _workbook(path, _sheet(b"<row/>", 15_000_000))


@_file("a row of many cells.xlsx")
def _wide_row(path: Path) -> None:
    _workbook(path, _sheet(b"<row>" + b"<c/>" * 100_000 + b"</row>"))


@_file("cells far to the right.xlsx")
def _far_cells(path: Path) -> None:
    _workbook(path, _sheet(b'<row><c r="ZZZ1"><v>1</v></c></row>', 1000))


@_file("many cells.xlsx")
def _many_cells(path: Path) -> None:
    _workbook(path, _sheet(b"<row>" + b"<c><v>1</v></c>" * 60 + b"</row>", 100_000))


@_file("a bomb of shared strings.xlsx")
def _strings(path: Path) -> None:
    _workbook(path, _sheet(b"<row/>"), sharedStrings=_part("sst", b"<si/>", 2_000_000))


@_file("one long shared string.xlsx")
def _string(path: Path) -> None:
    def text() -> Iterator[bytes]:
        yield f'<sst xmlns="{_SHEET}"><si><t>'.encode()
        for _ in range(800):
            yield b"x" * 100_000
        yield b"</t></si></sst>"

    _workbook(path, _sheet(b'<row><c t="s"><v>0</v></c></row>', 100), sharedStrings=text())


@_file("a long shared string in many cells.xlsx")
def _shared(path: Path) -> None:
    strings = f'<sst xmlns="{_SHEET}"><si><t>{"x" * 1_000_000}</t></si></sst>'.encode()
    row = b'<row><c><v>1</v></c><c><v>1</v></c><c t="s"><v>0</v></c></row>'
    _workbook(path, _sheet(row, 50_000), sharedStrings=strings)


@_file("deep XML.xlsx")
def _deep(path: Path) -> None:
    _workbook(path, _sheet(b"<row>" + b"<c>" * 200 + b"</c>" * 200 + b"</row>"))


@_file("many columns described.xlsx")
def _described(path: Path) -> None:
    _workbook(path, _sheet(b"<row/>", before=b"<cols>" + b'<col min="1" max="2"/>' * 2_000_000 + b"</cols>"))


@_file("many styles.xlsx")
def _styles(path: Path) -> None:
    def text() -> Iterator[bytes]:
        yield f'<styleSheet xmlns="{_SHEET}"><cellXfs>'.encode()
        for _ in range(100):
            yield b"<xf/>" * 10_000
        yield b"</cellXfs></styleSheet>"

    _workbook(path, _sheet(b"<row/>"), styles=text())


@_file("a number of many digits.xlsx")
def _digits(path: Path) -> None:
    _workbook(path, _sheet(b"<row><c><v>" + b"9" * 5_000 + b"</v></c></row>"))


@_file("many attributes.xlsx")
def _attributes(path: Path) -> None:
    many = b" ".join(b'a%d="1"' % k for k in range(200_000))
    _workbook(path, _sheet(b"<row " + many + b"/>"))


@_file("a part that hides its size.xlsx")
def _hidden(path: Path) -> None:
    """The directory says 100 bytes of a part of many."""
    _workbook(path, _sheet(b"<row/>", 1_000_000))
    content = path.read_bytes()
    with zipfile.ZipFile(path) as packed:
        size = packed.getinfo("xl/worksheets/sheet1.xml").file_size
    path.write_bytes(content.replace(struct.pack("<L", size), struct.pack("<L", 100)))


@_file("entities.xlsx")
def _entities(path: Path) -> None:
    from tests.hostile.xml_attacks import entities

    _workbook(path, (entities(9, 10) + f'<worksheet xmlns="{_SHEET}"><sheetData>&e9;</sheetData></worksheet>').encode())


# Parquet


def _table(rows: int, **columns: pa.Array) -> pa.Table:
    time = np.arange(rows) / 100
    return pa.table({"time": time, "q_joint_1": np.sin(time), "tau_joint_1": np.cos(time), **columns})


@_file("a list of many values in one row.parquet")
def _long_list(path: Path) -> None:
    schema = pa.schema([("time", pa.list_(pa.int8()))])
    count = 20_000_000
    values = pa.ListArray.from_arrays(pa.array([0, count], pa.int32()), pa.array(np.zeros(count, np.int8)))
    pq.write_table(pa.table([values], schema=schema), path, compression="zstd", write_statistics=False)


@_file("a dictionary of long strings.parquet")
def _dictionary(path: Path) -> None:
    strings = pa.DictionaryArray.from_arrays(np.arange(3000, dtype=np.int32) % 3, ["a" * 1_000_000 + k for k in "xyz"])
    pq.write_table(_table(3000, note=strings), path, compression="zstd")


@_file("long strings.parquet")
def _long_strings(path: Path) -> None:
    table = _table(100, note=pa.array(["a" * 1_000_000 + str(k) for k in range(100)], pa.large_string()))
    pq.write_table(table, path, compression="zstd", use_dictionary=False, write_statistics=False)


@_file("40 million rows.parquet")
def _rows(path: Path) -> None:
    schema = pa.schema([(name, pa.float64()) for name in ("time", "q_joint_1", "tau_joint_1")])
    batch = pa.table([pa.array(np.zeros(10_000_000))] * 3, schema=schema)
    with pq.ParquetWriter(path, schema, compression="zstd") as writer:
        for _ in range(4):
            writer.write_table(batch)


@_file("10000 columns.parquet")
def _columns_that_are_allowed(path: Path) -> None:
    pq.write_table(pa.table({f"x{k}": np.zeros(30) for k in range(10_000)}), path)


@_file("11000 columns.parquet")
def _wide(path: Path) -> None:
    pq.write_table(
        pa.table({f"c{k}": np.zeros(1) for k in range(11_000)}), path, store_schema=False, write_statistics=False
    )


@_file("many row groups.parquet")
def _groups(path: Path) -> None:
    table = pa.table({"time": np.zeros(20_000, np.int8)})
    pq.write_table(table, path, row_group_size=1, store_schema=False, write_statistics=False, compression="none")


@_file("a footer of text.parquet")
def _footer(path: Path) -> None:
    pq.write_table(_table(30).replace_schema_metadata({"note": "x" * 4_000_000}), path)


@_file("structs in structs.parquet")
def _structs(path: Path) -> None:
    kind: pa.DataType = pa.float64()
    for _ in range(90):
        kind = pa.struct([("a", kind), ("b", kind)]) if _ % 30 == 0 else pa.struct([("a", kind)])
    values = pa.nulls(30, kind)
    pq.write_table(_table(30, deep=values), path, store_schema=False)


@_file("maps and lists.parquet")
def _maps(path: Path) -> None:
    kind = pa.map_(pa.string(), pa.list_(pa.struct([("x", pa.list_(pa.float64()))])))
    values = pa.array([[("k", [{"x": [1.0] * 100_000}])]] * 30, kind)
    pq.write_table(_table(30, q=values), path, compression="zstd")


@_file("times beyond nanoseconds.parquet")
def _far_times(path: Path) -> None:
    table = _table(30)
    values = pa.array(np.arange(30) + 2**55, pa.timestamp("us"))
    pq.write_table(table.set_column(0, "time", values), path)


@_file("wide decimals.parquet")
def _decimals(path: Path) -> None:
    table = _table(30)
    pq.write_table(table.set_column(1, "q_joint_1", pa.array([10**70] * 30, pa.decimal256(76, 0))), path)


@_file("other types.parquet")
def _types(path: Path) -> None:
    others = {
        "a": pa.array([1] * 30, pa.time64("ns")),
        "b": pa.array([1] * 30, pa.date32()),
        "c": pa.array([1] * 30, pa.duration("ns")),
        "d": pa.array([b"\xff"] * 30),
        "e": pa.array([True] * 30),
        "f": pa.array([1] * 30, pa.int32()).dictionary_encode(),
        "g": pa.array([2**30] * 30, pa.date32()),
        "h": pa.array([1.0] * 30, pa.float16()),
        "i": pa.array([b"1234"] * 30, pa.binary(4)),
    }
    pq.write_table(_table(30, **others), path)


@_file("the same name many times.parquet")
def _same(path: Path) -> None:
    pq.write_table(pa.table([np.zeros(30)] * 5000, names=["a"] * 5000), path)


@_file("pages that unpack to more than the footer says.parquet")
def _pages(path: Path) -> None:
    """Three columns of thirty numbers share a page that holds 200 MB of zeros; the footer says 300 bytes."""
    size = 200_000_000
    packed = pa.compress(bytes(size), codec="zstd", asbytes=True)
    values = _field(1, 5, 30) + _field(1, 5, 0) + _field(1, 5, 3) + _field(1, 5, 3) + b"\0"
    page = _field(1, 5, 0) + _field(1, 5, size) + _field(1, 5, len(packed)) + b"\x2c" + values + b"\0" + packed
    names = [b"time", b"q_joint_1", b"tau_joint_1"]
    schema = b"\x48" + _varint(4) + b"root" + _field(1, 5, 3) + b"\0"
    chunks = b""
    for name in names:
        schema += _field(1, 5, 5) + _field(2, 5, 0) + b"\x18" + _varint(len(name)) + name + b"\0"
        what = _field(1, 5, 5) + b"\x19\x15\0\x19\x18" + _varint(len(name)) + name + _field(1, 5, 6)
        place = _field(1, 6, 30) + _field(1, 6, 300) + _field(1, 6, len(page)) + _field(2, 6, 4) + b"\0"
        chunks += _field(2, 6, 4) + b"\x1c" + what + place + b"\0"
    group = b"\x19\x3c" + chunks + _field(1, 6, 900) + _field(1, 6, 30) + b"\0"
    footer = _field(1, 5, 1) + b"\x19\x4c" + schema + _field(1, 6, 30) + b"\x19\x1c" + group + b"\0"
    path.write_bytes(b"PAR1" + page + footer + struct.pack("<L", len(footer)) + b"PAR1")


@_file("groups in groups.parquet")
def _deep_schema(path: Path) -> None:
    depth = 10_000
    element = b"\x35\x02\x18\x01a\x15\x02\0"
    leaf = b"\x15\x0a\x25\x02\x18\x01x\0"
    schema = b"\x48\x04root\x15\x02\0" + element * depth + leaf
    footer = _field(1, 5, 1) + b"\x19\xfc" + _varint(depth + 2) + schema + _field(1, 6, 0) + b"\x19\x0c\0"
    path.write_bytes(b"PAR1" + footer + struct.pack("<L", len(footer)) + b"PAR1")


def _varint(value: int) -> bytes:
    made = b""
    while value > 127:
        made += bytes([value & 127 | 128])
        value >>= 7
    return made + bytes([value])


def _field(step: int, kind: int, value: int) -> bytes:
    """A whole number in Thrift's compact protocol, `step` fields after the one before."""
    return bytes([step << 4 | kind]) + _varint(value << 1)


# bags of ROS 2


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


@_file("a chunk of zeros.mcap")
def _zero_chunk(path: Path) -> None:
    size = 70_000_000
    _mcap(path, pa.compress(bytes(size), codec="zstd", asbytes=True), size, b"zstd")


@_file("a chunk of 4 GB by its own account.mcap")
def _huge_chunk(path: Path) -> None:
    _mcap(path, pa.compress(bytes(1_000_000), codec="zstd", asbytes=True), 4_000_000_000, b"zstd")


@_file("a chunk that is named 50000 times.mcap")
def _same_chunk(path: Path) -> None:
    chunk = _message(1) + _record(0x80, bytes(4_000_000))
    _mcap(path, chunk, len(chunk), times=50_000)


@_file("many messages that pack well.mcap")
def _messages(path: Path) -> None:
    chunk = b"".join(_message(time) for time in range(500_000))
    _mcap(path, pa.compress(chunk, codec="zstd", asbytes=True), len(chunk), b"zstd")


@_file("a long quality of service.mcap")
def _service(path: Path) -> None:
    service = b"- {history: 1}\n" * 30_000
    _mcap(path, _message(1), len(_message(1)), metadata=_text(b"offered_qos_profiles") + _text(service))


def _database(path: Path, *statements: str) -> None:
    """A bag in SQLite with messages of 30 joint states, changed by statements."""
    import sqlite3
    from contextlib import closing

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


@_file("values made by a formula.db3")
def _formula(path: Path) -> None:
    made = "CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id, timestamp, data AS (zeroblob(900000000)))"
    rows = "WITH RECURSIVE n(k) AS (SELECT 1 UNION ALL SELECT k + 1 FROM n WHERE k < 100) SELECT k, 1, k FROM n"
    _database(path, "DROP TABLE messages", made, f"INSERT INTO messages {rows}")


@_file("a table without end.db3")
def _endless(path: Path) -> None:
    endless = "WITH RECURSIVE n(k) AS (SELECT 1 UNION ALL SELECT k + 1 FROM n) SELECT k, '', '', '', '' FROM n"
    _database(
        path,
        "CREATE TABLE schema(schema_version)",
        "INSERT INTO schema VALUES(4)",
        "CREATE VIEW message_definitions(id, topic_type, encoding, encoded_message_definition, "
        "type_description_hash) AS " + endless,
    )


@_file("a metadata of aliases")
def _aliases(path: Path) -> None:
    path.mkdir(exist_ok=True)
    _database(path / "run.db3")
    bomb = "".join(f"b{n}: &b{n} [{', '.join([f'*b{n - 1}'] * 10) if n else 'x'}]\n" for n in range(12))
    (path / "metadata.yaml").write_text(
        bomb
        + "rosbag2_bagfile_information:\n  version: 5\n  storage_identifier: sqlite3\n  relative_file_paths: [run.db3]"
        "\n  compression_mode: x\n  compression_format: *b11\n"
    )


@_file("a metadata of 9 MB")
def _metadata(path: Path) -> None:
    path.mkdir(exist_ok=True)
    _database(path / "run.db3")
    (path / "metadata.yaml").write_text("rosbag2_bagfile_information:\n" + "  - {a: 1}\n" * 800_000)


# bags of ROS 1


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


@_file("a chunk of zeros.bag")
def _zeros1(path: Path) -> None:
    import bz2

    _bag(path, [(bz2.compress(bytes(70_000_000)), [0])], b"bz2")


@_file("chunks that take turns.bag")
def _turns(path: Path) -> None:
    chunk = _MESSAGE + bytes(4_000_000)
    _bag(path, [(chunk, [0] * 40_000), (chunk, [0] * 40_000)])


@_file("an index that is named 50000 times.bag")
def _named(path: Path) -> None:
    _bag(path, [(_MESSAGE, [0] * 200_000)], times=50_000)


@_file("many topics before each message.bag")
def _before(path: Path) -> None:
    _bag(path, [(_TOPIC * 30_000 + _MESSAGE, [0] * 200_000)])


@_file("an integer of many digits.xlsx")
def _integer(path: Path) -> None:
    _workbook(path, _sheet(b"<row><c><v>1</v></c><c><v>" + b"9" * 1000 + b"</v></c></row>", 30))

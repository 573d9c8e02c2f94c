"""Parquet files that ask their reader for much."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from tests.hostile.hostile_files import Files

FILES = Files()


def _table(rows: int, **columns: pa.Array) -> pa.Table:
    time = np.arange(rows) / 100
    return pa.table({"time": time, "q_joint_1": np.sin(time), "tau_joint_1": np.cos(time), **columns})


@FILES.named("a list of many values in one row.parquet")
def _long_list(path: Path) -> None:
    schema = pa.schema([("time", pa.list_(pa.int8()))])
    count = 20_000_000
    values = pa.ListArray.from_arrays(pa.array([0, count], pa.int32()), pa.array(np.zeros(count, np.int8)))
    pq.write_table(pa.table([values], schema=schema), path, compression="zstd", write_statistics=False)


@FILES.named("a dictionary of long strings.parquet")
def _dictionary(path: Path) -> None:
    strings = pa.DictionaryArray.from_arrays(np.arange(3000, dtype=np.int32) % 3, ["a" * 1_000_000 + k for k in "xyz"])
    pq.write_table(_table(3000, note=strings), path, compression="zstd")


@FILES.named("long strings.parquet")
def _long_strings(path: Path) -> None:
    table = _table(100, note=pa.array(["a" * 1_000_000 + str(k) for k in range(100)], pa.large_string()))
    pq.write_table(table, path, compression="zstd", use_dictionary=False, write_statistics=False)


@FILES.named("40 million rows.parquet")
def _rows(path: Path) -> None:
    schema = pa.schema([(name, pa.float64()) for name in ("time", "q_joint_1", "tau_joint_1")])
    batch = pa.table([pa.array(np.zeros(10_000_000))] * 3, schema=schema)
    with pq.ParquetWriter(path, schema, compression="zstd") as writer:
        for _ in range(4):
            writer.write_table(batch)


@FILES.named("10000 columns.parquet")
def _columns_that_are_allowed(path: Path) -> None:
    pq.write_table(pa.table({f"x{k}": np.zeros(30) for k in range(10_000)}), path)


@FILES.named("11000 columns.parquet")
def _wide(path: Path) -> None:
    pq.write_table(
        pa.table({f"c{k}": np.zeros(1) for k in range(11_000)}), path, store_schema=False, write_statistics=False
    )


@FILES.named("many row groups.parquet")
def _groups(path: Path) -> None:
    table = pa.table({"time": np.zeros(20_000, np.int8)})
    pq.write_table(table, path, row_group_size=1, store_schema=False, write_statistics=False, compression="none")


@FILES.named("a footer of text.parquet")
def _footer(path: Path) -> None:
    pq.write_table(_table(30).replace_schema_metadata({"note": "x" * 4_000_000}), path)


@FILES.named("structs in structs.parquet")
def _structs(path: Path) -> None:
    kind: pa.DataType = pa.float64()
    for _ in range(90):
        kind = pa.struct([("a", kind), ("b", kind)]) if _ % 30 == 0 else pa.struct([("a", kind)])
    values = pa.nulls(30, kind)
    pq.write_table(_table(30, deep=values), path, store_schema=False)


@FILES.named("maps and lists.parquet")
def _maps(path: Path) -> None:
    kind = pa.map_(pa.string(), pa.list_(pa.struct([("x", pa.list_(pa.float64()))])))
    values = pa.array([[("k", [{"x": [1.0] * 100_000}])]] * 30, kind)
    pq.write_table(_table(30, q=values), path, compression="zstd")


@FILES.named("times beyond nanoseconds.parquet")
def _far_times(path: Path) -> None:
    table = _table(30)
    values = pa.array(np.arange(30) + 2**55, pa.timestamp("us"))
    pq.write_table(table.set_column(0, "time", values), path)


@FILES.named("wide decimals.parquet")
def _decimals(path: Path) -> None:
    table = _table(30)
    pq.write_table(table.set_column(1, "q_joint_1", pa.array([10**70] * 30, pa.decimal256(76, 0))), path)


@FILES.named("other types.parquet")
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


@FILES.named("the same name many times.parquet")
def _same(path: Path) -> None:
    pq.write_table(pa.table([np.zeros(30)] * 5000, names=["a"] * 5000), path)


@FILES.named("pages that unpack to more than the footer says.parquet")
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


@FILES.named("groups in groups.parquet")
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

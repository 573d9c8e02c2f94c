"""Hostile bags: each is refused in one line, and none fills the memory."""

from __future__ import annotations

import bz2
import random
from pathlib import Path

import lz4.frame
import numpy as np
import pytest
from rosbags.rosbag1 import Writer
from rosbags.typesys import Stores, get_typestore
from tests.signals.bags import FORMS, numbers, refused, states, write
from tests.signals.test_log import ROBOT

from irtwin.errors import InputError
from irtwin.signals.samples import read_signals
from irtwin.signals.sources import bag_file, bag_unpacking

Q = np.column_stack([np.sin(np.arange(60) / 9.0), np.cos(np.arange(60) / 7.0)])


def bag(path: Path) -> Path:
    return write(path, states(Q, effort=Q), numbers("/power", np.ones(60)))


def content(path: Path) -> Path:
    """The file with a bag's messages."""
    return next(path.glob("*.db3")) if path.is_dir() else path


@pytest.mark.parametrize("form", FORMS)
def test_a_bag_that_was_cut_off_is_told(form: str, tmp_path: Path) -> None:
    path = bag(tmp_path / form)
    file = content(path)
    whole = file.read_bytes()
    for length in (0, 3, len(whole) // 2):
        file.write_bytes(whole[:length])
        assert refused(path).startswith(": not a readable bag, or damaged (")


@pytest.mark.slow
@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("seed", range(4))
def test_a_bag_with_wrong_bytes_is_read_or_refused(form: str, seed: int, tmp_path: Path) -> None:
    path = bag(tmp_path / form)
    file = content(path)
    whole, draw = file.read_bytes(), random.Random(seed)
    for _ in range(25):
        spoilt = bytearray(whole)
        for _ in range(draw.choice([1, 4])):
            place = draw.randrange(len(spoilt) - 8)
            spoilt[place : place + draw.choice([1, 4, 8])] = draw.choice([b"\xff" * 4, b"\0", b"\x7f" * 8])
        file.write_bytes(spoilt)
        try:
            read_signals(path, ROBOT)
        except InputError as error:
            assert "\n" not in str(error)


def compressed(path: Path, inflated: bytes, kind: str) -> Path:
    """A bag of ROS 1 whose only chunk is another than its index says."""
    types = get_typestore(Stores.ROS1_NOETIC)
    writer = Writer(path)
    writer.set_compression(Writer.CompressionFormat[kind.upper()])
    with writer:
        topic = writer.add_connection("/joint_states", bag_file.JOINT_STATE, typestore=types)
        pack = {"bz2": bz2.compress, "lz4": lz4.frame.compress}[kind]
        writer.compressor = lambda _: pack(inflated)
        writer.write(topic, 1, b"")
    return path


@pytest.mark.parametrize("kind", ["bz2", "lz4"])
def test_a_chunk_that_inflates_without_bound_is_told(
    kind: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(bag_unpacking, "_LARGEST_CHUNK", 1_000_000)
    path = compressed(tmp_path / "run.bag", bytes(3_000_000), kind)
    assert path.stat().st_size < 20_000
    assert "(ValueError: a chunk of more than 1 MB)" in refused(path)


def test_compression_that_is_none_is_told(tmp_path: Path) -> None:
    path = bag(tmp_path / "run.bag")
    path.write_bytes(path.read_bytes().replace(b"compression=none", b"compression=rot9"))
    assert "(ReaderError: Compression 'rot9' is not supported.)" in refused(path)


def test_a_type_that_is_not_ros_own_is_told(tmp_path: Path) -> None:
    path = bag(tmp_path / "run.bag")
    path.write_bytes(path.read_bytes().replace(b"md5sum=3066dcd7", b"md5sum=00000000"))
    assert refused(path) == (": topic /joint_states has a sensor_msgs/msg/JointState that is not ROS' own; convert it")


def test_a_folder_that_is_no_bag_is_told(tmp_path: Path) -> None:
    (tmp_path / "run").mkdir()
    assert refused(tmp_path / "run") == (
        ": is a folder without metadata.yaml, so no bag of ROS 2; name the bag's folder"
    )
    (tmp_path / "run" / "metadata.yaml").write_text("rosbag2_bagfile_information: [")
    assert refused(tmp_path / "run").startswith(": not a readable bag, or damaged (ReaderError: Could not load YAML")


@pytest.mark.parametrize("mode", ["file", "message"])
def test_a_bag_that_is_compressed_as_a_whole_is_told(mode: str, tmp_path: Path) -> None:
    path = bag(tmp_path / "run")
    metadata = path / "metadata.yaml"
    text = metadata.read_text()
    assert "compression_mode: ''" in text
    metadata.write_text(text.replace("compression_mode: ''", f'compression_mode: "{mode.upper()}"'))
    assert refused(path) == f": its {mode}s are compressed one by one; unpack it with `ros2 bag convert`"


def test_a_bag_that_is_too_large_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(bag_file, "_LARGEST", 1000)
    for form in FORMS:
        assert refused(bag(tmp_path / form)) == ": is larger than 0 MB; keep the topics of the run alone"

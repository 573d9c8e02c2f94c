"""Bags as others write them, message by message, for robots that tests make."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin
from rosbags.rosbag2 import Writer as Writer2
from rosbags.typesys import Stores, get_typestore
from tests.signals.test_log import ROBOT

from irtwin.errors import InputError
from irtwin.robot.description import Robot
from irtwin.robot.ros_names import ros_joints
from irtwin.signals.channels import Signals, columns_of
from irtwin.signals.samples import read_signals
from irtwin.signals.sources.bag_source import FIELDS, number_topics

FORMS = ("run.bag", "run.mcap", "run")
START = 1_767_225_600 * 1_000_000_000  # ns: 2026 begins
Message = tuple[str, str, int, Mapping[str, Any]]  # topic, type, ns of recording, fields


def states(
    q: np.ndarray,
    names: Sequence[str] = ("a", "b"),
    topic: str = "/joint_states",
    step: int = 10_000_000,
    **others: Any,
) -> list[Message]:
    """Joint states at (N, n) positions; `others` are further fields, (N, n), and `stamps`, ns, for the headers."""
    stamps = others.pop("stamps", [START + row * step for row in range(len(q))])
    return [
        (
            topic,
            "sensor_msgs/msg/JointState",
            START + row * step,
            {
                "header": stamps[row],
                "name": list(names),
                "position": q[row],
                **{key: others[key][row] if key in others else np.empty(0) for key in ("velocity", "effort")},
            },
        )
        for row in range(len(q))
    ]


def numbers(
    topic: str, values: Iterable[float], step: int = 10_000_000, first: int = 0, bits: int = 64
) -> list[Message]:
    """Values of a topic, the first `first` ns after the bag begins."""
    kind = f"std_msgs/msg/Float{bits}"
    return [(topic, kind, START + first + row * step, {"data": float(one)}) for row, one in enumerate(values)]


def of_run(robot: Robot, signals: Signals) -> list[list[Message]]:
    """Positions, speeds and torques of a run as joint states, each other column as a topic of numbers."""
    step = round(1e9 * (signals.time[1] - signals.time[0]))
    joint_states = {key: values for field, key in FIELDS.items() if (values := getattr(signals, field)) is not None}
    columns = columns_of(signals, robot.joint_names)
    topics = {name: columns[column] for column, name in number_topics(robot).items() if column in columns}
    moved = states(joint_states.pop("position"), list(ros_joints(robot).values()), step=step, **joint_states)
    return [moved, *(numbers(f"/{name}", values, step) for name, values in topics.items())]


def write(path: Path, *messages: Sequence[Message], compression: str | None = None) -> Path:
    """Write messages as the bag that the path's end asks for; return where it is.

    compression: of the chunks, "bz2" or "lz4" in ROS 1, "zstd" in MCAP.
    """
    rows = sorted((message for some in messages for message in some), key=lambda message: message[2])
    if path.suffix == ".bag":
        types = get_typestore(Stores.ROS1_NOETIC)
        one = Writer1(path)
        if compression is not None:
            one.set_compression(Writer1.CompressionFormat[compression.upper()])
        with one as bag:
            _fill(bag, types, types.serialize_ros1, rows, {"seq": 0})
        return path
    types = get_typestore(Stores.ROS2_HUMBLE)
    folder = path.with_name(f"{path.name}.folder") if path.suffix == ".mcap" else path
    plugin = StoragePlugin.MCAP if path.suffix == ".mcap" else StoragePlugin.SQLITE3
    two = Writer2(folder, version=8, storage_plugin=plugin)
    if compression is not None:
        two.set_compression(CompressionMode.STORAGE, CompressionFormat[compression.upper()])
    with two as bag:
        _fill(bag, types, types.serialize_cdr, rows, {})
    if path.suffix == ".mcap":
        next(folder.glob("*.mcap")).rename(path)
    return path


def refused(path: Path, **given: Any) -> str:
    """Return what is said of a bag that is refused, in one line that names it first, without its name."""
    with pytest.raises(InputError) as error:
        read_signals(path, ROBOT, **given)
    assert str(error.value).startswith(str(path))
    assert "\n" not in str(error.value)
    return str(error.value).removeprefix(str(path))


def _fill(bag: Any, types: Any, serialize: Any, rows: Iterable[Message], head: Mapping[str, Any]) -> None:
    connections: dict[tuple[str, str], Any] = {}
    for topic, kind, time, fields in rows:
        if (topic, kind) not in connections:
            connections[topic, kind] = bag.add_connection(topic, kind, typestore=types)
        given = dict(fields)
        if "header" in given:
            sec, nanosec = divmod(given["header"], 1_000_000_000)
            stamp = types.types["builtin_interfaces/msg/Time"](sec=sec, nanosec=nanosec)
            given["header"] = types.types["std_msgs/msg/Header"](stamp=stamp, frame_id="", **head)
        bag.write(connections[topic, kind], time, serialize(types.types[kind](**given), kind))

"""Runs written as ROS bags, for `irtwin` and ROS' own tools to read."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from datetime import datetime
from pathlib import Path
from typing import Any

import numpy as np

from irtwin.errors import InputError
from irtwin.robot.description import Robot
from irtwin.robot.ros_names import ros_joints
from irtwin.signals.channels import Signals, columns_of
from irtwin.signals.sources.bag_file import JOINT_STATE, NUMBERS
from irtwin.signals.sources.bag_source import FIELDS, number_topics
from irtwin.storage.files import put_in_place, working_folder

_SECOND = 1_000_000_000  # ns
_LAST = {1: (1 << 32) - 1, 2: (1 << 31) - 1}  # s since 1970 that a stamp of ROS 1, of ROS 2 can say


def write_bag(path: Path, robot: Robot, signals: Signals, started: datetime) -> None:
    """Write a run as a bag: FILE.mcap or a folder for ROS 2, FILE.bag for ROS 1.

    /joint_states has positions, speeds and torques; each other column is a topic of its name, of std_msgs/Float64. The
    first message is of the time `started`. A file that is there is replaced, a folder is not.
    Raises InputError where there is no place, or where ROS has no such time.
    """
    try:
        import rosbags.rosbag1  # noqa: F401
    except ImportError as error:
        raise InputError('bags need the package rosbags; install it with: pip install "irtwin[ros]"') from error
    ros = 1 if path.suffix.lower() == ".bag" else 2
    single = path.suffix.lower() in (".bag", ".mcap")
    if path.exists() and not (single and path.is_file()):
        raise InputError(f"{path}: is there already; name a new {'file' if single else 'folder'}")
    stamps = _stamps(path, signals.time, started, ros)
    messages = _messages(robot, signals, stamps)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with working_folder(path.parent, ".bag-") as folder:
            made = folder / path.name
            _write_ros1(made, messages) if ros == 1 else _write_ros2(made, messages, mcap=single)
            if single:
                put_in_place(next(made.glob("*.mcap")) if made.is_dir() else made, path)
            else:
                made.rename(path)
    except OSError as error:
        raise InputError(f"{path}: cannot be written ({error.strerror}); choose another place") from error


def _stamps(path: Path, time: np.ndarray, started: datetime, ros: int) -> list[int]:
    """Return the time of each sample in ns since 1970."""
    first = int(started.timestamp()) * _SECOND + started.microsecond * 1000
    stamps = [first + round((moment - time[0]) * _SECOND) for moment in time.tolist()]
    if not 0 < stamps[0] <= stamps[-1] <= _LAST[ros] * _SECOND:
        raise InputError(
            f"{path}: the run began in {started.year}; ROS {ros} counts seconds from 1970 to "
            f"{datetime.fromtimestamp(_LAST[ros]).year}"
        )
    return stamps


def _messages(robot: Robot, signals: Signals, stamps: list[int]) -> Iterator[tuple[str, str, int, Mapping[str, Any]]]:
    """Yield topic, type, time (ns) and fields of all messages, in the order of time."""
    names = list(ros_joints(robot).values())
    states = {key: getattr(signals, field) for field, key in FIELDS.items()}
    columns = columns_of(signals, robot.joint_names)
    others = {f"/{name}": columns[column] for column, name in number_topics(robot).items() if column in columns}
    nothing = np.empty(0)
    for row, stamp in enumerate(stamps):
        fields = {key: nothing if values is None else values[row] for key, values in states.items()}
        yield "/joint_states", JOINT_STATE, stamp, {"name": names, **fields}
        for topic, values in others.items():
            yield topic, NUMBERS[0], stamp, {"data": float(values[row])}


def _write_ros1(path: Path, messages: Iterator[tuple[str, str, int, Mapping[str, Any]]]) -> None:
    from rosbags.rosbag1 import Writer
    from rosbags.typesys import Stores, get_typestore

    types = get_typestore(Stores.ROS1_NOETIC)
    with Writer(path) as writer:
        connections: dict[str, Any] = {}
        for number, (topic, kind, stamp, fields) in enumerate(messages):
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, kind, typestore=types)
            message = _made(types, kind, stamp, fields, number)
            writer.write(connections[topic], stamp, types.serialize_ros1(message, kind))


def _write_ros2(path: Path, messages: Iterator[tuple[str, str, int, Mapping[str, Any]]], *, mcap: bool) -> None:
    from rosbags.rosbag2 import StoragePlugin, Writer
    from rosbags.typesys import Stores, get_typestore

    types = get_typestore(Stores.ROS2_HUMBLE)
    plugin = StoragePlugin.MCAP if mcap else StoragePlugin.SQLITE3
    with Writer(path, version=8, storage_plugin=plugin) as writer:  # 9 is not read by ROS before Jazzy
        connections: dict[str, Any] = {}
        for topic, kind, stamp, fields in messages:
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, kind, typestore=types)
            writer.write(connections[topic], stamp, types.serialize_cdr(_made(types, kind, stamp, fields), kind))


def _made(types: Any, kind: str, stamp: int, fields: Mapping[str, Any], number: int | None = None) -> Any:
    """Return a message; `number` is the header's, which ROS 1 alone has."""
    if kind != JOINT_STATE:
        return types.types[kind](**fields)
    time = types.types["builtin_interfaces/msg/Time"](sec=stamp // _SECOND, nanosec=stamp % _SECOND)
    of_ros1 = {} if number is None else {"seq": number}
    header = types.types["std_msgs/msg/Header"](stamp=time, frame_id="", **of_ros1)
    return types.types[kind](header=header, **fields)

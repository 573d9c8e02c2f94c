"""Runs as ROS bags: joint states, and a topic of numbers for each channel that these do not carry."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import Any, ClassVar

import numpy as np
import pyarrow as pa

from irtwin.errors import InputError
from irtwin.robot.description import Robot
from irtwin.robot.ros_names import ros_joints
from irtwin.signals.channels import CHANNELS
from irtwin.signals.holes import known_at
from irtwin.signals.sources.bag_file import JOINT_STATE, NUMBERS, BagFile, Topic, open_bag
from irtwin.signals.sources.source import MOST_VALUES, Source

_LATEST = 1 << 62  # ns since 1970
_Numbers = tuple[list[int], list[float]]  # of a topic's messages: when each was recorded, ns since 1970; its number
FIELDS = {"q": "position", "dq": "velocity", "torque": "effort"}  # of sensor_msgs/JointState


def number_topics(robot: Robot) -> dict[str, str]:
    """Return the name, as ROS takes it, of the topic of numbers for each column that joint states do not carry."""
    names = ros_joints(robot)
    others = [channel for field, channel in CHANNELS.items() if field not in (*FIELDS, "time")]
    return {
        channel.column(joint): channel.column(names.get(joint, ""))
        for channel in others
        for joint in (robot.joint_names if channel.per_joint else ("",))
    }


class BagSource(Source):
    """A bag of ROS 1 or 2, or an MCAP file of ROS 2.

    Joint states give positions, and speeds and torques where each message has them; a topic of numbers (std_msgs
    Float64 or Float32) whose last part is a column's name, as /power, gives that column. Its values are taken, by the
    times of recording, at those of the joint states, straight in between. `topics` says which, where several would do.
    """

    suffixes: ClassVar[tuple[str, ...]] = (".bag", ".mcap", ".db3", "/")
    counted: ClassVar[str] = "joint state"
    first: ClassVar[int] = 1

    def columns(self) -> Sequence[str]:
        """Return the columns that the messages fill."""
        return list(self._run[0].column_names)

    def read(self, columns: Sequence[str], *, repair: bool) -> tuple[pa.Table, list[str]]:
        """Return some of the columns; joint states of a time at which another topic is silent are left out."""
        table, notes = self._run
        self.check_size(table.num_rows, len(columns))
        return table.select(columns), notes

    @cached_property
    def _run(self) -> tuple[pa.Table, list[str]]:
        with open_bag(self.path) as bag:
            topics = bag.topics
            states = self._states_topic(topics)
            numbers = self._number_topics(topics)
            for offered in topics:
                if offered.name in (states, *numbers.values()):
                    self.check_size(offered.count, _width(self.robot) if offered.kind == JOINT_STATE else 1)
            joints, others = self._messages(bag, states, tuple(numbers.values()))
        table = joints.table()
        known = np.ones(len(joints.recorded), dtype=bool)
        notes = []
        for column, topic in numbers.items():
            table[column], heard = _numbers_at(others[topic], np.array(joints.recorded, dtype=np.int64))
            known &= heard
        if not known.all():
            notes = [f"{self.path}: {int((~known).sum())} joint states left out, at which another topic is silent"]
        return pa.table({name: values[known] for name, values in table.items()}), notes

    def _states_topic(self, topics: Sequence[Topic]) -> str:
        names = [topic.name for topic in topics if topic.kind == JOINT_STATE and topic.count]
        chosen = self._chosen("joint_states", "joint states", names, names, "hold joint states")
        if chosen is None:
            raise InputError(f"{self.path}: holds no joint states (sensor_msgs/JointState); record /joint_states")
        return chosen

    def _number_topics(self, topics: Sequence[Topic]) -> dict[str, str]:
        """Return the topic of each column that is one of numbers."""
        numbers = [topic.name for topic in topics if topic.kind in NUMBERS and topic.count]
        result: dict[str, str] = {}
        for column, name in number_topics(self.robot).items():
            matching = [topic for topic in numbers if topic.rpartition("/")[2] in (column, name)]
            if (chosen := self._chosen(column, "numbers", numbers, matching, f"could be {column}")) is not None:
                result[column] = chosen
        return result

    def _chosen(self, key: str, content: str, topics: list[str], matching: list[str], share: str) -> str | None:
        """Return the topic that [topics] names for a key, else the only one that matches; None where none does."""
        if (named := self.topics.get(key)) is not None:
            if named not in topics:
                there = f"there are {', '.join(topics[:10])}" if topics else "there is none"
                raise InputError(f"{self.path}: {named} of [topics] holds no {content}; {there}")
            return named
        if len(matching) > 1:
            raise InputError(
                f"{self.path}: several topics {share}: {', '.join(matching)}; "
                f'say which in dataset.toml: [topics] {key} = "{matching[0]}"'
            )
        return matching[0] if matching else None

    def _messages(
        self, bag: BagFile, states: str, numbers: Sequence[str]
    ) -> tuple[_JointStates, Mapping[str, _Numbers]]:
        joints = _JointStates(self)
        others: dict[str, _Numbers] = {name: ([], []) for name in numbers}
        left = MOST_VALUES  # what the index said of the count may be wrong
        for topic, recorded, message in bag.messages((states, *numbers)):
            if not 0 <= recorded < _LATEST:
                raise InputError(f"{self.path}: a message of {topic} has no time; record the run again")
            if topic == states:
                joints.take(recorded, message)
                left -= joints.width
            else:
                others[topic][0].append(recorded)
                others[topic][1].append(float(message.data))
                left -= 2
            if left < 0:
                raise InputError(f"{self.path}: more than {MOST_VALUES:,} values; cut the run into several")
        joints.check(states)
        if empty := [topic for topic, (times, _) in others.items() if not times]:
            raise InputError(f"{self.path}: {empty[0]} holds no message, though the bag says so; record it again")
        return joints, others


class _JointStates:
    """The joint states that name all moving joints of a robot; others, of a gripper say, are passed over."""

    def __init__(self, source: BagSource) -> None:
        self.recorded: list[int] = []  # ns since 1970
        self._source = source
        self._names = ros_joints(source.robot)
        self._stamps: list[int] = []
        self._values: dict[str, list[np.ndarray]] = {field: [] for field in FIELDS}
        self._places: dict[tuple[str, ...], list[int] | None] = {}
        self._others: tuple[str, ...] = ()
        self.width = _width(source.robot)

    def take(self, recorded: int, message: Any) -> None:
        """Keep a message. Raises InputError where it has not as many values as names."""
        names = tuple(message.name)
        if names not in self._places:
            self._places[names] = self._order(names)
        order = self._places[names]
        if order is None:
            self._others = names
            return
        self.recorded.append(recorded)
        self._stamps.append(message.header.stamp.sec * 1_000_000_000 + message.header.stamp.nanosec)
        for field, key in FIELDS.items():
            values = getattr(message, key)
            if len(values) == len(names):
                self._values[field].append(values[order])
            elif len(values) or field == "q":
                raise InputError(
                    f"{self._source.path}, {self._source.place(len(self.recorded) - 1)}: "
                    f"{len(values)} values of {key} for {len(names)} joints; record the run again"
                )

    def check(self, topic: str) -> None:
        """Raise InputError where no message named all joints."""
        if self.recorded:
            return
        absent = [
            joint for joint, name in self._names.items() if joint not in self._others and name not in self._others
        ]
        shown = ", ".join(self._others[:10]) or "none"
        raise InputError(
            f"{self._source.path}: no message of {topic} has all joints of {self._source.robot.name}; "
            f"{', '.join(absent[:10])} {'is' if len(absent) == 1 else 'are'} missing (it has {shown[:200]})"
        )

    def table(self) -> dict[str, np.ndarray]:
        """Return the columns of time, s since the first message, and of what all messages carry."""
        stamps = np.array(self._stamps if any(self._stamps) else self.recorded, dtype=np.int64)
        columns = {"time": (stamps - stamps[0]) / 1e9}
        for field, rows in self._values.items():
            values = np.array(rows, dtype=float)
            if len(rows) == len(stamps) and not (field != "q" and np.isnan(values).all()):
                columns |= dict(zip(CHANNELS[field].columns(self._names), values.T, strict=True))
        return columns

    def _order(self, names: tuple[str, ...]) -> list[int] | None:
        """Return the place in a message of each joint, by its own name or by ROS'; None where one is missing."""
        places = [
            names.index(name) if name in names else names.index(alias) if alias in names else None
            for name, alias in self._names.items()
        ]
        return None if None in places else [place for place in places if place is not None]


def _numbers_at(messages: _Numbers, recorded: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return numbers at other times of recording (N,) ns, straight in between, and whether they are known there.

    They are not before the first message, after the last, and in a hole.
    """
    wanted = (recorded - recorded[0]).astype(float)
    times, last = np.unique((np.array(messages[0], dtype=np.int64) - recorded[0])[::-1], return_index=True)
    times = times.astype(float)
    return np.interp(wanted, times, np.array(messages[1])[::-1][last]), known_at(wanted, times)


def _width(robot: Robot) -> int:
    return len(FIELDS) * len(robot.joints) + 1

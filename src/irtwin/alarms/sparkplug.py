"""The plant as an edge node of Sparkplug B: births, data and deaths of robots, each a device, over MQTT.

A robot's metrics are what the question `plant_now` says of it. No package is taken to encode them: those that are
kept want versions of paho-mqtt that are over, and a payload needs few of protobuf's kinds of fields.
"""

from __future__ import annotations

import re
import struct
import threading
import time
from collections.abc import Iterable, Mapping
from itertools import count
from typing import Any

from irtwin.alarms.mqtt import Broker, BrokerConnection
from irtwin.announce import Announce

_REBIRTH, _BD_SEQ = "Node Control/Rebirth", "bdSeq"
_NO_ID = re.compile(r"[/+#\0]")  # what the id of a device must not have
_UINT64, _DOUBLE, _BOOLEAN, _STRING = 8, 10, 11, 12  # Sparkplug's types of metrics
# by column of `plant_now`: name and type
_METRICS = {"energy_Wh": ("Energy/Wh", _DOUBLE), "power_W": ("Power/W", _DOUBLE), "state": ("State", _STRING)}
_PATIENCE = 2.0  # s for the death to leave at the end

Metric = tuple[str, int, Any]  # name, type, value; None: not known


class EdgeNode(BrokerConnection):
    """Tells a broker of robots. Who sends its commands is answered by new births: nothing else can be commanded."""

    def __init__(self, broker: Broker, announce: Announce) -> None:
        """Connect in the background, again and again; `broker.topic` is GROUP/NODE."""
        super().__init__(broker, announce)
        self._group, _, self._node = broker.topic.partition("/")
        self._lock = threading.RLock()
        self._robots: dict[str, tuple[Metric, ...]] = {}
        self._born = False
        self._deaths, self._sequence = count(), count()
        self._client.on_pre_connect = self._bequeath
        self._client.on_message = lambda *_: self._be_born()
        self.begin()

    def tell(self, rows: Iterable[Mapping[str, Any]]) -> None:
        """Tell what is new of robots since the last time: births of new ones, data, deaths of those that are gone."""
        now = {
            _NO_ID.sub("_", row["robot"]): tuple((*metric, row[column]) for column, metric in _METRICS.items())
            for row in rows
        }
        with self._lock:
            before, self._robots = self._robots, now
            if not self._born:
                return
            for robot in before.keys() - now.keys():
                self._publish("DDEATH", (), robot)
            for robot, metrics in now.items():
                if robot not in before:
                    self._publish("DBIRTH", metrics, robot)
                elif news := [metric for metric in metrics if metric not in before[robot]]:
                    self._publish("DDATA", news, robot)

    def close(self) -> None:
        """Say that the node ends, and disconnect."""
        with self._lock:
            if self._born:
                self._client.publish(self._topic("NDEATH"), self._death, qos=1).wait_for_publish(_PATIENCE)
        self.end()

    def _bequeath(self, *_: Any) -> None:
        """Leave a death with the broker, of the same number as the birth that follows."""
        self._death_number = next(self._deaths) % 256
        self._death = payload([(_BD_SEQ, _UINT64, self._death_number)])
        self._client.will_set(self._topic("NDEATH"), self._death, qos=1)

    def made(self) -> None:
        """Tell of the node and all robots."""
        self._client.subscribe(self._topic("NCMD"), qos=1)
        self._be_born()

    def lost(self) -> None:
        """Tell nothing until it is made again."""
        with self._lock:
            self._born = False

    def _be_born(self) -> None:
        with self._lock:
            self._born, self._sequence = True, count()
            self._publish("NBIRTH", [(_BD_SEQ, _UINT64, self._death_number), (_REBIRTH, _BOOLEAN, False)])
            for robot, metrics in self._robots.items():
                self._publish("DBIRTH", metrics, robot)

    def _publish(self, kind: str, metrics: Iterable[Metric], robot: str | None = None) -> None:
        self._client.publish(self._topic(kind, robot), payload(metrics, next(self._sequence) % 256))

    def _topic(self, kind: str, robot: str | None = None) -> str:
        return "/".join(["spBv1.0", self._group, kind, self._node, *([] if robot is None else [robot])])


def payload(metrics: Iterable[Metric], sequence: int | None = None) -> bytes:
    """Return a payload of Sparkplug B, a message of protobuf; a death has no sequence number."""
    now = int(time.time() * 1000)
    told = _number(1, now)
    for name, kind, value in metrics:
        told += _bytes(2, _bytes(1, name.encode()) + _number(3, now) + _number(4, kind) + _value(kind, value))
    return told if sequence is None else told + _number(3, sequence)


def _value(kind: int, value: Any) -> bytes:
    if value is None:
        return _number(7, 1)  # is_null
    if kind == _DOUBLE:
        return _varint(13 << 3 | 1) + struct.pack("<d", value)
    return _bytes(15, value.encode()) if kind == _STRING else _number(14 if kind == _BOOLEAN else 11, int(value))


def _bytes(field: int, content: bytes) -> bytes:
    return _varint(field << 3 | 2) + _varint(len(content)) + content


def _number(field: int, value: int) -> bytes:
    return _varint(field << 3) + _varint(value)


def _varint(value: int) -> bytes:
    parts = bytearray()
    while value > 127:
        parts.append(value & 127 | 128)
        value >>= 7
    return bytes([*parts, value])

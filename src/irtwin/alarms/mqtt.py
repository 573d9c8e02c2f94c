"""MQTT brokers: connections that are made in the background again and again, and alarms by them, at least once."""

from __future__ import annotations

import threading
from dataclasses import dataclass, field
from typing import Any

import paho.mqtt.client as paho
from paho.mqtt.enums import CallbackAPIVersion, MQTTErrorCode

from irtwin.announce import Announce

MOST_WAITING = 1000  # messages that are kept for a broker that is down
_AGAIN = 15  # s between two tries to connect, at most
_PATIENCE = 10.0  # s that messages have when no more will come
_LAST_TRY = 2.0  # s, likewise, where the broker is down


@dataclass(frozen=True)
class Broker:
    """A broker, and what it is told by: a topic, or GROUP/NODE of Sparkplug B."""

    host: str
    port: int
    topic: str
    user: str | None = None
    password: str | None = field(default=None, repr=False)
    tls: bool = False
    timeout: float = 5.0  # s to connect

    @property
    def name(self) -> str:
        """Which broker it is; it holds no secret."""
        return f"MQTT broker at {self.host}:{self.port}"


class BrokerConnection:
    """A connection to a broker; nobody waits for it. A fault is announced once, and again after it was over."""

    def __init__(self, broker: Broker, announce: Announce) -> None:
        self.broker, self._announce = broker, announce
        self._fault = ""
        self._client = paho.Client(CallbackAPIVersion.VERSION2)
        self._client.connect_timeout = broker.timeout
        self._client.reconnect_delay_set(1, _AGAIN)
        if broker.user is not None:
            self._client.username_pw_set(broker.user, broker.password)
        if broker.tls:
            self._client.tls_set()
        self._client.on_connect, self._client.on_disconnect = self._connected, self._disconnected
        self._client.on_connect_fail = lambda *_: self._tell_fault("it cannot be reached; trying again")

    def begin(self) -> None:
        """Connect in the background."""
        self._client.connect_async(self.broker.host, self.broker.port)
        self._client.loop_start()

    def end(self) -> None:
        """Disconnect."""
        self._client.disconnect()
        self._client.loop_stop()

    def made(self) -> None:
        """Do what is to be done each time that the connection is made."""

    def lost(self) -> None:
        """Do what is to be done each time that the connection is lost."""

    def _connected(self, _client: paho.Client, _data: Any, _flags: Any, reason: Any, _properties: Any) -> None:
        if reason.is_failure:
            self._tell_fault(f"it refuses the connection: {reason}")
            return
        self._fault = ""
        self.made()

    def _disconnected(self, _client: paho.Client, _data: Any, _flags: Any, reason: Any, _properties: Any) -> None:
        self.lost()
        if reason.is_failure and not self._fault:
            self._tell_fault(f"the connection is lost: {reason}; trying again")

    def _tell_fault(self, fault: str) -> None:
        if fault != self._fault:
            self._announce(f"{self.broker.name}: {fault}")
        self._fault = fault


class AlarmTopic(BrokerConnection):
    """Publishes messages on a broker's topic; what waits while the broker is down is kept, and told when it is back."""

    def __init__(self, broker: Broker, announce: Announce) -> None:
        super().__init__(broker, announce)
        self._client.max_queued_messages_set(MOST_WAITING)
        self._client.on_publish = lambda *_: self._done()
        self._waiting = 0
        self._news = threading.Condition()
        self.begin()

    def put(self, line: bytes) -> None:
        """Take a message; where too many wait, it is lost, and that is announced."""
        with self._news:
            self._waiting += 1
        if self._client.publish(self.broker.topic, line, qos=1).rc == MQTTErrorCode.MQTT_ERR_QUEUE_SIZE:
            self._done()
            self._announce(f"{self.broker.name}: a message is lost: {MOST_WAITING} wait already")

    def close(self) -> None:
        """Give messages that wait some seconds; announce how many are left."""
        patience = _PATIENCE if self._client.is_connected() else _LAST_TRY
        with self._news:
            self._news.wait_for(lambda: not self._waiting, patience)
            left = self._waiting
        self.end()
        if left:
            self._announce(f"{self.broker.name}: {left} message{'s' * (left != 1)} not delivered: no time was left")

    def _done(self) -> None:
        with self._news:
            self._waiting -= 1
            self._news.notify_all()

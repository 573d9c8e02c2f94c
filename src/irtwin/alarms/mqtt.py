"""Alarms to an MQTT broker: one message each, delivered at least once (QoS 1)."""

from __future__ import annotations

import threading
from dataclasses import dataclass, field
from typing import Any

import paho.mqtt.client as paho
from paho.mqtt.enums import CallbackAPIVersion

from irtwin.alarms.delivery import Undelivered


@dataclass(frozen=True)
class Broker:
    """Publishes each message on a topic. It connects for each anew: alarms are rare, and connections break."""

    host: str
    port: int
    topic: str
    user: str | None = None
    password: str | None = field(default=None, repr=False)
    tls: bool = False
    timeout: float = 5.0  # s

    @property
    def name(self) -> str:
        """Which broker it is."""
        return f"MQTT broker at {self.host}:{self.port}"

    @property
    def patience(self) -> float:
        """How long a message may take in all: to connect, to be let in, and to be acknowledged, s."""
        return 3 * self.timeout + 1.0

    def client(self) -> paho.Client:
        """Return a client that is not connected yet."""
        client = paho.Client(CallbackAPIVersion.VERSION2)
        client.connect_timeout = self.timeout
        if self.user is not None:
            client.username_pw_set(self.user, self.password)
        if self.tls:
            client.tls_set()
        return client

    def send(self, line: bytes) -> None:
        """Publish a message and wait until the broker has it. Raises Undelivered."""
        client = self.client()
        answered, refused = threading.Event(), []

        def connected(_client: Any, _data: Any, _flags: Any, reason: Any, _properties: Any) -> None:
            refused.extend([str(reason)] if reason.is_failure else [])
            answered.set()

        client.on_connect = connected
        try:
            client.connect(self.host, self.port)
        except OSError as error:
            raise Undelivered(error.strerror or str(error)) from None
        client.loop_start()
        try:
            if not answered.wait(self.timeout):
                raise Undelivered(f"no answer within {self.timeout:g} s")
            if refused:
                raise Undelivered(f"it refuses the connection: {refused[0]}")
            published = client.publish(self.topic, line, qos=1)
            published.wait_for_publish(self.timeout)
            if not published.is_published():
                raise Undelivered(f"the message was not acknowledged within {self.timeout:g} s")
        finally:
            client.disconnect()
            client.loop_stop()

"""Alarms reach a broker that others wrote."""

from __future__ import annotations

import queue
import socket
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import paho.mqtt.client as paho
import pytest
from paho.mqtt.enums import CallbackAPIVersion
from tests.alarms import mosquitto

from irtwin.alarms.delivery import Undelivered
from irtwin.alarms.mqtt import Broker


@pytest.fixture
def port(tmp_path: Path) -> Iterator[int]:
    """A broker that wants a user and a password."""
    passwords = tmp_path / "passwords"
    subprocess.run(["mosquitto_passwd", "-c", "-b", passwords, "me", "right"], check=True, capture_output=True)
    passwords.chmod(0o644)
    with mosquitto.running(tmp_path, f"password_file {passwords}") as port:
        yield port


@mosquitto.needed
@pytest.mark.system
def test_a_message_reaches_who_listens_and_a_wrong_password_is_said(port: int) -> None:
    got: queue.Queue[bytes] = queue.Queue()
    listening: queue.Queue[None] = queue.Queue()
    client = paho.Client(CallbackAPIVersion.VERSION2)
    client.username_pw_set("me", "right")

    def connected(client: paho.Client, *_: Any) -> None:
        client.subscribe("plant/#", qos=1)

    client.on_connect = connected
    client.on_subscribe = lambda *_: listening.put(None)
    client.on_message = lambda _client, _data, message: got.put(message.payload)
    client.connect("127.0.0.1", port)
    client.loop_start()
    try:
        listening.get(timeout=30)
        for line in (b'{"event": "raised"}', b'{"event": "cleared"}'):
            Broker("127.0.0.1", port, "plant/alarms", "me", "right").send(line)
            assert got.get(timeout=30) == line
        with pytest.raises(Undelivered, match="it refuses the connection: Not authorized"):
            Broker("127.0.0.1", port, "plant/alarms", "me", "wrong").send(b"{}")
    finally:
        client.disconnect()
        client.loop_stop()


def test_a_broker_that_is_not_there_and_one_that_is_silent() -> None:
    with socket.create_server(("127.0.0.1", 0)) as silent:
        port = silent.getsockname()[1]
        with pytest.raises(Undelivered, match=r"no answer within 0\.1 s"):
            Broker("127.0.0.1", port, "a", timeout=0.1).send(b"{}")
    with pytest.raises(Undelivered, match="refused"):
        Broker("127.0.0.1", port, "a").send(b"{}")

"""Alarms reach a broker that others wrote."""

from __future__ import annotations

import queue
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import paho.mqtt.client as paho
import pytest
from paho.mqtt.enums import CallbackAPIVersion
from tests.alarms import mosquitto
from tests.sparql_servers import free_port
from tests.waiting import wait_for

from irtwin.alarms import mqtt
from irtwin.alarms.mqtt import AlarmTopic, Broker


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
        said: list[str] = []
        topic = AlarmTopic(Broker("127.0.0.1", port, "plant/alarms", "me", "right"), said.append)
        for line in (b'{"event": "raised"}', b'{"event": "cleared"}'):
            topic.put(line)
            assert got.get(timeout=30) == line
        topic.close()
        assert said == []
        refused = AlarmTopic(Broker("127.0.0.1", port, "plant/alarms", "me", "wrong"), said.append)
        refused.put(b"{}")
        refused.close()
        name = f"MQTT broker at 127.0.0.1:{port}"
        refusal = f"{name}: it refuses the connection: Not authorized"
        assert said == [refusal, f"{name}: 1 message not delivered: no time was left"]
    finally:
        client.disconnect()
        client.loop_stop()


@mosquitto.needed
@pytest.mark.system
def test_what_came_while_a_broker_was_down_is_told_when_it_is_back(tmp_path: Path) -> None:
    said: list[str] = []
    port = free_port()
    topic = AlarmTopic(Broker("127.0.0.1", port, "plant/alarms"), said.append)
    for number in range(3):
        topic.put(b"%d" % number)
    wait_for(lambda: said)
    with mosquitto.running(tmp_path, "allow_anonymous true", port):
        topic.put(b"3")
        wait_for(topic._client.is_connected)
        topic.close()
    assert said == [f"MQTT broker at 127.0.0.1:{port}: it cannot be reached; trying again"]


def test_a_broker_that_is_not_there_holds_nobody_up(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(mqtt, "MOST_WAITING", 2)
    monkeypatch.setattr(mqtt, "_LAST_TRY", 0.1)
    said: list[str] = []
    topic = AlarmTopic(Broker("127.0.0.1", 9, "a", timeout=0.1), said.append)
    for _ in range(3):
        topic.put(b"{}")
    topic.close()
    name = "MQTT broker at 127.0.0.1:9"
    assert {f"{name}: a message is lost: 2 wait already", f"{name}: 2 messages not delivered: no time was left"} <= {
        *said
    }

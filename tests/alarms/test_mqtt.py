"""Alarms reach a broker that others wrote."""

from __future__ import annotations

import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest
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
    said: list[str] = []
    with mosquitto.listening(port, "plant/#", "right") as (_, heard):
        topic = AlarmTopic(Broker("127.0.0.1", port, "plant/alarms", "me", "right"), said.append)
        for line in (b'{"event": "raised"}', b'{"event": "cleared"}'):
            topic.put(line)
            assert heard.get(timeout=30).payload == line
        topic.close()
    assert said == []
    refused = AlarmTopic(Broker("127.0.0.1", port, "plant/alarms", "me", "wrong"), said.append)
    refused.put(b"{}")
    refused.close()
    name = f"MQTT broker at 127.0.0.1:{port}"
    refusal = f"{name}: it refuses the connection: Not authorized"
    assert said == [refusal, f"{name}: 1 message not delivered: no time was left"]


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
    for line in ("a message is lost: 2 wait already", "2 messages not delivered: no time was left"):
        assert f"{name}: {line}" in said

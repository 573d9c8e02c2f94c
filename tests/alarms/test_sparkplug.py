"""Sparkplug B: what a broker and a decoder that others wrote get of the plant."""

from __future__ import annotations

import socket
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from sparkplub_b_packets.core.sparkplug_b_pb2 import Payload
from tests.alarms import mosquitto

from irtwin.alarms.mqtt import Broker
from irtwin.alarms.sparkplug import EdgeNode, payload

ARM = {"robot": "Arm/1", "energy_Wh": 12.5, "power_W": None, "state": "moving"}


def decoded(message: bytes) -> tuple[int | None, dict[str, Any]]:
    """Return sequence number and metrics by name; None: null."""
    told = Payload()
    told.ParseFromString(message)
    assert abs(told.timestamp / 1000 - time.time()) < 60.0
    values = {8: "long_value", 10: "double_value", 11: "boolean_value", 12: "string_value"}
    metrics = {it.name: None if it.is_null else getattr(it, values[it.datatype]) for it in told.metrics}
    return told.seq if told.HasField("seq") else None, metrics


@pytest.fixture
def port(tmp_path: Path) -> Iterator[int]:
    with mosquitto.running(tmp_path, "allow_anonymous true") as port:
        yield port


@mosquitto.needed
@pytest.mark.system
def test_births_data_and_deaths_reach_a_host_in_order(port: int) -> None:
    said: list[str] = []
    born = {"Energy/Wh": 12.5, "Power/W": None, "State": "moving"}
    with mosquitto.listening(port, "spBv1.0/#") as (host, heard):

        def told() -> tuple[str, tuple[int | None, dict[str, Any]]]:
            message = heard.get(timeout=30)
            return message.topic.removeprefix("spBv1.0/plant/"), decoded(message.payload)

        node = EdgeNode(Broker("127.0.0.1", port, "plant/irtwin"), said.append)
        assert told() == ("NBIRTH/irtwin", (0, {"bdSeq": 0, "Node Control/Rebirth": False}))
        node.tell([ARM])
        assert told() == ("DBIRTH/irtwin/Arm_1", (1, born))
        node.tell([ARM])
        node.tell([ARM | {"power_W": 300.0}])
        assert told() == ("DDATA/irtwin/Arm_1", (2, {"Power/W": 300.0}))
        host.publish("spBv1.0/plant/NCMD/irtwin", payload([("Node Control/Rebirth", 11, True)]))
        assert [told()[0], told()[0]] == ["NCMD/irtwin", "NBIRTH/irtwin"]
        assert told() == ("DBIRTH/irtwin/Arm_1", (1, born | {"Power/W": 300.0}))
        node.tell([])
        assert told() == ("DDEATH/irtwin/Arm_1", (2, {}))
        node._client.socket().shutdown(socket.SHUT_RDWR)  # it breaks: the broker tells the death that was left with it
        assert told() == ("NDEATH/irtwin", (None, {"bdSeq": 0}))
        assert told() == ("NBIRTH/irtwin", (0, {"bdSeq": 1, "Node Control/Rebirth": False}))
        assert "the connection is lost" in said[0]
        node.close()
        assert told() == ("NDEATH/irtwin", (None, {"bdSeq": 1}))


def test_a_broker_that_is_not_there_holds_nobody_up() -> None:
    node = EdgeNode(Broker("127.0.0.1", 9, "plant/irtwin"), print)
    node.tell([ARM])
    node.close()


def test_large_numbers_and_letters_beyond_ascii_are_read_back() -> None:
    metrics = [("Käfer", 12, "läuft"), ("n", 8, 2**63 + 5), ("x", 10, -1e300)]
    assert decoded(payload(metrics, 255)) == (255, {"Käfer": "läuft", "n": 2**63 + 5, "x": -1e300})

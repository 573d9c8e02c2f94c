"""The broker that Debian ships, on a port of its own, and who listens to it."""

from __future__ import annotations

import queue
import shutil
import socket
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import paho.mqtt.client as paho
import pytest
from paho.mqtt.enums import CallbackAPIVersion
from tests.sparql_servers import free_port

_PROGRAM = shutil.which("mosquitto", path="/usr/sbin:/usr/bin:/usr/local/sbin:/usr/local/bin")
needed = pytest.mark.skipif(_PROGRAM is None, reason="needs mosquitto (Debian: apt install mosquitto)")


@contextmanager
def running(folder: Path, who: str, port: int | None = None) -> Iterator[int]:
    """Run a broker until the block ends, and give its port; `who` may connect, as its settings say it."""
    port, settings = port or free_port(), folder / "mosquitto.conf"
    settings.write_text(f"listener {port} 127.0.0.1\n{who}\nuser root\n")
    assert _PROGRAM is not None
    broker = subprocess.Popen([_PROGRAM, "-c", settings], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        for _ in range(500):
            with socket.socket() as trying:
                if trying.connect_ex(("127.0.0.1", port)) == 0:
                    break
            time.sleep(0.02)
        yield port
    finally:
        broker.terminate()
        broker.wait()


@contextmanager
def listening(
    port: int, topic: str, password: str | None = None
) -> Iterator[tuple[paho.Client, queue.Queue[paho.MQTTMessage]]]:
    """Listen to topics until the block ends; give the client, and what it has heard."""
    heard: queue.Queue[paho.MQTTMessage] = queue.Queue()
    ready: queue.Queue[None] = queue.Queue()
    client = paho.Client(CallbackAPIVersion.VERSION2)
    if password is not None:
        client.username_pw_set("me", password)
    client.on_connect = lambda *_: client.subscribe(topic, qos=1)
    client.on_subscribe = lambda *_: ready.put(None)
    client.on_message = lambda _client, _data, message: heard.put(message)
    client.connect("127.0.0.1", port)
    client.loop_start()
    try:
        ready.get(timeout=30)
        yield client, heard
    finally:
        client.disconnect()
        client.loop_stop()

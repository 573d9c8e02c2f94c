"""A controller of Universal Robots that is not there: it speaks RTDE, version 2, as the maker documents it."""

from __future__ import annotations

import math
import socketserver
import struct
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

KINDS = {
    "timestamp": "DOUBLE",
    "payload": "DOUBLE",
    "actual_robot_voltage": "DOUBLE",
    "actual_robot_current": "DOUBLE",
    "actual_q": "VECTOR6D",
    "actual_qd": "VECTOR6D",
    "actual_current": "VECTOR6D",
    "joint_temperatures": "VECTOR6D",
}


@dataclass
class Controller:
    """What it knows, and what becomes of its clients.

    values: of a variable at a time, s since it started; lacking: variables that it has not; `spoilt`: bytes that it
    sends at a sample instead; `breaks`: samples after which it closes a client's connection; `quiet`: after which it
    says nothing more.
    """

    step: float = 0.008
    samples: int = 10**9
    version: int = 2
    lacking: tuple[str, ...] = ()
    breaks: int | None = None
    quiet: int | None = None
    spoilt: dict[int, bytes] = field(default_factory=dict)
    times: dict[int, float] = field(default_factory=dict)
    asked: list[list[str]] = field(default_factory=list)
    sent: int = 0

    def value(self, name: str, sample: int) -> list[float]:
        """Return a variable's values at a sample."""
        time = self.times.get(sample, 1000.0 + sample * self.step)
        return {
            "timestamp": [time],
            "payload": [1.5],
            "actual_robot_voltage": [48.0],
            "actual_robot_current": [2.0 + math.sin(sample / 50.0)],
            "actual_q": [math.sin(sample / 30.0 + joint) for joint in range(6)],
            "actual_qd": [math.cos(sample / 30.0 + joint) for joint in range(6)],
            "actual_current": [0.5 * joint - 0.2 for joint in range(6)],
            "joint_temperatures": [30.0 + joint for joint in range(6)],
        }[name]


def package(kind: str, content: bytes) -> bytes:
    return struct.pack(">HB", 3 + len(content), ord(kind)) + content


@contextmanager
def serving(controller: Controller, port: int = 0) -> Iterator[int]:
    """Give the port of this machine on which a controller answers."""

    class Handler(socketserver.StreamRequestHandler):
        def handle(self) -> None:
            try:
                _talk(controller, self.rfile, self.wfile)
            except (ConnectionError, struct.error):
                return  # the client has gone

    class Server(socketserver.ThreadingTCPServer):
        allow_reuse_address = True
        daemon_threads = True

    with Server(("127.0.0.1", port), Handler) as server:
        threading.Thread(target=server.serve_forever, args=(0.01,), daemon=True).start()
        try:
            yield int(server.server_address[1])
        finally:
            server.shutdown()


def _talk(controller: Controller, reading: Any, writing: Any) -> None:
    names: list[str] = []
    while True:
        size, kind = struct.unpack(">HB", reading.read(3))
        content = reading.read(size - 3)
        if kind == ord("V"):
            writing.write(package("V", bytes([struct.unpack(">H", content)[0] == controller.version])))
        elif kind == ord("v"):
            writing.write(package("v", struct.pack(">4I", 5, 13, 0, 0)))  # PolyScope's
        elif kind == ord("O"):
            names = [name for name in content[8:].decode().split(",") if name]
            controller.asked.append(names)
            kinds = ["NOT_FOUND" if name in controller.lacking else KINDS[name] for name in names]
            text = b"hello"
            writing.write(package("M", bytes([len(text)]) + text + b"\x00\x03"))  # not what was asked, and allowed
            writing.write(package("O", b"\x07" + ",".join(kinds).encode()))
        elif kind == ord("S"):
            writing.write(package("S", b"\x01"))
            _stream(controller, names, writing)
            return


def _stream(controller: Controller, names: list[str], writing: Any) -> None:
    begun = time.monotonic()
    for row in range(controller.samples):
        if controller.breaks is not None and row >= controller.breaks:
            return
        if controller.quiet is not None and row >= controller.quiet:
            time.sleep(30.0)
            return
        values = [value for name in names for value in controller.value(name, controller.sent)]
        content = b"\x07" + struct.pack(f">{len(values)}d", *values)
        writing.write(controller.spoilt.get(controller.sent, package("U", content)))
        controller.sent += 1
        time.sleep(max(0.0, begun + row * controller.step - time.monotonic()))
    time.sleep(30.0)

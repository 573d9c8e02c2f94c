"""Samples for who looks on: each state as it is taken, and what the twin says of it, as JSON lines on a Unix socket.

The socket lies in the workspace, so that who may read that may look on. Who reads too slowly is let go: watching waits
for nobody.
"""

from __future__ import annotations

import json
import math
import os
import socket
import threading
from collections import deque
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path

import numpy as np

from irtwin.live.joint_stream import State
from irtwin.twin.so_far import WatchedStretch

SOCKET = "samples.sock"
_HELD = 1000  # lines that wait to be sent
_MOST = 8  # who may look on: `irtwin serve` is one
_BUFFER = 1 << 18  # bytes that the system holds for each


class Broadcast:
    """Sends to all who are connected, in a thread of its own; used as a context. Its folder is made if need be."""

    def __init__(self, folder: Path) -> None:
        folder.mkdir(parents=True, exist_ok=True)
        self._path = folder / SOCKET
        self._lines: deque[bytes | State] = deque(maxlen=_HELD)
        self._clients: list[socket.socket] = []
        self._news = threading.Event()
        self._over = False

    def __enter__(self) -> Broadcast:
        """Begin to listen."""
        self._path.unlink(missing_ok=True)
        self._listening = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        with reachable(self._path) as address:
            self._listening.bind(address)
        self._path.chmod(0o600)
        self._listening.listen()
        self._threads = [threading.Thread(target=work, daemon=True) for work in (self._admit, self._send)]
        for thread in self._threads:
            thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        """Let everybody go."""
        self._over = True
        self._news.set()
        with suppress(OSError):
            self._listening.shutdown(socket.SHUT_RDWR)
        self._listening.close()
        for thread in self._threads:
            thread.join(2.0)
        for client in self._clients:
            client.close()
        self._path.unlink(missing_ok=True)

    def state(self, state: State) -> None:
        """Tell of a state that was taken."""
        if self._clients:
            self._lines.append(state)
            self._news.set()

    def stretches(self, robot_id: str, stretches: Sequence[WatchedStretch]) -> None:
        """Tell what the twin says of a while ago: times, s since 1970, and power, W."""
        if self._clients:
            for one in stretches:
                new = slice(0 if one.begins else 1, None)
                modelled = {"time": _rounded(one.motion.time[new]), "power": _rounded(one.power[new])}
                self._lines.append(json.dumps({"robot": robot_id, "modelled": modelled}).encode() + b"\n")
            self._news.set()

    def _admit(self) -> None:
        while not self._over:
            try:
                client, _ = self._listening.accept()
            except OSError:
                return
            if len(self._clients) >= _MOST:
                client.close()
                continue
            client.setblocking(False)
            client.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, _BUFFER)
            self._clients = [*self._clients, client]

    def _send(self) -> None:
        while not self._over:
            self._news.wait()
            self._news.clear()
            while self._lines:
                line = self._lines.popleft()
                self._give(_line(line) if isinstance(line, State) else line)

    def _give(self, line: bytes) -> None:
        for client in self._clients:
            try:
                sent = client.send(line)
            except OSError:
                sent = 0
            if sent < len(line):  # it is gone, or reads too slowly
                self._clients = [other for other in self._clients if other is not client]
                client.close()


@contextmanager
def reachable(path: Path) -> Iterator[str]:
    """Give an address for a Unix socket at a path that may be longer than the 107 bytes that one may have."""
    if len(os.fsencode(path)) < 100:
        yield str(path)
        return
    folder = os.open(path.parent, os.O_RDONLY | os.O_DIRECTORY)
    try:
        yield f"/proc/self/fd/{folder}/{path.name}"
    finally:
        os.close(folder)


def _line(state: State) -> bytes:
    power = state.of("power")[0]
    values = {
        "robot": state.robot_id,
        "time": state.time,
        "q": state.of("q"),
        "power": None if math.isnan(power) else power,
    }
    return json.dumps(values, separators=(",", ":")).encode() + b"\n"


def _rounded(values: np.ndarray) -> list[float]:
    return [round(value, 4) for value in values.tolist()]

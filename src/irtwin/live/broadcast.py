"""Samples for who looks on: each state as it is taken, and what the twin says of it, as JSON lines on a Unix socket.

The socket lies in the workspace, so that who may read that may look on. Who reads too slowly is let go: watching waits
for nobody. Who writes a robot's identifier to a second socket gets one line of its last minutes.
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
from irtwin.live.recent import Recent
from irtwin.twin.so_far import WatchedStretch

SOCKET = "samples.sock"
RECENT_SOCKET = "recent.sock"
_HELD = 1000  # lines that wait to be sent
_MOST = 8  # who may look on: `irtwin serve` is one
_BUFFER = 1 << 18  # bytes that the system holds for each
_ASKING = 1.0  # s that who asks for the last minutes may take
_LONGEST_QUESTION = 1000  # bytes


class Broadcast:
    """Sends to all who are connected, in a thread of its own; used as a context. Its folder is made if need be."""

    def __init__(self, folder: Path) -> None:
        folder.mkdir(parents=True, exist_ok=True)
        self._path, self._recent_path = folder / SOCKET, folder / RECENT_SOCKET
        self._recent = Recent()
        self._newest: dict[str, State] = {}
        self._lines: deque[bytes | State] = deque(maxlen=_HELD)
        self._clients: list[socket.socket] = []
        self._news = threading.Event()
        self._over = False

    def __enter__(self) -> Broadcast:
        """Begin to listen."""
        self._listening, self._asked = _listening(self._path), _listening(self._recent_path)
        work = (self._admit, self._send, self._recall)
        self._threads = [threading.Thread(target=each, daemon=True) for each in work]
        for thread in self._threads:
            thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        """Let everybody go."""
        self._over = True
        self._news.set()
        for listening in (self._listening, self._asked):
            with suppress(OSError):
                listening.shutdown(socket.SHUT_RDWR)
            listening.close()
        for thread in self._threads:
            thread.join(2.0)
        for client in self._clients:
            client.close()
        self._path.unlink(missing_ok=True)
        self._recent_path.unlink(missing_ok=True)

    def state(self, state: State) -> None:
        """Tell of a state that was taken."""
        self._newest[state.robot_id] = state
        power = state.of("power")[0]
        if not math.isnan(power):
            self._recent.add(state.robot_id, "measured", (state.time,), (power,))
        if self._clients:
            self._lines.append(state)
            self._news.set()

    def stretches(self, robot_id: str, stretches: Sequence[WatchedStretch]) -> None:
        """Tell what the twin says of a while ago: times, s since 1970, and power, W."""
        for one in stretches:
            new = slice(0 if one.begins else 1, None)
            times, power = _rounded(one.motion.time[new]), _rounded(one.power[new])
            self._recent.add(robot_id, "modelled", times, power)
            if self._clients:
                self._lines.append(_encoded({"robot": robot_id, "modelled": {"time": times, "power": power}}))
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

    def _recall(self) -> None:
        while not self._over:
            try:
                client, _ = self._asked.accept()
            except OSError:
                return
            client.settimeout(_ASKING)
            with client, suppress(OSError, ValueError), client.makefile("rb") as question:
                client.sendall(self._last_minutes(question.readline(_LONGEST_QUESTION).decode().rstrip("\n")))

    def _last_minutes(self, robot_id: str) -> bytes:
        curves = {}
        for name in ("measured", "modelled"):
            times, power = self._recent.points(robot_id, name).T
            curves[name] = {"time": _rounded(times), "power": _rounded(power)}
        newest = self._newest.get(robot_id)
        return _encoded({"robot": robot_id, "recent": curves, "newest": None if newest is None else _told(newest)})

    def _send(self) -> None:
        while not self._over:
            self._news.wait()
            self._news.clear()
            while self._lines:
                line = self._lines.popleft()
                self._give(_encoded(_told(line)) if isinstance(line, State) else line)

    def _give(self, line: bytes) -> None:
        for client in self._clients:
            try:
                sent = client.send(line)
            except OSError:
                sent = 0
            if sent < len(line):  # it is gone, or reads too slowly
                self._clients = [other for other in self._clients if other is not client]
                client.close()


def _listening(path: Path) -> socket.socket:
    """Return a socket that listens there, for its owner alone; one that a crash left goes."""
    path.unlink(missing_ok=True)
    listening = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
    with reachable(path) as address:
        listening.bind(address)
    path.chmod(0o600)
    listening.listen()
    return listening


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


def _told(state: State) -> dict[str, object]:
    power = state.of("power")[0]
    return {
        "robot": state.robot_id,
        "time": state.time,
        "q": state.of("q"),
        "power": None if math.isnan(power) else power,
    }


def _encoded(said: dict[str, object]) -> bytes:
    return json.dumps(said, separators=(",", ":")).encode() + b"\n"


def _rounded(values: np.ndarray) -> list[float]:
    return [round(value, 4) for value in values.tolist()]

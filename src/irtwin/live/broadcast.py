"""Samples for who looks on: each state as it is taken, and what the twin says of it, as JSON lines on a Unix socket.

The socket lies in the workspace, so that who may read that may look on. Who writes a robot's identifier to it gets one
line of the robot's last minutes, then what comes. Who reads too slowly is let go: watching waits for nobody.
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
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from irtwin.live.joint_stream import State
from irtwin.live.recent import Curve
from irtwin.twin.so_far import WatchedStretch

SOCKET = "samples.sock"
_HELD = 1000  # lines that wait to be sent
_MOST = 20  # who may look on: each page of `irtwin serve` is one
_BUFFER = 1 << 18  # bytes that the system holds for each
_ASKING = 1.0  # s that may pass until a robot is named, and its last minutes are taken
_LONGEST_NAME = 1000  # bytes


@dataclass(eq=False)
class _Client:
    """Who looks on at a robot; `held` is what came until its last minutes were sent: it is `begun` then."""

    robot_id: str
    socket: socket.socket
    held: bytes = b""
    begun: bool = False


class Broadcast:
    """Sends to all who are connected, in a thread of its own; used as a context. Its folder is made if need be."""

    def __init__(self, folder: Path) -> None:
        folder.mkdir(parents=True, exist_ok=True)
        self._path = folder / SOCKET
        self._curves: dict[tuple[str, str], Curve] = {}  # of power, W, by robot_id and name
        self._remembering = threading.Lock()
        self._newest: dict[str, State] = {}
        self._lines: deque[tuple[str, bytes | State]] = deque(maxlen=_HELD)
        self._clients: list[_Client] = []
        self._news = threading.Event()
        self._over = False

    def __enter__(self) -> Broadcast:
        """Begin to listen."""
        self._listening = _listening(self._path)
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
            client.socket.close()
        self._path.unlink(missing_ok=True)

    def state(self, state: State) -> None:
        """Tell of a state that was taken."""
        self._newest[state.robot_id] = state
        power = state.of("power")[0]
        if not math.isnan(power):
            self._remember(state.robot_id, "measured", (state.time,), (power,))
        self._tell(state.robot_id, state)

    def stretches(self, robot_id: str, stretches: Sequence[WatchedStretch]) -> None:
        """Tell what the twin says of a while ago: times, s since 1970, and power, W."""
        for stretch in stretches:
            new = slice(0 if stretch.begins else 1, None)
            times, power = _rounded(stretch.motion.time[new]), _rounded(stretch.power[new])
            self._remember(robot_id, "modelled", times, power)
            self._tell(robot_id, _encoded({"robot": robot_id, "modelled": {"time": times, "power": power}}))

    def _remember(self, robot_id: str, name: str, times: Sequence[float], powers: Sequence[float]) -> None:
        with self._remembering:
            curve = self._curves.setdefault((robot_id, name), Curve())
            for time, power in zip(times, powers, strict=True):
                curve.add(time, power)

    def _tell(self, robot_id: str, line: bytes | State) -> None:
        if any(client.robot_id == robot_id for client in self._clients):
            self._lines.append((robot_id, line))
            self._news.set()

    def _admit(self) -> None:
        while not self._over:
            try:
                accepted, _ = self._listening.accept()
            except OSError:
                return
            if len(self._clients) >= _MOST or not self._begin(accepted):
                accepted.close()

    def _begin(self, accepted: socket.socket) -> bool:
        """Send a robot's last minutes, with what comes meanwhile held for afterwards; return whether that was read."""
        accepted.settimeout(_ASKING)
        accepted.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, _BUFFER)
        try:
            with accepted.makefile("rb") as asked:
                client = _Client(asked.readline(_LONGEST_NAME).decode().rstrip("\n"), accepted)
            self._clients.append(client)
            accepted.sendall(self._last_minutes(client.robot_id))
        except (OSError, ValueError):
            self._clients[:] = [other for other in self._clients if other.socket is not accepted]
            return False
        accepted.setblocking(False)
        client.begun = True
        return True

    def _last_minutes(self, robot_id: str) -> bytes:
        curves = {}
        for name in ("measured", "modelled"):
            with self._remembering:
                times, power = self._curves.get((robot_id, name), Curve()).points().T
            curves[name] = {"time": _rounded(times), "power": _rounded(power)}
        newest = self._newest.get(robot_id)
        return _encoded({"robot": robot_id, "recent": curves, "newest": None if newest is None else _told(newest)})

    def _send(self) -> None:
        while not self._over:
            self._news.wait()
            self._news.clear()
            while self._lines:
                robot_id, line = self._lines.popleft()
                self._give(robot_id, _encoded(_told(line)) if isinstance(line, State) else line)

    def _give(self, robot_id: str, line: bytes) -> None:
        for client in [connected for connected in self._clients if connected.robot_id == robot_id]:
            client.held += line
            if not client.begun:
                continue
            try:
                sent = client.socket.send(client.held)
            except OSError:
                sent = 0
            if sent < len(client.held):  # it is gone, or reads too slowly
                self._clients.remove(client)
                client.socket.close()
            client.held = b""


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


def _encoded(message: dict[str, object]) -> bytes:
    return json.dumps(message, separators=(",", ":")).encode() + b"\n"


def _rounded(values: np.ndarray) -> list[float]:
    return [round(value, 4) for value in values.tolist()]

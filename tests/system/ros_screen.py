"""ROS 1 with RViz on a screen of its own: processes that end with the test, and the picture that they draw."""

from __future__ import annotations

import os
import signal
import socket
import struct
import subprocess
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np

WIDTH, HEIGHT = 1200, 800  # px: of the window in the RViz file


@dataclass(frozen=True)
class Screen:
    """What processes of ROS are to be started with, and where the screen's picture lies."""

    environment: Mapping[str, str]
    port: int
    buffer: Path

    def picture(self) -> np.ndarray:
        """Return what the screen shows: (HEIGHT, WIDTH, 3), red, green, blue."""
        raw = self.buffer.read_bytes()
        head = struct.unpack(">25I", raw[:100])  # X's window dump
        size, width, height, line, colours = head[0], head[4], head[5], head[12], head[19]
        start = size + 12 * colours
        pixels = np.frombuffer(raw, np.uint8, line * height, start).reshape(height, line)[:, : 4 * width]
        return np.array(pixels.reshape(height, width, 4)[:, :, 2::-1])


@contextmanager
def screen(folder: Path, packages: Path) -> Iterator[Screen]:
    """Give a screen on which ROS finds the packages of a folder."""
    with ExitStack() as stack:
        reading, writing = os.pipe()
        server = ["Xvfb", "-displayfd", str(writing), "-screen", "0", f"{WIDTH}x{HEIGHT}x24", "-nocursor"]
        stack.enter_context(
            started([*server, "-fbdir", str(folder)], dict(os.environ), folder / "xvfb.log", (writing,))
        )
        os.close(writing)
        with os.fdopen(reading) as pipe:
            display = pipe.readline().strip()
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            port = free.getsockname()[1]
        home = folder / "home"
        home.mkdir(mode=0o700)
        environment = dict.fromkeys(("HOME", "XDG_RUNTIME_DIR", "ROS_HOME", "ROS_LOG_DIR"), str(home)) | {
            "PATH": "/usr/bin:/bin",
            "DISPLAY": f":{display}",
            "LIBGL_ALWAYS_SOFTWARE": "1",
            "LANG": "C.UTF-8",
            "ROS_MASTER_URI": f"http://127.0.0.1:{port}",
            "ROS_IP": "127.0.0.1",
            "ROS_PACKAGE_PATH": f"{packages}:/usr/share",
        }
        yield Screen(environment, port, folder / "Xvfb_screen0")


@contextmanager
def started(
    command: list[str], environment: Mapping[str, str], log: Path, keep: tuple[int, ...] = ()
) -> Iterator[subprocess.Popen[bytes]]:
    """Give a process that is ended at the end, with all that it started."""
    with log.open("wb") as file:
        streams = {"stdin": subprocess.DEVNULL, "stdout": file, "stderr": file}
        process = subprocess.Popen(command, env=environment, **streams, pass_fds=keep, start_new_session=True)
    try:
        yield process
    finally:
        process.send_signal(signal.SIGINT)
        try:
            process.wait(20)
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, signal.SIGKILL)
            process.wait()

"""SPARQL servers of others, each in a process of its own that is gone at the end."""

from __future__ import annotations

import shutil
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from urllib.error import URLError
from urllib.request import Request, urlopen

import pytest


@dataclass(frozen=True)
class Running:
    """A server that answers, until `stop`."""

    url: str
    process: subprocess.Popen[bytes]

    def update(self, text: str) -> None:
        """Do a SPARQL update, without irtwin."""
        head = {"Content-Type": "application/sparql-update"}
        urlopen(Request(self.url.replace("/query", "/update"), text.encode(), head)).close()

    def stop(self) -> None:
        self.process.kill()
        self.process.wait()


@contextmanager
def oxigraph() -> Iterator[Running]:
    """Oxigraph's own server, with an empty graph in memory."""
    program = shutil.which("oxigraph", path=str(Path(sys.executable).parent)) or shutil.which("oxigraph")
    if program is None:
        pytest.skip("no oxigraph server on this machine: pip install oxigraph")
    address = f"127.0.0.1:{free_port()}"
    command = [program, "serve", "--bind", address]
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    running = Running(f"http://{address}/query", process)
    try:
        wait_for(f"http://{address}/", process)
        yield running
    finally:
        running.stop()


def free_port() -> int:
    """Return the number of a port that nobody listens on."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        return int(free.getsockname()[1])


def wait_for(url: str, process: subprocess.Popen[bytes], seconds: float = 60.0) -> None:
    """Return once a server answers at all."""
    give_up = time.monotonic() + seconds
    while time.monotonic() < give_up and process.poll() is None:
        try:
            urlopen(url).close()
            return
        except URLError:
            time.sleep(0.05)
    raise AssertionError(f"{process.args!r} does not answer at {url}")

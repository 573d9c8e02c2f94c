"""The broker that Debian ships, on a port of its own."""

from __future__ import annotations

import shutil
import socket
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
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

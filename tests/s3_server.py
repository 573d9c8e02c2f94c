"""An S3 server in a process of its own (moto's), gone at the end."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from urllib.request import Request, urlopen

import pytest

from tests.sparql_servers import Running, free_port, wait_for

KEYS = {
    "AWS_ACCESS_KEY_ID": "AKIAREFUSED",
    "AWS_SECRET_ACCESS_KEY": "told-to-nobody",
    "AWS_DEFAULT_REGION": "us-east-1",
}


@contextmanager
def s3_server() -> Iterator[Running]:
    """A server without any bucket, in memory."""
    pytest.importorskip("moto", reason="no S3 server on this machine: pip install moto[server]")
    port = free_port()
    command = [sys.executable, "-m", "moto.server", "-H", "127.0.0.1", "-p", str(port)]
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    running = Running(f"http://127.0.0.1:{port}", process)
    try:
        wait_for(f"{running.url}/moto-api/", process)
        yield running
    finally:
        running.stop()


@contextmanager
def checking_keys(server: Running) -> Iterator[None]:
    """Let the server look at keys; it knows none."""
    try:
        _let_pass(server, "0")
        yield
    finally:
        _let_pass(server, "inf")


def _let_pass(server: Running, actions: str) -> None:
    plain = {"Content-Type": "text/plain"}
    urlopen(Request(f"{server.url}/moto-api/reset-auth", actions.encode(), plain, method="POST")).close()

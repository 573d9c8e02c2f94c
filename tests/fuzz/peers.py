"""What answers on a port of this machine as no web server and no robot's server should: in a process of its own."""

from __future__ import annotations

import os
import signal
import socket
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager, suppress

import numpy as np
from tests.dripping import dripping, talking
from tests.fuzz.values import some

Peer = Callable[[np.random.Generator], AbstractContextManager[int]]


@contextmanager
def peer(name: str, seed: int) -> Iterator[int]:
    """Give the port on which one of `PEERS` answers."""
    said, saying = os.pipe()
    child = os.fork()
    if child == 0:
        with suppress(BaseException), PEERS[name](np.random.default_rng(seed)) as port:
            os.write(saying, str(port).encode())
            time.sleep(600)
        os._exit(0)
    os.close(saying)
    try:
        yield int(os.read(said, 9))
    finally:
        os.close(said)
        os.kill(child, signal.SIGKILL)
        os.waitpid(child, 0)


def saying(pieces: Sequence[bytes], every: float = 0.0, stays: float = 0.0) -> AbstractContextManager[int]:
    """Give the port where each client is told some pieces, each `every` s; it is left `stays` s later."""

    def talk(client: socket.socket) -> None:
        for piece in pieces:
            client.sendall(piece)
            time.sleep(every)
        time.sleep(stays)

    return talking(talk)


def _status(rng: np.random.Generator) -> AbstractContextManager[int]:
    """An answer of some status."""
    number = some(rng, ["200 OK", "204 No Content", "301 Moved", "302 Found", "400 No", "401 No", "404 No", "408 Late"])
    number = some(rng, [number, "429 Many", "500 Broken", "503 Busy", "999 What", "600", "99", "abc", "2000 OK", "-1"])
    where = some(rng, ["http://127.0.0.1:1/", "file:///etc/passwd", "//x", "http://[::1", "\x00", "x" * 9000])
    head = f"HTTP/1.1 {number}\r\nlocation: {where}\r\ncontent-length: 0\r\n\r\n".encode("latin-1")
    return saying([head], stays=0.2)


def _informs(rng: np.random.Generator) -> AbstractContextManager[int]:
    """One 103 after the other, and perhaps an answer at last."""
    last = b"HTTP/1.1 200 OK\r\ncontent-length: 2\r\n\r\nok"
    return saying([b"HTTP/1.1 103 Early Hints\r\nlink: </x>\r\n\r\n"] * int(rng.integers(1, 40)) + [last], every=0.02)


def _body(rng: np.random.Generator) -> AbstractContextManager[int]:
    """A body that is huge, or not as the head says."""
    head = some(rng, [b"content-length: 99999999999", b"content-length: -1", b"transfer-encoding: chunked", b"x: y"])
    pieces = [b"x" * 1_000_000] * 20 if rng.integers(2) else [b"ffffffff\r\n" + b"x" * 100, b"zz\r\n", b"0\r\n\r\n"]
    coded = some(rng, [b"", b"content-encoding: gzip\r\n", b"content-encoding: zstd, br\r\n"])
    return saying([b"HTTP/1.1 200 OK\r\n" + coded + head + b"\r\n\r\n", *pieces])


def _junk(rng: np.random.Generator) -> AbstractContextManager[int]:
    """Bytes that are nothing, or nothing at all."""
    pieces = [rng.bytes(int(rng.integers(1, 3000))) for _ in range(rng.integers(4))]
    pieces += [
        some(rng, [b"", b"HTTP/1.1", b"HTTP/1.1 200 OK\r\n" + b"a: b\r\n" * 9000, b"SSH-2.0-x\r\n", b"\r\n" * 999])
    ]
    return saying(pieces, every=0.01, stays=float(some(rng, [0.0, 5.0])))


def _drips(rng: np.random.Generator) -> AbstractContextManager[int]:
    """A byte now and then."""
    first = some(rng, [b"", b"HTTP/1.1 200 OK\r\n", b"HTTP/1.1 200 OK\r\ncontent-length: 9999\r\n\r\n", b"\x00\x05V"])
    return dripping(some(rng, [b"x", b"a: b\r\n", b"\0", b"\r\n"]), float(some(rng, [0.01, 0.1, 0.4])), first)


OF_WEB: dict[str, Peer] = {"status": _status, "informs": _informs, "body": _body, "junk": _junk, "drips": _drips}
OF_ROBOT: dict[str, Peer] = {"junk": _junk, "drips": _drips}
PEERS = OF_WEB | OF_ROBOT

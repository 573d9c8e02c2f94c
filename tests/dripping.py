"""A peer that sends a byte now and then, and so never ends what waits for each byte alone."""

from __future__ import annotations

import socket
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress


@contextmanager
def talking(talk: Callable[[socket.socket], None]) -> Iterator[int]:
    """Give the port of this machine where each client is talked to, in a thread of its own, until it is gone."""

    def alone(client: socket.socket) -> None:
        with client, suppress(OSError):
            talk(client)

    def answer(server: socket.socket) -> None:
        with suppress(OSError):
            while True:
                threading.Thread(target=alone, args=(server.accept()[0],), daemon=True).start()

    with socket.create_server(("127.0.0.1", 0)) as server:
        threading.Thread(target=answer, args=(server,), daemon=True).start()
        yield server.getsockname()[1]
        server.shutdown(socket.SHUT_RDWR)


@contextmanager
def dripping(what: bytes, every: float, first: bytes = b"") -> Iterator[int]:
    """Give the port of this machine where each client gets `first`, then `what` again and again, each `every` s."""
    over = threading.Event()

    def talk(client: socket.socket) -> None:
        client.sendall(first)
        while not over.wait(every):
            client.sendall(what)

    with talking(talk) as port:
        yield port
        over.set()

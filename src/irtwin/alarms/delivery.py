"""Messages on their way to one receiver, in a thread of its own: again where it is down, and said where in vain."""

from __future__ import annotations

import queue
import threading
from collections.abc import Callable
from typing import Protocol

TRIES = 5
FIRST_PAUSE = 1.0  # s before the second try; each pause is twice the one before
PATIENCE = 10.0  # s that messages have when no more will come
_MOST_WAITING = 1000
Announce = Callable[[str], None]


class Undelivered(Exception):
    """A receiver did not take a message; `lasting` where another try would end the same."""

    def __init__(self, reason: str, *, lasting: bool = False) -> None:
        super().__init__(reason)
        self.lasting = lasting


class Receiver(Protocol):
    """Somebody who is told; `name` says who in messages, and holds no secret; `patience`: s that a message may take."""

    @property
    def name(self) -> str:
        """Who it is."""

    @property
    def patience(self) -> float:
        """How long handing over a message may take in all, s: what waits for each byte alone may wait for ever."""

    def send(self, line: bytes) -> None:
        """Hand over a message, a JSON object. Raises Undelivered."""


class Delivery:
    """Takes messages to a receiver; nobody waits for it. What could not be delivered is announced and counted."""

    def __init__(self, receiver: Receiver, announce: Announce) -> None:
        self._receiver, self._announce = receiver, announce
        self._waiting: queue.Queue[bytes | None] = queue.Queue()
        self._hurry = threading.Event()  # no more pauses
        self._held: threading.Thread | None = None  # a try that did not end in time
        self.lost = 0
        self._thread = threading.Thread(target=self._work, daemon=True)
        self._thread.start()

    def put(self, line: bytes) -> None:
        """Take a message; where too many wait, it is lost, and that is announced."""
        if self._waiting.qsize() >= _MOST_WAITING:
            self._lose(f"{_MOST_WAITING} messages wait already")
        else:
            self._waiting.put(line)

    def close(self, patience: float = PATIENCE) -> None:
        """Give each message that waits one more try, all together `patience` seconds; announce what is left."""
        self._hurry.set()
        self._waiting.put(None)
        self._thread.join(patience)
        left = self._waiting.qsize()
        if self._thread.is_alive() and left:
            self.lost += left
            self._announce(f"{self._receiver.name}: {left} message{'s' * (left != 1)} not delivered: no time was left")

    def _work(self) -> None:
        while (line := self._waiting.get()) is not None:
            self._deliver(line)

    def _deliver(self, line: bytes) -> None:
        pause = FIRST_PAUSE
        for tried in range(1, TRIES + 1):
            try:
                return self._send(line)
            except Undelivered as error:
                if tried == TRIES or error.lasting or self._hurry.wait(pause):
                    return self._lose(f"{error}; tried {tried} time{'s' * (tried != 1)}")
            pause *= 2

    def _send(self, line: bytes) -> None:
        """Hand over a message in a thread that may be left behind. Raises Undelivered, also where it takes too long."""
        if self._held is not None and self._held.is_alive():
            raise Undelivered("it still holds the connection of an earlier message")
        outcome: queue.Queue[Exception | None] = queue.Queue(1)
        trying = threading.Thread(target=self._try, args=(line, outcome), daemon=True)
        trying.start()
        try:
            fault = outcome.get(timeout=self._receiver.patience)
        except queue.Empty:
            self._held = trying
            raise Undelivered(f"not done within {self._receiver.patience:g} s") from None
        if fault is not None:
            raise fault

    def _try(self, line: bytes, outcome: queue.Queue[Exception | None]) -> None:
        try:
            self._receiver.send(line)
        except Exception as error:  # raised where the message is waited for
            outcome.put(error)
        else:
            outcome.put(None)

    def _lose(self, reason: str) -> None:
        self.lost += 1
        self._announce(f"{self._receiver.name}: a message could not be delivered: {reason}")

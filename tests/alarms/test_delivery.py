"""A receiver that is down is tried again, holds nobody up, and what it did not get is said."""

from __future__ import annotations

import threading
from collections.abc import Iterator

import pytest

from irtwin.alarms import delivery
from irtwin.alarms.delivery import Delivery, Undelivered


class Deaf:
    """Refuses the first so many messages."""

    name, patience = "somebody", 30.0

    def __init__(self, refusals: int, lasting: bool = False) -> None:
        self.refusals, self.lasting = refusals, lasting
        self.got: list[bytes] = []
        self.tried = 0

    def send(self, line: bytes) -> None:
        self.tried += 1
        if self.tried <= self.refusals:
            raise Undelivered("it is down", lasting=self.lasting)
        self.got.append(line)


class Stuck:
    """Never comes back from a message until it is let go."""

    name, patience = "somebody", 30.0

    def __init__(self) -> None:
        self.held, self.go = threading.Event(), threading.Event()

    def send(self, line: bytes) -> None:
        self.held.set()
        self.go.wait(30)


@pytest.fixture(autouse=True)
def soon(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    monkeypatch.setattr(delivery, "FIRST_PAUSE", 0.001)
    yield


def given(receiver: Deaf, *lines: bytes) -> tuple[Delivery, list[str]]:
    said: list[str] = []
    taking = Delivery(receiver, said.append)
    for line in lines:
        taking.put(line)
    taking._waiting.put(None)  # as at the end, but with its pauses
    taking._thread.join(30)
    return taking, said


def test_messages_come_in_their_order_after_a_receiver_was_down() -> None:
    receiver = Deaf(refusals=3)
    taking, said = given(receiver, b"1", b"2")
    assert (receiver.got, taking.lost, said) == ([b"1", b"2"], 0, [])


def test_after_five_tries_a_message_is_lost_and_said_and_the_next_is_tried() -> None:
    receiver = Deaf(refusals=5)
    taking, said = given(receiver, b"1", b"2")
    assert (receiver.got, taking.lost) == ([b"2"], 1)
    assert said == ["somebody: a message could not be delivered: it is down; tried 5 times"]


def test_what_would_be_refused_again_is_not_tried_again() -> None:
    _, said = given(Deaf(refusals=1, lasting=True), b"1")
    assert said == ["somebody: a message could not be delivered: it is down; tried 1 time"]


def test_nobody_waits_for_a_receiver_that_is_stuck(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(delivery, "_MOST_WAITING", 3)
    receiver, said = Stuck(), list[str]()
    taking = Delivery(receiver, said.append)
    taking.put(b"0")
    assert receiver.held.wait(30)
    for number in range(5):
        taking.put(b"%d" % number)
    taking.close(patience=0.01)
    receiver.go.set()
    assert said == [
        *["somebody: a message could not be delivered: 3 messages wait already"] * 2,
        "somebody: 4 messages not delivered: no time was left",
    ]
    assert taking.lost == 6


def test_a_message_that_is_not_done_in_time_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    receiver = Stuck()
    receiver.patience = 0.1
    taking, said = given(receiver, b"1", b"2")
    receiver.go.set()
    assert taking.lost == 2
    held = "it still holds the connection of an earlier message"
    assert said == [f"somebody: a message could not be delivered: {held}; tried 5 times"] * 2


class Broken(Deaf):
    """Has a bug."""

    def send(self, line: bytes) -> None:
        raise KeyError("a bug")


def test_a_bug_of_a_receiver_keeps_its_traceback(monkeypatch: pytest.MonkeyPatch) -> None:
    raised: list[object] = []
    monkeypatch.setattr(threading, "excepthook", lambda it: raised.append(it.exc_type))
    given(Broken(0), b"1")
    assert raised == [KeyError]

"""A controller of one robot that is connected to: its states, over connections that are lost and made again."""

from __future__ import annotations

import threading
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator
from typing import ClassVar

from irtwin.errors import InputError
from irtwin.live.joint_stream import State

AGAIN = 1.0  # s until the next try to connect


class Controller(ABC):
    """A source of one robot's states at an address; `what` says which values come."""

    address: str
    what: str
    lost: ClassVar[tuple[type[BaseException], ...]]  # what is raised where a connection breaks

    def states(self, done: threading.Event, announce: Callable[[str], None]) -> Iterator[State | InputError]:
        """Yield each state until `done`, and the error of one that is none.

        A connection that is lost is made again, and announced.
        """
        while not done.is_set():
            try:
                yield from self.read(done)
            except self.lost as error:
                if done.is_set():
                    return
                announce(f"{self.address}: the connection is lost ({self.reason(error)}); trying again")
                if self._connected_again(done):
                    announce(f"{self.address}: connected again")

    def _connected_again(self, done: threading.Event) -> bool:
        while not done.wait(AGAIN):
            try:
                self.connect()
                return True
            except self.lost:
                continue
        return False

    @abstractmethod
    def connect(self) -> None:
        """Connect, and find what is to be read. Raises one of `lost`."""

    @abstractmethod
    def read(self, done: threading.Event) -> Iterator[State | InputError]:
        """Yield as `states` does while the connection lasts. Raises one of `lost` where it breaks."""

    def reason(self, error: BaseException) -> str:
        """Say in words why a connection broke."""
        return str(error) or type(error).__name__

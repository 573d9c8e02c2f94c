"""The clock of a robot's stream: whether a state's time goes on from those before, or the clock was set."""

from __future__ import annotations

import time
from enum import Enum, auto

from irtwin.errors import InputError
from irtwin.live.joint_stream import State
from irtwin.live.stream_health import STALE, seconds

HOLE = 60.0  # s by which the next state's time may be later


class WrongTime(InputError):
    """A state whose time cannot be stored; `reason` says so without the seconds `by` which it is wrong."""

    def __init__(self, reason: str, by: float) -> None:
        super().__init__(f"{reason}, by {seconds(by)}; not stored")
        self.reason = reason


def jump(by: float) -> str:
    """Say by how many seconds a clock was set."""
    return f"the clock of the stream was set {'back' if by < 0 else 'ahead'} by {seconds(abs(by))}"


class Tick(Enum):
    """What the time of a state is to its stream."""

    NEXT = auto()  # it goes on from the state before
    LATE = auto()  # it is as old as the state before, or older by up to HOLE
    LEAP = auto()  # it is further away: the next state tells whether its time was wrong, or the clock was set


class StreamClock:
    """Told of the time of each state, stored or not; `now` is that of the newest whose time is trusted.

    `held` is a state whose time leaps, for who keeps it until the next one comes.
    """

    def __init__(self) -> None:
        self.now: float | None = None
        self.held: State | None = None
        self._leapt: float | None = None  # time of the state that leaps
        self._late: tuple[float, float] | None = None  # the first and the newest of late times that rise
        self._heard = time.monotonic()
        self._silence = 0.0

    def tell(self, stamp: float) -> tuple[Tick, float | None]:
        """Take a state's time, s since 1970.

        Return what it is, and by how many seconds the clock was set before it, None where it was not: a leap is
        confirmed by a later time, a step back of HOLE at most by late times that rise for STALE seconds.
        """
        self._hear()
        if self.now is None:
            return self._go(stamp), None
        step = stamp - self.now
        if 0 < step <= HOLE:
            return self._go(stamp), None
        if -HOLE < step <= 0:
            return self._take_late(stamp, self.now)
        if self._leapt is None or stamp <= self._leapt:
            self._leapt = stamp
            return Tick.LEAP, None
        leapt, by = self._leapt, self._leapt - self.now
        self._go(leapt)
        if stamp - leapt <= HOLE:
            return self._go(stamp), by
        self._leapt = stamp
        return Tick.LEAP, by

    def paused(self, by: float) -> bool:
        """Whether the clock was set by as much as the stream was silent before: a pause, and no fault of the clock."""
        return by > 0 and abs(by - self._silence) <= HOLE

    def _hear(self) -> None:
        now = time.monotonic()
        if self._leapt is None:  # else the silence before the leap counts
            self._silence = now - self._heard
        self._heard = now

    def _go(self, stamp: float) -> Tick:
        self.now, self._leapt, self._late = stamp, None, None
        return Tick.NEXT

    def _take_late(self, stamp: float, now: float) -> tuple[Tick, float | None]:
        first, newest = self._late or (stamp, stamp)
        self._late = (first, stamp) if stamp > newest else (stamp, stamp)
        if stamp - self._late[0] < STALE:
            return Tick.LATE, None
        return self._go(stamp), first - now

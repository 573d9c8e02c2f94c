"""A log played as if its robot moved now: at true speed or faster, by the way that every stream takes."""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from irtwin.errors import InputError
from irtwin.live.joint_stream import STREAMED, State
from irtwin.robot.description import Robot
from irtwin.signals.channels import Signals
from irtwin.signals.log import payload_told, topics_told
from irtwin.signals.samples import read_signals

_GAP = 0.01  # s between the end of the robot's last run and the first state of a log that is played right after it


class Replay:
    """The states of a log, their times from now on; `robot_id` is whose it is, `signals` are as logged."""

    def __init__(self, log: Path, robot: Robot, robot_id: str, speed: float = 1.0) -> None:
        """Read a log. Raises InputError where it is no run of the robot."""
        self.speed = speed
        self.signals, _ = read_signals(log, robot, topics=topics_told(log, robot))
        self.robot_id, self._joints = robot_id, len(robot.joints)
        self._payload, self._payload_com = payload_told(log)

    @property
    def seconds(self) -> float:
        """How long the log is."""
        return float(self.signals.time[-1] - self.signals.time[0])

    def start(self, *, after: float, ahead: float) -> float:
        """Return when the first state is to be, s since 1970.

        after: the time from which on the robot has no stored run; ahead: s by which a state may be ahead of the clock.
        At a speed above one the times run ahead of the clock, as the motion stays as fast as it was.
        Raises InputError where they would run too far ahead.
        """
        start = max(time.time(), after + _GAP)
        lead = start - time.time() + self.seconds * (1 - 1 / self.speed)
        if lead > ahead:
            raise InputError(
                f"at {self.speed:g} times its speed the log ends {lead:.0f} s ahead of the clock: play it slower"
            )
        return start

    def play(self, done: threading.Event, start: float) -> Iterator[State]:
        """Yield each state at its time, the first at `start`, until the last, or `done`."""
        began = time.monotonic()
        for state in self.states(start):
            pause = (state.time - start) / self.speed - (time.monotonic() - began)
            if done.is_set() or (pause > 0 and done.wait(pause)):
                return
            yield state

    def states(self, start: float) -> Iterator[State]:
        """Yield the states, the first at `start`, s since 1970."""
        columns = [_values(self.signals, field, channel.per_joint, self._joints) for field, channel in STREAMED.items()]
        for row, at in enumerate(self.signals.time - self.signals.time[0]):
            values = tuple(tuple(of[row].tolist()) for of in columns)
            yield State(self.robot_id, start + float(at), values, self._payload, self._payload_com)


def _values(signals: Signals, field: str, per_joint: bool, joints: int) -> np.ndarray:
    """Return a channel's values, (N, n) or (N, 1); NaN where it was not logged."""
    logged = getattr(signals, field)
    if logged is None:
        return np.full((len(signals.time), joints if per_joint else 1), math.nan)
    return np.asarray(logged if per_joint else logged[:, None])

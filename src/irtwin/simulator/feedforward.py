"""Feedforward: the torque that a controller adds to its servos, by a model of its own."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from irtwin.robot.description import GRAVITY
from irtwin.signals.filter import smoothed
from irtwin.signals.log import Run
from irtwin.signals.sampling import interval
from irtwin.simulator.model import Model

_OVER = 0.06  # s, over which commands are smoothed for their speed and acceleration: some come in a servo's ticks


@dataclass(frozen=True)
class Feedforward:
    """What the model, as it is given, takes for what is commanded: its bodies and rotors, without friction.

    Of `GRAVITY` at the commanded position, of `DYNAMICS` for the commanded motion (Khosla and Kanade 1988).
    """

    model: Model
    kind: str
    known: dict[str, np.ndarray] = field(default_factory=dict)  # by run

    def torque(self, run: Run, times: np.ndarray, delay: np.ndarray) -> np.ndarray:
        """Return it (N, n), N m, at times (N,) of the run's clock, s; it comes as late as the commands (n,), s."""
        if run.name not in self.known:
            self.known[run.name] = self._of_commands(run)
        own, clock = self.known[run.name], run.signals.time
        rows = np.searchsorted(clock, times[:, None] - delay + 1e-9, side="right") - 1
        return np.asarray(np.take_along_axis(own, np.clip(rows, 0, len(own) - 1), axis=0))

    def _of_commands(self, run: Run) -> np.ndarray:
        told, speed = run.signals.command, run.signals.command_speed
        assert told is not None
        if self.kind == GRAVITY:
            return self.model.torque_of_bodies(told, np.zeros_like(told), np.zeros_like(told))
        step = interval(run.signals.time)
        if speed is None:
            return self.model.torque_of_bodies(told, *smoothed(told, step, _OVER)[1:])
        return self.model.torque_of_bodies(told, speed, smoothed(speed, step, _OVER)[1])

"""Feedforward: the torque that a robot's controller adds to its servos, by its own model of the robot."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from irtwin.effects.drive import RotorInertia
from irtwin.effects.rigid_body import RigidBody
from irtwin.effects.stack import Stack
from irtwin.robot.description import GRAVITY, Robot
from irtwin.signals.filter import smoothed
from irtwin.signals.log import Run
from irtwin.signals.motion import Motion
from irtwin.signals.sampling import interval

_OVER = 0.06  # s, over which commands are smoothed for their speed and acceleration: some come in a servo's ticks


@dataclass(frozen=True)
class Feedforward:
    """What the robot's controller adds: the torque that bodies and rotors, as drawn, take for what is commanded.

    Its model is the data set's, whatever a simulator has: URDF, `rotor_inertia`, and the payload that it was told. Of
    gravity alone at the commanded position, or of the commanded motion (computed torque, Khosla and Kanade 1988).
    """

    robot: Robot
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
        step, still = interval(run.signals.time), np.zeros_like(told)
        if self.robot.feedforward == GRAVITY:
            dq, ddq = still, still
        elif speed is None:
            _, dq, ddq = smoothed(told, step, _OVER)
        else:
            dq, ddq = speed, smoothed(speed, step, _OVER)[1]
        load, centre = run.payload_mass, run.payload_com
        motion = Motion(run.signals.time, told, dq, ddq, run=run.name, payload_mass=load, payload_com=centre)
        drawn = Stack(self.robot, (RigidBody(), RotorInertia()))
        return drawn.real_torque(motion, np.array([term.expected for _, term in drawn.torque_terms]))

"""A cell with one built robot, warm from work: it carries motions out, one after another."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from scipy.interpolate import BPoly

from irtwin.demo.plant.arm import PlantPayload
from irtwin.demo.plant.machine import build, read_drawings
from irtwin.demo.plant.motion import PlantMotion, check, programme
from irtwin.demo.plant.simulate import Watch, simulate
from irtwin.demo.plant.thermal import Thermal

_SEED = 6700  # the robot that the shipped logs are of
_WARM_UP = 1800.0  # s at work
_ABOUT = np.array([0.0, -90.0, 80.0, 0.0, 0.0, 0.0])  # deg: a random motion keeps near, so that no links meet
_REACH, _MOVES, _SPEED = 40.0, 8, (0.2, 0.7)  # deg; and of the robot's own speed


class Cell:
    """A robot of drawings (TOML) and a URDF, and how warm it is."""

    def __init__(self, drawings: Path, urdf: Path) -> None:
        """Build the robot, and let it work for half an hour."""
        self.machine = build(read_drawings(drawings, urdf), _SEED)
        self.rng = np.random.default_rng([_SEED, 1])
        self.thermal = Thermal(self.machine.drawings.thermal)
        work = simulate(self.machine, self.random(range(1, 4)), PlantPayload(), self.thermal, _SEED)
        self.thermal.wait(work.mean_winding_loss, work.mean_body_loss, _WARM_UP)

    def through(self, time: np.ndarray, q: np.ndarray, dq: np.ndarray, ddq: np.ndarray) -> PlantMotion:
        """Return the motion at the controller's steps: the polynomial of fifth degree through samples, (N, n)."""
        curve, step = BPoly.from_derivatives(time, np.stack([q, dq, ddq], axis=1)), self.machine.drawings.step
        at = step * np.arange(round((time[-1] - time[0]) / step) + 1)
        return PlantMotion(curve(at), curve(at, 1), curve(at, 2))

    def random(self, joints: Sequence[int]) -> PlantMotion:
        """Return a random motion from pose to pose, of some joints alone."""
        moves = []
        for _ in range(_MOVES):
            pose = _ABOUT.copy()
            pose[list(joints)] += self.rng.uniform(-_REACH, _REACH, len(joints))
            moves.append({"to": pose, "speed": self.rng.uniform(*_SPEED)})
        return programme(moves, self.machine.drawings.limits, self.machine.drawings.step)

    def carry_out(self, motion: PlantMotion, log: Path, watch: Watch) -> None:
        """Let the robot do a motion, and write what its logger shows. Raises ValueError or RuntimeError else."""
        drawings = self.machine.drawings
        check(motion, drawings.limits)
        seed = int(self.rng.integers(1 << 30))
        simulate(self.machine, motion, PlantPayload(), self.thermal, seed, watch).write(log, drawings.joints)

"""What the twin says of a run when it is fitted without that run."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from irtwin.effects.catalogue import catalogue
from irtwin.effects.effect import Predicted
from irtwin.effects.stack import Stack
from irtwin.gap.regression.channel_equations import Torque, power_system
from irtwin.gap.regression.groups import Grouping
from irtwin.gap.regression.moments import Summed
from irtwin.gap.regression.normal_equations import System, twin_values
from irtwin.identification.progress import track
from irtwin.signals.motion import Motion

_PIECE = 32768  # samples whose columns are held at once

PowerOf = Callable[[Motion, np.ndarray], tuple[np.ndarray, np.ndarray]]


class LeftOut:
    """What the twin says of a run, fitted without that run's group; of a run it was not fitted to, by all groups."""

    def __init__(self, stack: Stack, system: System):
        """Fit the twin's terms to the equations of torque without each group in turn."""
        moments = system.moments(system.noise_before)
        total = Summed(moments)
        self._stack = stack
        self._all = twin_values(system, system.solution((), total))
        self._without: dict[str, np.ndarray] = {}
        for run in track({block.run for block in system.blocks}, lambda name: f"the twin without {name}"):
            groups = {int(g) for g, block in zip(system.group, system.blocks, strict=True) if block.run == run}
            own = moments[groups.pop()] if len(groups) == 1 and system.groups > 1 else None
            self._without[run] = twin_values(system, system.solution((), total, own))
        self._held: dict[str, tuple[Motion, np.ndarray]] = {}  # each run's: every pass over them asks for it

    def torque(self, motion: Motion) -> np.ndarray:
        """Return the real joint torque, (N, n) N m, of a run or a part of one."""
        if motion.run not in self._without:
            return self._stack.borne_torque(motion, self._all)
        run = motion.whole or motion
        if run.run not in self._held or self._held[run.run][0] is not run:
            self._held[run.run] = run, self._stack.borne_torque(run, self._without[run.run])
        return self._held[run.run][1][motion.start : motion.start + len(motion.time)]

    def below(self, whole: Motion) -> Predicted:
        """Return what further effects on torque are built on: the torque, and the bodies that were identified."""
        bodies = self._stack.bodies(whole, self._without.get(whole.run, self._all))
        return Predicted(self.torque(whole), bodies=bodies)


class TwinPower:
    """The power that the twin predicts for a run, (N,) W, and the part that its axes take.

    `values` (L,): its coefficients of power; `system`: the equation that they were fitted to, with a column of ones.
    """

    def __init__(self, stack: Stack, motions: Sequence[Motion], grouping: Grouping, torque: Torque):
        """Fit the twin's terms of power on top of a joint torque."""

        def none(motion: Motion, torque: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
            return np.zeros(len(torque)), np.zeros(len(torque))

        self._stack = stack
        ones = [effect for effect in catalogue().values() if effect.drawn_at_rest]
        self.system = power_system(stack, motions, grouping, ones, torque, none)
        self.values = np.array([term.expected for _, term in stack.power_terms], dtype=float)
        total = self.system.total(self.system.noise_before)
        self.values[~stack.fixed] = twin_values(self.system, self.system.solution((), total))
        self._at_rest = np.array([effect.drawn_at_rest for effect, _ in stack.power_terms], dtype=bool)

    def __call__(self, motion: Motion, torque: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return both for a run or a part of one, by its joint torque (N, n), N m."""
        both = []
        for piece in motion.pieces(_PIECE):
            start = piece.start - motion.start
            columns = self._stack.power_columns(piece, torque[start : start + len(piece.time)])
            both.append((columns @ self.values, columns @ np.where(self._at_rest, 0.0, self.values)))
        power, axes = zip(*both, strict=True)
        return np.concatenate(power), np.concatenate(axes)

"""Effects side by side: their columns stacked into the regressor of torque and that of power."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import cached_property

import numpy as np

from irtwin.effects.effect import Effect, Term, catalogue
from irtwin.errors import InputError
from irtwin.robot.description import Robot
from irtwin.signals.motion import Motion


class Stack:
    """The effects of a robot of n joints: K coefficients of the torque channel, L of the power channel."""

    def __init__(self, robot: Robot, effects: Sequence[str]):
        """Raise InputError on an id that the catalogue lacks, or that stands there twice."""
        known = catalogue()
        for effect in effects:
            if effect not in known:
                raise InputError(f'there is no effect "{effect}"; use some of {", ".join(known)}')
            if list(effects).count(effect) > 1:
                raise InputError(f'effect "{effect}" stands there twice; name it once')
        self.robot = robot
        self.ids = tuple(effects)
        self._torque = [known[effect] for effect in effects if known[effect].channel != "power"]
        self._power = [known[effect] for effect in effects if known[effect].channel == "power"]

    @cached_property
    def torque_terms(self) -> tuple[tuple[Effect, Term], ...]:
        """The K coefficients of the torque and measurement channels, each with its effect."""
        return tuple((effect, term) for effect in self._torque for term in effect.terms(self.robot))

    @cached_property
    def power_terms(self) -> tuple[tuple[Effect, Term], ...]:
        """The L coefficients of the power channel, each with its effect."""
        return tuple((effect, term) for effect in self._power for term in effect.terms(self.robot))

    @cached_property
    def real(self) -> np.ndarray:
        """(K,) whether the coefficient makes real torque, which carries power, or only shows in the measurement."""
        return np.array([effect.channel == "torque" for effect, _ in self.torque_terms], dtype=bool)

    @cached_property
    def fixed(self) -> np.ndarray:
        """(L,) whether the coefficient of power is known, not estimated."""
        return np.array([term.fixed for _, term in self.power_terms], dtype=bool)

    @cached_property
    def pattern(self) -> np.ndarray:
        """(n, K) whether the coefficient can act on the joint's torque, found at a few random states."""
        rng = np.random.default_rng(0)
        shape = (16, len(self.robot.joints))
        q, dq, ddq = rng.uniform(-2, 2, (3, *shape))
        probe = Motion("probe", np.arange(16.0), q, dq, ddq)
        return np.asarray(np.any(self.torque_columns(probe) != 0, axis=0))

    def torque_columns(self, motion: Motion) -> np.ndarray:
        """Return the (N, n, K) torque regressor."""
        parts = [effect.columns(self.robot, motion) for effect in self._torque]
        return np.concatenate([np.zeros((*motion.dq.shape, 0)), *parts], axis=2)

    def undecided(self, motion: Motion) -> np.ndarray:
        """Return (N, n) where some effect cannot say the joint's torque."""
        undecided = np.zeros(motion.dq.shape, dtype=bool)
        for effect in self._torque:
            part = effect.undecided(motion)
            undecided |= False if part is None else part
        return undecided

    def real_torque(self, motion: Motion, values: np.ndarray) -> np.ndarray:
        """Return the real joint torque, (N, n) N m, of the (K,) torque coefficients."""
        return np.asarray(self.torque_columns(motion) @ np.where(self.real, values + self.shift(motion), 0.0))

    def power_columns(self, motion: Motion, torque: np.ndarray) -> np.ndarray:
        """Return the (N, L) power regressor, given the predicted real joint torque, (N, n) N m."""
        parts = [effect.columns(self.robot, motion, torque) for effect in self._power]
        return np.concatenate([np.zeros((len(motion.time), 0)), *parts], axis=1)

    def shift(self, motion: Motion) -> np.ndarray:
        """Return what is known to be added to the (K,) torque coefficients in this motion."""
        parts = [np.broadcast_to(effect.shift(self.robot, motion), (count,)) for effect, count in self._counts()]
        return np.concatenate([np.zeros(0), *parts])

    def _counts(self) -> Iterator[tuple[Effect, int]]:
        for effect in self._torque:
            yield effect, sum(owner is effect for owner, _ in self.torque_terms)

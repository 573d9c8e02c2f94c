"""Power measured without torque: the torque's coefficients show through the power that the torque carries."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property, partial

import numpy as np

from irtwin.effects.effect import Effect, Predicted, Term
from irtwin.effects.stack import Stack
from irtwin.effects.supply import MechanicalPower
from irtwin.identification.fits import fit_through_power
from irtwin.identification.power_line import power_line
from irtwin.signals.motion import Motion

_PIECE = 8192  # samples whose columns of torque are held at once
Terms = tuple[tuple[Effect, Term], ...]


class ThroughPower(Stack):
    """A robot's effects whose power is linearised about the joint torque that fits the power best.

    Its terms of power are those of real torque, by the power that they carry, and after them those of power. What is
    carried is linear in the deviation of the torque's coefficients from that fit; the fixed last term makes it one in
    the coefficients themselves.
    """

    def __init__(self, stack: Stack, motions: Sequence[Motion]):
        """Fit the effects of `stack` to the power of the motions."""
        self._own = stack
        self._values = fit_through_power(stack, motions)[:2]
        super().__init__(stack.robot, stack.effects, stack.prior)

    def _check(self) -> None:
        """The stack that it is made of was checked; terms of torque stand among those of power on purpose."""

    def torque(self, motion: Motion) -> np.ndarray:
        """Return the real joint torque that fits the power best, (N, n) N m."""
        return self._own.real_torque(motion, self._values[0])

    def below(self, whole: Motion) -> Predicted:
        """Return what effects are built on: the torque."""
        return Predicted(self.torque(whole))

    @cached_property
    def power_terms(self) -> Terms:
        """The coefficients of real torque, those of power, and a fixed one."""
        carried = [pair for pair, real in zip(self._own.torque_terms, self._own.real, strict=True) if real]
        return (*carried, *self._own.power_terms, (MechanicalPower(), Term("", "1", expected=1.0, fixed=True)))

    def power_columns(self, motion: Motion, torque: np.ndarray) -> np.ndarray:
        """Return the (N, L) regressor of power."""
        starts = range(0, len(motion.time), _PIECE)
        pieces = [self._columns(motion.part(at, at + _PIECE), torque[at : at + _PIECE]) for at in starts]
        return np.concatenate(pieces)

    def _columns(self, motion: Motion, torque: np.ndarray) -> np.ndarray:
        torque_values, power_values = self._values
        own = self._own.predicted_power_columns(motion, torque_values, power_values)
        carrying = partial(self._own.carried, motion, values=torque_values)
        carried = power_line(self._own, motion, carrying, torque, own, power_values).carried
        return np.column_stack([carried, own, -carried @ torque_values[self.real]])

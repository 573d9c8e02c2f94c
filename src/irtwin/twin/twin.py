"""The twin: a robot, its effects and the numbers that fit them to what was measured."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from irtwin.effects.effect import Effect, Term
from irtwin.effects.stack import Stack
from irtwin.identification.validation import energy
from irtwin.robot.description import Robot
from irtwin.signals.motion import Motion


@dataclass(frozen=True)
class Parameter:
    """An identified number with its 95 % interval; None where the data do not decide it, and it is as expected."""

    effect: str
    joint: str | None
    link: str | None
    name: str
    value: float
    unit: str
    lower: float | None = None
    upper: float | None = None


@dataclass(frozen=True)
class BaseParameter:
    """A combination of torque coefficients that the torque shows; `name` spells it out, with its 95 % interval."""

    name: str
    value: float
    unit: str
    lower: float
    upper: float


@dataclass(frozen=True)
class LedgerEntry:
    """Energy (J) that one effect took over a motion; joint is None for an effect of the whole robot."""

    effect: str
    joint: str | None
    energy: float


@dataclass(frozen=True)
class Twin:
    """A robot of n joints and what moves it, identified. Immutable.

    `effects` are those that the twin models; `unidentified` were asked for, but nothing measured could show them.
    `cutoff` (Hz) is that of the filter in the fit; `condition_number` that of the scaled base regressor.
    """

    robot: Robot
    effects: tuple[str, ...]
    parameters: tuple[Parameter, ...]
    cutoff: float | None = None
    unidentified: tuple[str, ...] = ()
    base_parameters: tuple[BaseParameter, ...] = ()
    condition_number: float | None = None
    fitted: tuple[str, ...] = ()  # runs

    @cached_property
    def stack(self) -> Stack:
        """The effects' regressors."""
        return Stack(self.robot, self.effects)

    def torque(self, motion: Motion) -> np.ndarray:
        """Return the torque that a measurement would show, (N, n) N m: real torque and what the sensing adds."""
        columns = self.stack.torque_columns(motion)
        return np.asarray(columns @ (self._torque_values + self.stack.shift(motion)))

    def joint_torque(self, motion: Motion) -> np.ndarray:
        """Return the real torque in the joints, (N, n) N m (Yan 2018, eqs. 1 to 3)."""
        return self.stack.real_torque(motion, self._torque_values)

    def power(self, motion: Motion) -> np.ndarray:
        """Return the electrical power, (N,) W (Yan 2018, eqs. 7, 8). Without an effect of power: zero."""
        return np.asarray(self.stack.power_columns(motion, self.joint_torque(motion)) @ self._power_values)

    def energy(self, motion: Motion) -> float:
        """Return the energy over the motion, J (Yan 2018, eq. 9)."""
        return energy(motion.time, self.power(motion))

    def ledger(self, motion: Motion) -> tuple[LedgerEntry, ...]:
        """Return where the energy goes: per effect and joint, J; the entries sum to `energy`.

        Mechanical power is entered under the effects of torque that take it.
        """
        columns = self.stack.torque_columns(motion)
        values = np.where(self.stack.real, self._torque_values + self.stack.shift(motion), 0.0)
        power = self.stack.power_columns(motion, columns @ values) * self._power_values
        entries: dict[tuple[str, str | None], float] = {}
        for index, (effect, term) in enumerate(self.stack.power_terms):
            if effect.id != "mechanical_power":
                key = (effect.id, term.joint)
                entries[key] = entries.get(key, 0.0) + energy(motion.time, power[:, index])
        if "mechanical_power" in self.effects:
            work = np.trapezoid(columns * motion.dq[:, :, None], motion.time, axis=0) * values  # (n, K)
            for index, (effect, _) in enumerate(self.stack.torque_terms):
                for joint, name in enumerate(self.robot.joint_names):
                    if self.stack.real[index] and self.stack.pattern[joint, index]:
                        key = (effect.id, name)
                        entries[key] = entries.get(key, 0.0) + float(work[joint, index])
        return tuple(LedgerEntry(effect, joint, value) for (effect, joint), value in entries.items())

    def value(self, effect: str, term: Term) -> float:
        """Return the identified value of an effect's coefficient."""
        return term.expected if term.fixed else self._values[effect, term.joint, term.link, term.name]

    @cached_property
    def _values(self) -> dict[tuple[str, str | None, str | None, str], float]:
        return {(p.effect, p.joint, p.link, p.name): p.value for p in self.parameters}

    @cached_property
    def _torque_values(self) -> np.ndarray:
        return self._vector(self.stack.torque_terms)

    @cached_property
    def _power_values(self) -> np.ndarray:
        return self._vector(self.stack.power_terms)

    def _vector(self, terms: tuple[tuple[Effect, Term], ...]) -> np.ndarray:
        return np.array([self.value(effect.id, term) for effect, term in terms], dtype=float)

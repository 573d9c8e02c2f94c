"""The twin: a robot, its effects and the numbers that fit them to what was measured."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from irtwin.document.odd_stretch import OddStretch
from irtwin.effects.effect import NORMAL, Effect, Term
from irtwin.effects.prior import Prior
from irtwin.effects.stack import Stack
from irtwin.identification.remainder import Remainder
from irtwin.identification.validation import energy
from irtwin.robot.description import Robot
from irtwin.signals.motion import Motion, trapezoid
from irtwin.twin.torque_scale import FittedTorqueScale

_PIECE = 8192  # samples whose regressor is held at once


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
    `cutoff` (Hz) is that of the filter in the fit; `condition_number` that of the scaled base regressor. `parameters`
    are the coefficients that predict; `quantities` what they say in the catalogue's terms, where that differs.
    `covariance` (p, p) is that of the p parameters, so that 1.96 deviations are half a 95 % interval; None: not known.
    Neither it nor the parameters' intervals hold how sure the scale of the fitted torque is: `torque_scale`; None: no
    torque was fitted, or nobody asked. `choices`: which effects were chosen by what data show, where nobody named them.
    `remainder`: what the effects leave of power; None: not known.
    `body_change`: by how much torque differs from the best fit's, as bodies are physically consistent, a share of the
    joint's for which that is most; None: no torque was fitted. `odd_stretches`: of the runs, which counted for little.
    """

    robot: Robot
    effects: tuple[str | Effect, ...]
    parameters: tuple[Parameter, ...]
    cutoff: float | None = None
    unidentified: tuple[str, ...] = ()
    base_parameters: tuple[BaseParameter, ...] = ()
    condition_number: float | None = None
    fitted: tuple[str, ...] = ()  # runs
    quantities: tuple[Parameter, ...] = ()
    covariance: np.ndarray | None = field(default=None, repr=False, compare=False)
    torque_scale: FittedTorqueScale | None = None
    choices: tuple[Choice, ...] = ()
    remainder: Remainder | None = None
    body_change: float | None = None
    odd_stretches: tuple[OddStretch, ...] = ()

    @property
    def knows_power(self) -> bool:
        """Whether some loss or draw of power was identified; mechanical power alone is none of the supply's."""
        return any(effect.channel == "power" and not term.fixed for effect, term in self.stack.power_terms)

    @property
    def effect_ids(self) -> tuple[str, ...]:
        """The ids of the effects, each once."""
        return self.stack.ids

    @cached_property
    def stack(self) -> Stack:
        """The effects' regressors."""
        return Stack(self.robot, self.effects)

    @cached_property
    def at_rest(self) -> frozenset[str]:
        """The ids of the effects whose power is drawn at rest, too."""
        return frozenset(effect.id for effect in self.stack.effects if effect.drawn_at_rest)

    @property
    def energy_from(self) -> str:
        """Of what its energy is told: "modelled", or "mechanical" where no effect is an electrical loss."""
        return "modelled" if any(effect.electrical_loss for effect in self.stack.effects) else "mechanical"

    @property
    def standing(self) -> tuple[Effect, ...]:
        """The effects that act in whatever run, in their shapes."""
        return tuple(effect for effect in self.stack.effects if effect.runs is None)

    @property
    def prior(self) -> Prior:
        """What the twin knows of the coefficients of its standing effects, as a prior of another fit.

        Where it has no covariance, intervals say how sure each is by itself, and spreads where there are none.
        """
        spread = {
            (effect.id, term.joint, term.link, term.name): term.spread
            for effect, term in (*self.stack.torque_terms, *self.stack.power_terms)
        }
        passing = {effect.id for effect in self.stack.effects if effect.runs is not None}
        keys = [(parameter.effect, parameter.joint, parameter.link, parameter.name) for parameter in self.parameters]
        kept = [k for k, key in enumerate(keys) if key in spread and key[0] not in passing]
        values = np.array([self.parameters[k].value for k in kept])
        if self.covariance is not None:
            covariance = self.covariance[np.ix_(kept, kept)]
        else:
            covariance = np.diag([_deviation(self.parameters[k], spread[keys[k]]) ** 2 for k in kept])
        return Prior(tuple(keys[k] for k in kept), tuple(self.parameters[k].unit for k in kept), values, covariance)

    @property
    def stated(self) -> tuple[Parameter, ...]:
        """The parameters in the catalogue's terms: quantities where an effect has them, else its coefficients."""
        told = {quantity.effect for quantity in self.quantities}
        return (*(parameter for parameter in self.parameters if parameter.effect not in told), *self.quantities)

    def torque(self, motion: Motion) -> np.ndarray:
        """Return the torque that a measurement would show, (N, n) N m: real torque and what the sensing adds."""
        values = self.torque_values + self.stack.shift(motion)
        pieces = motion.pieces(_PIECE)
        return np.concatenate([self.stack.torque_columns(piece, self.torque_values) @ values for piece in pieces])

    def joint_torque(self, motion: Motion) -> np.ndarray:
        """Return the real torque in the joints, (N, n) N m (Yan 2018, eqs. 1 to 3)."""
        return np.concatenate([self.stack.real_torque(piece, self.torque_values) for piece in motion.pieces(_PIECE)])

    def measured_torque(self, motion: Motion) -> np.ndarray | None:
        """Return the torque that was measured, (N, n) N m; else current times torque constant where both are known."""
        constants = [joint.torque_constant for joint in self.robot.joints]
        if motion.torque is not None or motion.current is None or None in constants:
            return motion.torque
        return np.asarray(motion.current * np.array(constants, dtype=float))

    def power(self, motion: Motion) -> np.ndarray:
        """Return the electrical power, (N,) W (Yan 2018, eqs. 7, 8). Without an effect of power: zero."""
        return np.concatenate([self._power_columns(piece) @ self.power_values for piece in motion.pieces(_PIECE)])

    def energy(self, motion: Motion) -> float:
        """Return the energy over the motion, J (Yan 2018, eq. 9)."""
        return energy(motion.time, self.power(motion))

    def returned_energy(self, motion: Motion) -> float:
        """Return the mechanical energy that the joints gave back while they braked, J, positive."""
        return energy(motion.time, np.maximum(-self.joint_torque(motion) * motion.dq, 0.0).sum(axis=1))

    def ledger(self, motion: Motion) -> tuple[LedgerEntry, ...]:
        """Return where the energy goes: per effect and joint, J; the entries sum to `energy`.

        Mechanical power is entered under the effects of torque that take it. What a meter adds is no entry: each holds
        its part of that, in proportion.
        """
        entries: dict[tuple[str, str | None], float] = {}

        def enter(effect: str, joint: str | None, value: float) -> None:
            entries[effect, joint] = entries.get((effect, joint), 0.0) + value

        values = np.where(self.stack.real, self.torque_values + self.stack.shift(motion), 0.0)
        durations = trapezoid(motion.time)
        for piece in motion.pieces(_PIECE):
            weights = durations[piece.start - motion.start :][: len(piece.time)]
            columns = self.stack.torque_columns(piece, self.torque_values)
            watts = weights @ self._power_columns(piece) * self.power_values  # (L,)
            for value, (effect, term) in zip(watts, self.stack.power_terms, strict=True):
                if not effect.carries_torque:
                    enter(effect.id, term.joint, float(value))
            if any(effect.carries_torque for effect in self.stack.effects):
                work = np.einsum("t,tj,tjk->jk", weights, piece.dq, columns) * values
                for joint, index in zip(*np.nonzero(self.stack.pattern & self.stack.real), strict=True):
                    effect, _ = self.stack.torque_terms[index]
                    enter(effect.id, self.robot.joint_names[joint], float(work[joint, index]))
        shown = {effect.id for effect, _ in self.stack.power_terms if effect.channel == "measurement"}
        real = {place: value for place, value in entries.items() if place[0] not in shown}
        scale = sum(entries.values()) / total if (total := sum(real.values())) else 1.0
        return tuple(LedgerEntry(effect, joint, scale * value) for (effect, joint), value in real.items())

    def value(self, effect: str, term: Term) -> float:
        """Return the identified value of an effect's coefficient."""
        return term.expected if term.fixed else self._values[effect, term.joint, term.link, term.name]

    def values(self, terms: Iterable[tuple[Effect, Term]]) -> np.ndarray:
        """Return the values of coefficients, (K,)."""
        return np.array([self.value(effect.id, term) for effect, term in terms], dtype=float)

    @cached_property
    def torque_values(self) -> np.ndarray:
        """The coefficients of torque, (K,)."""
        return self.values(self.stack.torque_terms)

    @cached_property
    def power_values(self) -> np.ndarray:
        """The coefficients of power, (L,)."""
        return self.values(self.stack.power_terms)

    def over_parameters(self, of_torque: np.ndarray, of_power: np.ndarray) -> np.ndarray:
        """Return slopes over the coefficients of torque and power, (..., K) and (..., L), over the p parameters."""
        places = {
            (parameter.effect, parameter.joint, parameter.link, parameter.name): k
            for k, parameter in enumerate(self.parameters)
        }
        slopes = np.zeros((*of_torque.shape[:-1], len(self.parameters)))
        for terms, own in ((self.stack.torque_terms, of_torque), (self.stack.power_terms, of_power)):
            for k, (effect, term) in enumerate(terms):
                if not term.fixed:
                    slopes[..., places[effect.id, term.joint, term.link, term.name]] += own[..., k]
        return slopes

    def _power_columns(self, motion: Motion) -> np.ndarray:
        return self.stack.predicted_power_columns(motion, self.torque_values, self.power_values)

    @cached_property
    def _values(self) -> dict[tuple[str, str | None, str | None, str], float]:
        return {(p.effect, p.joint, p.link, p.name): p.value for p in self.parameters}


def _deviation(parameter: Parameter, spread: float) -> float:
    """Return a parameter's standard deviation by its interval; without one, the spread."""
    if parameter.lower is None or parameter.upper is None:
        return spread
    return max(parameter.upper - parameter.value, parameter.value - parameter.lower) / NORMAL


@dataclass(frozen=True)
class Choice:
    """An effect of the catalogue: whether the twin has it by what data show, at which joints, and how sure that is.

    What is not `chosen` could not be told: neither that it is there nor that it is not. `joints`: none for an effect of
    the whole robot, or of all joints alike. `rivals`: other effects that could be in its place.
    On groups of runs that are left out of the fit in turn, without the effect and with it: `rmse`, in `unit`, of the
    channel that shows it, at the joint that gains most; `energy_error`, % in the mean; None where nothing tells.
    """

    effect: str
    joints: tuple[str, ...]
    chosen: bool
    probability: float
    rivals: tuple[str, ...] = ()
    unit: str | None = None
    rmse_without: float | None = None
    rmse_with: float | None = None
    energy_error_without: float | None = None
    energy_error_with: float | None = None

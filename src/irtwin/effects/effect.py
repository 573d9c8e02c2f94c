"""The effect: one physical contribution to joint torque, electrical power or a measurement of them."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field, fields, replace
from typing import Any, ClassVar, Self, TypeGuard

import numpy as np

from irtwin.robot.description import Joint, Robot
from irtwin.signals.channels import CHANNELS
from irtwin.signals.motion import Motion

Known = Mapping[tuple[str, str | None, str], float]
"""Coefficients of other effects: (effect, joint, name) -> value."""

NORMAL = 1.959963984540054  # standard deviations in half a 95 % interval of what is normal
_REFERENCE = 1e-12  # below, a coefficient is none


@dataclass(frozen=True)
class Term:
    """One coefficient of an effect, and what is known of it before any data.

    `expected` and `spread` (in `unit`) are mean and standard deviation of a weak prior: they decide only what the
    data leave open. `lowest` and `highest` are physical bounds (friction and resistance are not negative). A `fixed`
    term is known to equal `expected` and is not estimated. `unnamed`: the standard deviation of what any healthy robot
    may have of it, as nobody knows the laws of the others so well; that much is no effect.
    """

    name: str
    unit: str
    joint: str | None = None
    link: str | None = None
    expected: float = 0.0
    spread: float = 1.0
    lowest: float = -np.inf
    highest: float = np.inf
    fixed: bool = False
    unnamed: float = 0.0


@dataclass(frozen=True)
class Predicted:
    """What the effects before one predict, over the same N samples.

    torque: (N, n) N m, real joint torque (for an effect of measurement: what is shown); power: (N,) W, all of it;
    axes: (N,) W, the part that the joints' drives take from their bus; bodies: (10 n,) inertial parameters with
    payload, None for those of the URDF; load: (N, n) N m, what the links of these bodies take beyond the gears, and
    inertia: (N, n) kg m^2, what each joint moves there, None where nobody has computed it. A part knows the `whole`
    that it was cut from. `kept`: what shapes of one effect have in common, worked out once.
    """

    torque: np.ndarray
    power: np.ndarray | None = None
    axes: np.ndarray | None = None
    bodies: np.ndarray | None = None
    load: np.ndarray | None = None
    inertia: np.ndarray | None = None
    whole: Predicted | None = field(default=None, repr=False, compare=False)
    kept: dict[Any, Any] = field(default_factory=dict, repr=False, compare=False)

    def part(self, start: int, stop: int) -> Predicted:
        """Return what is predicted for samples start..stop (exclusive)."""
        if start == 0 and stop >= len(self.torque):
            return self
        samples = {name: getattr(self, name) for name in ("torque", "power", "axes", "load", "inertia")}
        cut: dict[str, Any] = {name: None if own is None else own[start:stop] for name, own in samples.items()}
        return replace(self, **cut, whole=self.whole or self, kept={})


@dataclass(frozen=True)
class Stated:
    """What a data set states of a robot that bounds what can be true of it; None where it says nothing.

    payload: kg, the most that an observed run carries; rated_payload: kg; torque_scale: share by which logged torque
    may be off; torque_sensor: the same of a sensor of which no other runs tell.
    """

    payload: float = 0.0
    rated_payload: float | None = None
    torque_scale: float | None = None
    torque_sensor: float | None = None


NOTHING_STATED = Stated()


@dataclass(frozen=True)
class Possible:
    """The values that a parameter can have, ends included, and why no others."""

    low: float
    high: float
    why: str


@dataclass(frozen=True)
class Quantity:
    """A parameter as engineers state it, with its 95 % interval; None where there is none."""

    name: str
    joint: str | None
    value: float
    unit: str
    lower: float | None = None
    upper: float | None = None


@dataclass(frozen=True)
class Coefficients:
    """An effect's coefficients, `values` (k,), with their `covariance` (k, k), and those of other effects: `known`."""

    values: np.ndarray
    covariance: np.ndarray
    known: Known = field(default_factory=dict)

    @property
    def deviations(self) -> np.ndarray:
        """(k,) standard deviations."""
        return np.asarray(np.sqrt(np.diag(self.covariance)))

    def size(self, own: slice = slice(None)) -> tuple[float, float]:
        """Return the length of the vector of some of them, and its standard deviation."""
        values, covariance = self.values[own], self.covariance[own, own]
        length = float(np.linalg.norm(values))
        along = values / length if length > 0 else np.full(len(values), len(values) ** -0.5)
        return length, float(np.sqrt(along @ covariance @ along))


@dataclass(frozen=True)
class Effect(ABC):
    """What adds `columns @ (coefficients + shift)` to the torque or power that it shows in.

    `channel` is "torque" (a real torque: it drives or brakes, and carries mechanical power), "power" (electrical,
    W) or "measurement" (what a sensor shows beside the thing itself); `signal` is which measured signal the columns
    add to. Columns of an effect that `needs` "torque" or "power" are built from what other effects predict, never
    from what was measured; `stage` orders them: each is given the sum over lower stages. An effect with `memory` is
    computed over the whole motion that it is given, as it depends on what went before; with `reach`, on no more than
    so many seconds on either side. A shape `of_change` is a change's alone: in a twin, part of it is another effect;
    one that is `never_changed` has such a shape for its changes. A `nuisance` is what nobody states of any robot: it is
    as likely there as not, explains what it can, and is no cause. Columns of one that is `smooth` depend on their
    sample's states alone, and vary no faster than these. `differs_by_run`: what its coefficients are called, which are
    others in each run. `prior_tells`: that its coefficients lie far from what is known of them is evidence by itself.
    `about_reversals`: it shows most where a joint reverses, beside what nobody knows of how dry friction turns there.

    `family` is what engineers would file it under. `requires` names signals that it depends on beside the motion,
    `alters` an effect whose number it changes: where the twin lacks both, there is nothing to change.
    `bodies` marks the effect that is the robot's bodies, `within_bodies` one that is part of their last. Of power:
    `carries_torque` turns joint torque into power, an `electrical_loss` is turned into heat by the drives, one
    `of_every_drive` needs no proof, what is `drawn_at_rest` does not depend on the motion, and what `scales_power`
    multiplies all that a meter shows. Where the column of one that `frees_joints` is zero, brakes hold the joints and
    the drives are off. A `disturbance` goes its own way, so that no run tells when it acts in another, and repeats of a
    motion show it; the word says as what, "line" or "switching". `manual_test` is what a person can do to show it where
    no motion does; `taken_off` says how a run without it is made; `in_mjcf` what MuJoCo's models call its coefficients,
    of those that they have. What its parameters can be is `possible`. A ledger has its work as `entries`, that of
    what is known to be added as their last; none: as its id.

    Fields of a subclass are the effect's shape, in which it is not linear; `ranges` are those that can be refined, and
    `lately` those that twins of former releases lack: they are as by default.
    `joints` are those that it acts on (None: all; an effect of the whole robot takes no notice), `runs` those in which
    it acts (None: all). To teach the twin a new effect, write a class and list it in `irtwin.effects.catalogue`.
    """

    id: ClassVar[str]
    channel: ClassVar[str] = "torque"
    signal: ClassVar[str] = "torque"
    needs: ClassVar[str | None] = None
    stage: ClassVar[int] = 0
    memory: ClassVar[bool] = False
    reach: ClassVar[float | None] = None
    smooth: ClassVar[bool] = False
    differs_by_run: ClassVar[str | None] = None
    family: ClassVar[str]
    requires: ClassVar[frozenset[str]] = frozenset()
    alters: ClassVar[str | None] = None
    bodies: ClassVar[bool] = False
    within_bodies: ClassVar[bool] = False
    carries_torque: ClassVar[bool] = False
    electrical_loss: ClassVar[bool] = False
    of_every_drive: ClassVar[bool] = False
    frees_joints: ClassVar[bool] = False
    drawn_at_rest: ClassVar[bool] = False
    scales_power: ClassVar[bool] = False
    disturbance: ClassVar[str | None] = None
    manual_test: ClassVar[str | None] = None
    taken_off: ClassVar[str | None] = None
    in_mjcf: ClassVar[Mapping[str, str]] = {}
    of_change: ClassVar[bool] = False
    never_changed: ClassVar[bool] = False
    nuisance: ClassVar[bool] = False
    prior_tells: ClassVar[bool] = False
    about_reversals: ClassVar[bool] = False
    entries: ClassVar[tuple[str, ...]] = ()
    ranges: ClassVar[dict[str, tuple[float, float]]] = {}
    lately: ClassVar[frozenset[str]] = frozenset()

    joints: tuple[str, ...] | None = field(default=None, kw_only=True)
    runs: tuple[str, ...] | None = field(default=None, kw_only=True)

    @property
    def screened(self) -> bool:
        """Whether a screening found its place, or its runs, among many."""
        return self.runs is not None

    @property
    def window(self) -> tuple[float, float] | None:
        """From when to when of a run's clock it acts, s; None: throughout."""
        return None

    def has_what_it_alters(self, twin: Collection[str]) -> bool:
        """Return whether a twin of these effects has what this one alters, or itself; True where it alters nothing."""
        return self.alters is None or not {self.alters, self.id}.isdisjoint(twin)

    @abstractmethod
    def terms(self, robot: Robot) -> tuple[Term, ...]:
        """Return the k coefficients, in the order of the columns."""

    @abstractmethod
    def columns(self, robot: Robot, motion: Motion, predicted: Predicted | None = None) -> np.ndarray:
        """Return the columns per unit of the coefficients: (N, n, k) N m where `signal` is torque, else (N, k) W."""

    def contribution(
        self, robot: Robot, motion: Motion, values: np.ndarray, predicted: Predicted | None = None
    ) -> np.ndarray:
        """Return columns @ values (k,): (N, n) N m where `signal` is torque, else (N,) W."""
        return np.asarray(self.columns(robot, motion, predicted) @ values)

    def carried(
        self, robot: Robot, motion: Motion, along: np.ndarray, predicted: Predicted | None = None
    ) -> np.ndarray:
        """Return (N, k) the columns of torque, each joint's times its `along` (N, n), summed over joints."""
        return np.asarray(np.einsum("njk,nj->nk", self.columns(robot, motion, predicted), along))

    def undecided(self, motion: Motion) -> np.ndarray | None:
        """Return (N, n) where the effect cannot say the joint's torque, so that a fit leaves these samples out."""
        return None

    def shift(self, robot: Robot, motion: Motion) -> np.ndarray | float:
        """Return what is known to be added to the (k,) coefficients in this motion: a payload, for one."""
        return 0.0

    def booked(self, robot: Robot, motion: Motion, columns: np.ndarray) -> Mapping[str, np.ndarray]:
        """Return columns of torque, (N, n, k), by the entry of a ledger that their work is; they sum to `columns`."""
        return {self.id: columns}

    def candidates(self, robot: Robot | None = None) -> tuple[Effect, ...]:
        """Return the effect in each shape that is worth trying; a robot's data sheet may add some."""
        return (self,)

    def changes(self) -> tuple[Effect, ...]:
        """Return the shapes that are worth trying for a change alone."""
        return ()

    def standing(self) -> Effect:
        """Return the shape that a change has in a twin where it stays."""
        return self

    def parameters(self, robot: Robot, given: Coefficients) -> tuple[Quantity, ...]:
        """Return the catalogue's parameters that coefficients say; some are relative to one of another effect."""
        return tuple(
            quantity(term.name, term.joint, value, term.unit, deviation)
            for term, value, deviation in zip(self.terms(robot), given.values, given.deviations, strict=True)
        )

    def possible(self, robot: Robot, stated: Stated) -> Mapping[str, Possible]:
        """Return what parameters can be, by name: those of `parameters` that no robot, or not this one, has beyond."""
        return {}

    @property
    def changed_in_mjcf(self) -> Mapping[str, str]:
        """What MuJoCo's models call the numbers that are others where it has changed: its own, if they have them."""
        return self.in_mjcf

    @property
    def shape(self) -> dict[str, Any]:
        """The fields that are the effect's shape, by name."""
        names = [each.name for each in fields(self) if each.name not in ("joints", "runs")]
        return {name: getattr(self, name) for name in names}

    def on(self, *joints: str) -> Self:
        """Return the effect in these joints alone."""
        return replace(self, joints=joints)

    def acts_in(self, motion: Motion) -> bool:
        """Return whether the effect acts in the motion's run."""
        return self.runs is None or motion.run in self.runs

    def acting(self, robot: Robot) -> tuple[Joint, ...]:
        """Return the joints that the effect acts on, in the robot's order."""
        return tuple(joint for joint in robot.joints if self.joints is None or joint.name in self.joints)

    def places(self, robot: Robot) -> list[int]:
        """Return the columns of `q` of the joints that the effect acts on."""
        return [robot.index(joint.name) for joint in self.acting(robot)]

    def touched(self, robot: Robot, joint: str) -> tuple[str, ...]:
        """Return the joints on which a coefficient acts that is named by a joint."""
        return (joint,)

    def variants(self, **shapes: tuple[Any, ...]) -> tuple[Self, ...]:
        """Return the effect with each value of one field."""
        return tuple(replace(self, **{name: value}) for name, values in shapes.items() for value in values)


@dataclass(frozen=True)
class JointEffect(Effect):
    """An effect of each joint by m coefficients and samples of it; within that joint alone, unless it acts `across`."""

    across: ClassVar[bool] = False

    @abstractmethod
    def joint_terms(self, joint: Joint) -> tuple[Term, ...]:
        """Return the joint's m coefficients."""

    @abstractmethod
    def samples(self, robot: Robot, motion: Motion, predicted: Predicted | None) -> tuple[np.ndarray, ...]:
        """Return m columns, (N, n) each: that of each joint."""

    def shape_of_joints(self, robot: Robot, **units: str) -> tuple[Quantity, ...]:
        """Return fields of the shape as parameters of each acting joint; {} in a unit is that of its position."""
        return tuple(
            Quantity(name, joint.name, getattr(self, name), unit.format(joint.unit))
            for joint in self.acting(robot)
            for name, unit in units.items()
        )

    def terms(self, robot: Robot) -> tuple[Term, ...]:
        """Return m coefficients per joint, joint by joint."""
        return tuple(term for joint in self.acting(robot) for term in self.joint_terms(joint))

    def columns(self, robot: Robot, motion: Motion, predicted: Predicted | None = None) -> np.ndarray:
        """Return (N, n, k): each joint's own, zero elsewhere; where the signal is power (N, k)."""
        parts = self.samples(robot, motion, predicted)
        acting = self.places(robot)
        if self.signal == "power":
            stacked = np.stack([part[:, acting] for part in parts], axis=2)
            return stacked.reshape(len(motion.time), len(acting) * len(parts))
        columns = np.zeros((*motion.dq.shape, len(acting) * len(parts)))
        for place, joint in enumerate(acting):
            for number, part in enumerate(parts):
                columns[:, joint, place * len(parts) + number] = part[:, joint]
        return columns

    def contribution(
        self, robot: Robot, motion: Motion, values: np.ndarray, predicted: Predicted | None = None
    ) -> np.ndarray:
        """Return columns @ values (k,), without the zeros of other joints."""
        parts = self.samples(robot, motion, predicted)
        weights = np.zeros((len(parts), motion.dq.shape[1]))
        acting = self.places(robot)
        weights[:, acting] = values.reshape(len(acting), len(parts)).T
        if self.signal == "power":
            return np.asarray(sum(part @ weight for part, weight in zip(parts, weights, strict=True)))
        return np.asarray(sum(part * weight for part, weight in zip(parts, weights, strict=True)))

    def carried(
        self, robot: Robot, motion: Motion, along: np.ndarray, predicted: Predicted | None = None
    ) -> np.ndarray:
        """Return (N, k): each joint's own columns times its `along` (N, n)."""
        parts = [part * along for part in self.samples(robot, motion, predicted)]
        acting = self.places(robot)
        return np.array([part[:, joint] for joint in acting for part in parts]).reshape(-1, len(along)).T


def stays_within(effect: Effect) -> TypeGuard[JointEffect]:
    """Return whether an effect acts within each joint alone, so that its samples are its columns."""
    return isinstance(effect, JointEffect) and not effect.across


def quantity(
    name: str,
    joint: str | None,
    value: float,
    unit: str,
    deviation: float | None = None,
    convert: Callable[[float], float] = float,
) -> Quantity:
    """Return `convert` (monotone) of a value and of the ends of its interval; no interval where one end has none."""
    ends: list[float] = []
    if deviation is not None and np.isfinite(deviation):
        ends = sorted(convert(float(value + side * NORMAL * deviation)) for side in (-1, 1))
    if not ends or not np.all(np.isfinite(ends)):
        return Quantity(name, joint, convert(float(value)), unit)
    return Quantity(name, joint, convert(float(value)), unit, ends[0], ends[1])


def ratio(numerator: float, denominator: float | None) -> float:
    """Return the quotient; NaN where the denominator is unknown or nothing."""
    return numerator / denominator if denominator is not None and abs(denominator) > _REFERENCE else float("nan")


def force_unit(joint: Joint) -> str:
    """Return the unit of the joint's effort: "N m", or "N" where it slides."""
    return CHANNELS["torque"].unit_of(joint.kind)


def inertia_unit(joint: Joint) -> str:
    """Return the unit of effort per acceleration of the joint."""
    return "kg" if joint.kind == "prismatic" else "kg m^2"

"""Effects side by side: their columns stacked into the regressor of torque and that of power."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from itertools import pairwise
from typing import TypeVar

import numpy as np
import scipy

from irtwin.effects.catalogue import catalogue
from irtwin.effects.effect import Effect, JointEffect, Predicted, Term, stays_within
from irtwin.effects.prior import Prior
from irtwin.errors import InputError
from irtwin.robot.description import Robot
from irtwin.signals.motion import Motion
from irtwin.signals.sparse import Sparse, at_all, at_some, factor_at_some

_LARGEST = 1e15  # SI: beyond, squares of what a coefficient does are no numbers
_PIECE = 4096  # samples whose columns are held at once
_STATES = 400  # random ones, many more than a joint has columns
_SWITCHING = 0.1  # s: in it coils of brakes take up their current, and nobody logs when they begin
_INDEPENDENT = 1e-9  # of a scaled column: less is rounding

Span = tuple[np.ndarray, np.ndarray]  # places (r,) of columns that span others, and the (r, k) matrix that makes them
AnyColumns = TypeVar("AnyColumns")


@dataclass(frozen=True)
class _Torques:
    """What the torque effects predict over a whole run: for each stage what lower ones say, and all real torque."""

    motion: Motion
    values: bytes
    below: dict[int, Predicted]
    real: np.ndarray


class Stack:
    """The effects of a robot of n joints: K coefficients of the torque signal, L of the power signal."""

    def __init__(self, robot: Robot, effects: Sequence[str | Effect], prior: Prior | None = None):
        """Take effects or their ids, and what is known of their coefficients; None: what the catalogue expects.

        Raise InputError on an unknown id or joint, an effect twice, or an absurd body.
        """
        known = catalogue()
        for effect in effects:
            if isinstance(effect, str) and effect not in known:
                raise InputError(f'there is no effect "{effect}"; choose from {", ".join(known)}')
        self.robot = robot
        self.prior = prior
        self.effects = tuple(known[effect] if isinstance(effect, str) else effect for effect in effects)
        self.ids = tuple(dict.fromkeys(effect.id for effect in self.effects))
        self._torque = [effect for effect in self.effects if effect.signal == "torque"]
        self._power = [effect for effect in self.effects if effect.signal == "power"]
        self._last_torques: _Torques | None = None
        self._last_powers: tuple[Motion, tuple[bool, bytes, bytes], dict[int, Predicted]] | None = None
        self._last_of_whole: dict[tuple[str, int], tuple[Motion, Predicted | None, np.ndarray | None]] = {}
        self._check()

    def _check(self) -> None:
        names = self.robot.joint_names
        for effect in self.effects:
            for joint in effect.joints or ():
                if joint not in names:
                    raise InputError(
                        f'effect "{effect.id}": there is no joint "{joint}"; choose from {", ".join(names)}'
                    )
        seen = set()
        for effect, term in (*self.torque_terms, *self.power_terms):
            key = (effect.id, term.joint, term.link, term.name, effect.runs)
            if key in seen:
                raise InputError(f'effect "{effect.id}" is listed twice; list it once')
            seen.add(key)
            if not (abs(term.expected) <= _LARGEST and term.spread <= _LARGEST):
                raise InputError(
                    f'{self.robot.name}: {term.name} of "{term.link or term.joint}" is {term.expected:g} {term.unit}, '
                    f"give or take {term.spread:g}, as no robot has; mend the URDF"
                )

    @cached_property
    def torque_terms(self) -> tuple[tuple[Effect, Term], ...]:
        """The K coefficients of effects that torque shows, each with its effect."""
        return self._terms(self._torque)

    @cached_property
    def power_terms(self) -> tuple[tuple[Effect, Term], ...]:
        """The L coefficients of effects that power shows, each with its effect."""
        return self._terms(self._power)

    def prior_rows(self, pairs: Sequence[tuple[Effect, Term]]) -> np.ndarray | None:
        """Return what is known of some terms, as `Prior.rows`; None: nothing beside their expectation and spread."""
        return None if self.prior is None else self.prior.rows(pairs)

    def with_effects(self, effects: Sequence[str | Effect]) -> Stack:
        """Return the stack of other effects of the robot, of which the same is known."""
        return Stack(self.robot, effects, self.prior)

    def _terms(self, effects: Sequence[Effect]) -> tuple[tuple[Effect, Term], ...]:
        pairs = ((effect, term) for effect in effects for term in effect.terms(self.robot))
        if self.prior is None:
            return tuple(pairs)
        return tuple((effect, self.prior.informed(effect, term)) for effect, term in pairs)

    @cached_property
    def _torque_places(self) -> dict[Effect, slice]:
        return _places(self._torque, self.robot)

    @cached_property
    def real(self) -> np.ndarray:
        """(K,) whether the coefficient makes real torque, which carries power, or only shows in the measurement."""
        return np.array([effect.channel == "torque" for effect, _ in self.torque_terms], dtype=bool)

    @cached_property
    def fixed(self) -> np.ndarray:
        """(L,) whether the coefficient of power is known, not estimated."""
        return np.array([term.fixed for _, term in self.power_terms], dtype=bool)

    @cached_property
    def on_the_bus(self) -> np.ndarray:
        """(L,) whether power flows between the bus and the joints, or into its capacitor; not what feeds the rest."""
        pairs = self.power_terms
        return np.array([e.channel == "power" and (t.joint is not None or e.stage == 1) for e, t in pairs], dtype=bool)

    @property
    def coupled(self) -> bool:
        """Whether columns of torque depend on its coefficients: on what other effects predict."""
        return any(effect.needs for effect in self._torque)

    @property
    def power_coupled(self) -> bool:
        """Whether columns of power depend on its coefficients."""
        return any(effect.needs == "power" for effect in self._power)

    @cached_property
    def pattern(self) -> np.ndarray:
        """(n, K) whether the coefficient can act on the joint's torque: where not plain, found at random states."""
        rng = np.random.default_rng(0)
        shape = (16, len(self.robot.joints))
        q, dq, ddq = rng.uniform(-2, 2, (3, *shape))
        warm = np.full(shape, 50.0)
        probe = Motion(np.arange(16.0), q, dq, ddq, run="probe", temperature=warm)
        predicted = Predicted(rng.uniform(-50, 50, shape))
        patterns = [
            np.array([[term.joint == name for term in effect.terms(self.robot)] for name in self.robot.joint_names])
            if stays_within(effect)
            else np.any(effect.columns(self.robot, probe, predicted) != 0, axis=0)
            for effect in self._torque
        ]
        return np.concatenate([np.zeros((shape[1], 0), dtype=bool), *patterns], axis=1)

    def torque_columns(self, motion: Motion, values: np.ndarray | None = None) -> np.ndarray:
        """Return the (N, n, K) torque regressor.

        `values` (K,): coefficients with which effects predict what others are built on; None: as expected.
        """
        below = self._below(motion, values)
        parts = [self.columns(effect, motion, below.get(effect.stage)) for effect in self._torque]
        return np.concatenate([np.zeros((*motion.dq.shape, 0)), *parts], axis=2)

    def columns_by_joint(self, motion: Motion, values: np.ndarray | None = None) -> list[np.ndarray]:
        """Return, for each joint, the columns (N, k) of the coefficients that can act on it, by `pattern`.

        It is `torque_columns` without the zeros, which are most of it; `values` as there.
        """
        return [side_by_side(columns) for columns in self._by_joint(motion, values, self._dense)]

    def sparse_by_joint(self, motion: Motion, values: np.ndarray | None = None) -> list[list[np.ndarray | Sparse]]:
        """Return `columns_by_joint` as arrays to stand side by side, those of smooth effects sparse."""
        some = at_some(motion)

        def columns(effect: Effect, part: Motion, below: Predicted | None) -> list[np.ndarray | Sparse]:
            if not (effect.smooth and effect.acts_in(part)):
                return [*self._dense(effect, part, below)]
            dense = effect.columns(self.robot, some)
            return [Sparse(dense[:, joint, own], mixed) for joint, (own, mixed) in enumerate(self._spans[effect])]

        return self._by_joint(motion, values, columns)

    def _by_joint(
        self,
        motion: Motion,
        values: np.ndarray | None,
        columns: Callable[[Effect, Motion, Predicted | None], Sequence[AnyColumns]],
    ) -> list[list[np.ndarray | AnyColumns]]:
        """Return arrays of columns for each joint; `columns` gives those of an effect of more than one."""
        below = self._below(motion, values)
        by_joint: list[list[np.ndarray | AnyColumns]] = [[np.zeros((len(motion.time), 0))] for _ in self.robot.joints]
        for effect in self._torque:
            if stays_within(effect) and effect.acts_in(motion) and not effect.memory:
                samples = effect.samples(self.robot, motion, _part(below.get(effect.stage), motion))
                for joint in effect.acting(self.robot):
                    place = self.robot.index(joint.name)
                    by_joint[place] += [sample[:, place : place + 1] for sample in samples]
            else:
                for mine, own in zip(by_joint, columns(effect, motion, below.get(effect.stage)), strict=True):
                    mine.append(own)
        return by_joint

    def _dense(self, effect: Effect, motion: Motion, below: Predicted | None) -> list[np.ndarray]:
        columns, pattern = self.columns(effect, motion, below), self.pattern[:, self._torque_places[effect]]
        return [columns[:, place, used] for place, used in enumerate(pattern)]

    @cached_property
    def _spans(self) -> dict[Effect, list[Span]]:
        """Of each smooth effect, for each joint, its columns that span those which can act on it."""
        states = np.random.default_rng(0).uniform(-2, 2, (3, _STATES, len(self.robot.joints)))
        probe = Motion(np.arange(float(_STATES)), *states, run="probe")
        return {
            effect: [
                _span(effect.columns(self.robot, probe)[:, joint], used)
                for joint, used in enumerate(self.pattern[:, own])
            ]
            for effect, own in self._torque_places.items()
            if effect.smooth
        }

    def shift_torque(self, motion: Motion, *, sparse: bool = False) -> np.ndarray:
        """Return the torque (N, n), N m, of what is known to be added; `sparse` as in `torque_of`."""
        shift, torque = self.shift(motion), np.zeros(motion.dq.shape)
        for effect, own in self._torque_places.items():
            if shift[own].any():
                add = partial(self._added, effect, below=None, values=shift[own])
                torque += at_all(add, motion) if sparse and effect.smooth else add(motion)
        return torque

    def _added(self, effect: Effect, motion: Motion, below: Predicted | None, values: np.ndarray) -> np.ndarray:
        return np.asarray(self.columns(effect, motion, below) @ values)

    def carried(self, motion: Motion, along: np.ndarray, values: np.ndarray | None = None) -> np.ndarray:
        """Return (N, R), for each coefficient of real torque, its column in each joint times `along` (N, n), summed.

        It is the power that the column carries, if along is a speed; `values` as in `torque_columns`.
        """
        below = self._below(motion, values)
        parts = [self._carried(effect, motion, along, below.get(effect.stage)) for effect in self._real]
        return side_by_side([np.zeros((len(along), 0)), *parts])

    def sparse_carried(
        self, motion: Motion, along: np.ndarray, values: np.ndarray | None = None
    ) -> list[np.ndarray | Sparse]:
        """Return `carried` as arrays to stand side by side, those of smooth effects sparse."""
        below = self._below(motion, values)
        some, slower = at_some(motion), factor_at_some(along, motion)
        return [
            Sparse(effect.carried(self.robot, some, slower))
            if effect.smooth and effect.acts_in(motion)
            else self._carried(effect, motion, along, below.get(effect.stage))
            for effect in self._real
        ]

    @property
    def _real(self) -> list[Effect]:
        return [effect for effect in self._torque if effect.channel == "torque"]

    def undecided(self, motion: Motion) -> np.ndarray:
        """Return (N, n) where some effect cannot say the joint's torque."""
        undecided = np.zeros(motion.dq.shape, dtype=bool)
        for effect in self._torque:
            part = self._of_whole("undecided", effect, motion) if effect.memory else effect.undecided(motion)
            if part is not None:
                acting = effect.places(self.robot)
                undecided[:, acting] |= part[:, acting]
        return undecided

    def switching(self, motion: Motion) -> np.ndarray | None:
        """Return (N,) where brakes open or close, or are about to; None without brakes.

        Coils of brakes take up their current in a while, and no log says when they begin.
        """
        whole, near = motion.whole or motion, max(1, round(_SWITCHING * motion.rate))
        first, last = max(0, motion.start - near), min(len(whole.time), motion.start + len(motion.time) + near)
        released = self.drives_on(whole.part(first, last))
        if released is None:
            return None
        switches = np.pad(np.diff(released) != 0, (near, near))
        window = np.lib.stride_tricks.sliding_window_view(switches, 2 * near)
        return np.asarray(np.any(window, axis=1))[motion.start - first :][: len(motion.time)]

    def real_torque(self, motion: Motion, values: np.ndarray, *, sparse: bool = False) -> np.ndarray:
        """Return the real joint torque, (N, n) N m, of the (K,) torque coefficients; `sparse` as in `torque_of`."""
        if self.coupled:
            return _cut(self._torques(motion, values).real, motion)
        return self.torque_of(self._real, motion, values, sparse=sparse)

    def logged_torque(self, motion: Motion, values: np.ndarray, *, sparse: bool = False) -> np.ndarray:
        """Return the real joint torque, (N, n) N m, as the log shows it, less what sensors add; else the predicted.

        It is as fast as the states are: what it carries is filtered with the measured power.
        """
        if motion.torque is None:
            return self.real_torque(motion, values, sparse=sparse)
        sensors = [effect for effect in self._torque if effect.channel == "measurement"]
        fast = 0.0 if motion.fast_torque is None else motion.fast_torque
        return np.asarray(motion.torque + fast - self.torque_of(sensors, motion, values))

    def told_by_log(self, motion: Motion) -> np.ndarray:
        """Return where a log alone tells a joint's torque, (N, n): at rest dry friction holds what it has to."""
        return np.zeros(motion.dq.shape, dtype=bool) if motion.torque is None else self.undecided(motion)

    def borne_torque(self, motion: Motion, values: np.ndarray) -> np.ndarray:
        """Return the real joint torque, (N, n) N m: what the log shows, less what sensors add, where it alone tells."""
        torque, told = self.real_torque(motion, values), self.told_by_log(motion)
        return np.where(told, self.logged_torque(motion, values), torque) if told.any() else torque

    def torque_of(
        self, effects: Sequence[Effect], motion: Motion, values: np.ndarray, *, sparse: bool = False
    ) -> np.ndarray:
        """Return what some of the effects add to torque, (N, n) N m, by the (K,) torque coefficients of all.

        That of smooth ones is worked out at some samples where it may be `sparse`.
        """
        total = values + self.shift(motion)
        below = self._below(motion, values)
        torque = np.zeros(motion.dq.shape)
        for effect, own in self._torque_places.items():
            if effect in effects:
                add = partial(self._contribution, effect, below=below.get(effect.stage), values=total[own])
                torque += at_all(add, motion) if sparse and effect.smooth else add(motion)
        return torque

    def shown_torque(self, motion: Motion, values: np.ndarray) -> np.ndarray:
        """Return what a log shows by the (K,) torque coefficients, (N, n) N m; what others are built on as expected."""
        if self.coupled:
            return np.asarray(self.torque_columns(motion) @ (values + self.shift(motion)))
        return self.torque_of(self._torque, motion, values)

    def predicted_power_columns(
        self,
        motion: Motion,
        torque_values: np.ndarray,
        power_values: np.ndarray | None = None,
        torque: np.ndarray | None = None,
        *,
        logged: bool = False,
    ) -> np.ndarray:
        """Return the (N, L) power regressor of the torque that (K,) coefficients predict, or of the `logged_torque`.

        `power_values` (L,): coefficients with which effects predict the power that others are built on; None: as
        expected. `torque` (N, n): that torque, N m, where it is known already.
        """
        if not self.power_coupled:
            known = self._torque_by(motion, torque_values, logged) if torque is None else torque
            return self.power_columns(motion, known)
        below = self._powers(motion, torque_values, power_values, logged)
        parts = [self.columns(effect, motion, below[effect.stage]) for effect in self._power]
        return np.concatenate([np.zeros((len(motion.time), 0)), *parts], axis=1)

    def _torque_by(self, motion: Motion, values: np.ndarray, logged: bool) -> np.ndarray:
        return self.logged_torque(motion, values) if logged else self.real_torque(motion, values)

    def power_columns(self, motion: Motion, torque: np.ndarray) -> np.ndarray:
        """Return the (N, L) power regressor of real joint torques (N, n), N m; zero where predicted power is needed."""
        parts = [
            np.zeros((len(motion.time), len(effect.terms(self.robot))))
            if effect.needs == "power" or not effect.acts_in(motion)
            else self.columns(effect, motion, None)
            if effect.memory
            else self._while_on(effect, motion, effect.columns(self.robot, motion, Predicted(torque)))
            for effect in self._power
        ]
        return np.concatenate([np.zeros((len(motion.time), 0)), *parts], axis=1)

    def works(
        self, motion: Motion, columns: np.ndarray, weights: np.ndarray
    ) -> Iterator[tuple[Effect, slice, Mapping[str, np.ndarray]]]:
        """Yield effects of real torque, places of their k coefficients, and by entry of a ledger their work, (n, k).

        That is J in each joint by a unit of a coefficient; columns: (N, n, K) of torque; weights: (N,) s of samples.
        """
        for effect, own in self._torque_places.items():
            if effect.channel == "torque":
                parts = effect.booked(self.robot, motion, columns[:, :, own]).items()
                yield effect, own, {name: np.einsum("t,tj,tjk->jk", weights, motion.dq, part) for name, part in parts}

    def shift(self, motion: Motion) -> np.ndarray:
        """Return what is known to be added to the (K,) torque coefficients in this motion."""
        shift = np.zeros(len(self.torque_terms))
        for effect, own in self._torque_places.items():
            shift[own] = effect.shift(self.robot, motion)
        return shift

    def columns(self, effect: Effect, motion: Motion, below: Predicted | None) -> np.ndarray:
        """Return the columns of an effect (of the stack or not) for a motion that may be a part of a run.

        `below` is what others predict over the whole of that run.
        """
        if not effect.acts_in(motion):
            shape = (len(motion.time), len(effect.terms(self.robot)))
            return np.zeros(shape if effect.signal == "power" else (shape[0], motion.dq.shape[1], shape[1]))
        if effect.memory:
            return np.asarray(self._of_whole("columns", effect, motion, below))
        return self._while_on(effect, motion, effect.columns(self.robot, motion, _part(below, motion)))

    def _of_whole(
        self, asked: str, effect: Effect, motion: Motion, below: Predicted | None = None
    ) -> np.ndarray | None:
        """Return "columns" of an effect with memory, or where it is "undecided": of a run at once for all its parts."""
        whole, key = motion.whole or motion, (asked, id(effect))
        last = self._last_of_whole.get(key)
        if last is None or last[0] is not whole or last[1] is not below:
            result = effect.columns(self.robot, whole, below) if asked == "columns" else effect.undecided(whole)
            last = self._last_of_whole[key] = whole, below, result
        return None if last[2] is None else _cut(last[2], motion)

    def drives_on(self, motion: Motion) -> np.ndarray | None:
        """Return (N,) 1 where the drives are on, 0 where closed brakes hold the joints; None: they are always on."""
        brakes = next((effect for effect in self._power if effect.frees_joints), None)
        return None if brakes is None else self.columns(brakes, motion, None)[:, 0]

    def _while_on(self, effect: Effect, motion: Motion, columns: np.ndarray) -> np.ndarray:
        """Return an effect's columns without the heat of drives that are off."""
        if not (effect.electrical_loss and isinstance(effect, JointEffect)):
            return columns
        on = self.drives_on(motion)
        return columns if on is None else columns * on[:, None]

    def _contribution(self, effect: Effect, motion: Motion, values: np.ndarray, below: Predicted | None) -> np.ndarray:
        """Return what (k,) coefficients of an effect of torque add, (N, n) N m; `below` as in `columns`."""
        if effect.memory or not effect.acts_in(motion):
            return self._added(effect, motion, below, values)
        return effect.contribution(self.robot, motion, values, _part(below, motion))

    def _carried(self, effect: Effect, motion: Motion, along: np.ndarray, below: Predicted | None) -> np.ndarray:
        """Return (N, k) what columns of an effect of torque carry `along` (N, n); `below` as in `columns`."""
        if effect.memory or not effect.acts_in(motion):
            return np.asarray(np.einsum("njk,nj->nk", self.columns(effect, motion, below), along))
        return effect.carried(self.robot, motion, along, _part(below, motion))

    def bodies(self, motion: Motion, values: np.ndarray) -> np.ndarray | None:
        """Return the (10 n,) inertial parameters with payload by (K,) torque coefficients; None: those of the URDF."""
        total = values + self.shift(motion)
        own = next((own for effect, own in self._torque_places.items() if effect.bodies), None)
        return None if own is None else np.asarray(total[own])

    def _below(self, motion: Motion, values: np.ndarray | None) -> Mapping[int, Predicted]:
        """Return what effects of torque are built on, by their stage: over the whole run."""
        return self._torques(motion, values).below if self.coupled else {}

    def _torques(self, motion: Motion, values: np.ndarray | None) -> _Torques:
        """Predict stage by stage; the last run is remembered, as runs are read piece by piece."""
        whole = motion.whole or motion
        values = expected(self.torque_terms) if values is None else values
        last = self._last_torques
        if last is None or last.motion is not whole or last.values != values.tobytes():
            last = self._last_torques = self._predict_torques(whole, values)
        return last

    def _predict_torques(self, whole: Motion, values: np.ndarray) -> _Torques:
        total, bodies = values + self.shift(whole), self.bodies(whole, values)
        real, shown = np.zeros(whole.dq.shape), np.zeros(whole.dq.shape)
        below: dict[int, Predicted] = {}
        for stage in sorted({effect.stage for effect in self._torque}):
            now = [(effect, own) for effect, own in self._torque_places.items() if effect.stage == stage]
            measured = any(effect.channel == "measurement" for effect, _ in now) and stage > 1
            below[stage] = Predicted(shown.copy() if measured else real.copy(), bodies=bodies)
            for piece in whole.pieces(_PIECE):
                cut = slice(piece.start - whole.start, piece.start - whole.start + len(piece.time))
                for effect, own in now:
                    if not total[own].any():
                        continue
                    part = self._contribution(effect, piece, total[own], below[stage])
                    shown[cut] += part
                    if effect.channel == "torque":
                        real[cut] += part
        return _Torques(whole, values.tobytes(), below, real)

    def _powers(
        self, motion: Motion, torque_values: np.ndarray, power_values: np.ndarray | None, logged: bool
    ) -> dict[int, Predicted]:
        """Return what lower stages predict, for each stage of power, over the whole run."""
        whole = motion.whole or motion
        key = logged, torque_values.tobytes(), b"" if power_values is None else power_values.tobytes()
        if self._last_powers is None or self._last_powers[0] is not whole or self._last_powers[1] != key:
            values = expected(self.power_terms) if power_values is None else power_values
            pieces = [self._torque_by(piece, torque_values, logged) for piece in whole.pieces(_PIECE)]
            self._last_powers = whole, key, self._predict_powers(whole, np.concatenate(pieces), values)
        return self._last_powers[2]

    def _predict_powers(self, whole: Motion, torque: np.ndarray, values: np.ndarray) -> dict[int, Predicted]:
        power, axes = np.zeros(len(torque)), np.zeros(len(torque))
        below: dict[int, Predicted] = {}
        places = _places(self._power, self.robot)
        for effect, own in sorted(places.items(), key=lambda pair: pair[0].stage):
            if effect.stage not in below:
                below[effect.stage] = Predicted(torque, power.copy(), axes.copy())
            part = self.columns(effect, whole, below[effect.stage]) @ values[own]
            power += part
            axes += part if self.on_the_bus[own].any() else 0.0
        return below


def expected(terms: Sequence[tuple[Effect, Term]]) -> np.ndarray:
    """Return what coefficients are expected to be, (K,)."""
    return np.array([term.expected for _, term in terms], dtype=float)


def _places(effects: Sequence[Effect], robot: Robot) -> dict[Effect, slice]:
    """Return the place of each effect's coefficients among all."""
    ends = np.cumsum([0, *(len(effect.terms(robot)) for effect in effects)]).tolist()
    return {effect: slice(*own) for effect, own in zip(effects, pairwise(ends), strict=True)}


def _part(below: Predicted | None, motion: Motion) -> Predicted | None:
    return below and below.part(motion.start, motion.start + len(motion.time))


def _cut(of_whole: np.ndarray, motion: Motion) -> np.ndarray:
    return of_whole[motion.start : motion.start + len(motion.time)]


def _span(columns: np.ndarray, used: np.ndarray) -> Span:
    """Return which of columns (M, k) span those `used` (k,), by a pivoted QR, and the (r, used) matrix that does so."""
    places = np.flatnonzero(used)
    size = np.linalg.norm(columns[:, places], axis=0)
    size[size == 0] = 1.0
    factor, order = scipy.linalg.qr(columns[:, places] / size, mode="r", pivoting=True)
    own = np.abs(np.diag(factor)) > _INDEPENDENT
    rank = int(own.sum())
    mixed = np.empty((rank, len(places)))
    mixed[:, order] = scipy.linalg.solve_triangular(factor[:rank, :rank], factor[:rank]) / size[order[:rank], None]
    return places[order[:rank]], mixed * size


def side_by_side(parts: Sequence[np.ndarray]) -> np.ndarray:
    """Return columns (N, some) of several arrays as one, each column in one stretch of memory: so it is filtered."""
    return np.concatenate([part.T for part in parts]).T

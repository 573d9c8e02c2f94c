"""Friction that differs from run to run: by how much, and equations in which that is noise.

A joint's coefficients of friction are others in each run: it is warmer, or the grease lies elsewhere. By how much is
one share for each kind of coefficient, over all joints: that which makes the coefficients of the runs likeliest, each
known as well as the blocks of its run agree (restricted maximum likelihood). With it the rows of a run have the
covariance `noise (I + Z D Z')`, Z being its columns of friction; times its inverse root they have noise alone.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence, Set
from dataclasses import dataclass, replace

import numpy as np

from irtwin.effects.sensing import OffsetOfRun
from irtwin.gap.regression.normal_equations import System, twin_values
from irtwin.identification.accumulate import Block
from irtwin.robot.description import Robot

_SHARES = np.array([0.0, *np.geomspace(0.0025, 0.32, 15)])  # of a coefficient
_ONE_JOINT = 3.0  # of log likelihood, the most that one joint has against a share: it may be modelled badly
_LEAST, _BEYOND = 0.02, 2.0  # of dry friction, what no run tells of its neighbours; deviations
_NONE = 1e-6  # N m or N: dry friction of no joint
_HELD = 1e-6  # of the spread of a number that is not fitted
_KNOWN = 1e-8  # of the best known combination of coefficients: a run with less of another does not tell them apart


@dataclass(frozen=True)
class RunFriction:
    """An equation's columns of friction: their `places` in its factors, `kinds` and `values`, each (k,).

    `information` (k, k) and `score` (k,) of relative deviations in each run; `noise`: by how much the blocks of a run
    disagree, a mean square; `slow`: what a row counts in which dry friction turns.
    """

    places: np.ndarray
    kinds: tuple[str, ...]
    values: np.ndarray
    information: Mapping[str, np.ndarray]
    score: Mapping[str, np.ndarray]
    noise: float
    slow: float

    def deviations(self, run: str, spread: np.ndarray) -> np.ndarray:
        """Return a run's relative deviations (k,), drawn in towards none by how far they `spread` (k,)."""
        known = self.information[run] / self.noise * spread * spread[:, None]
        score = spread * self.score[run] / self.noise
        return np.asarray(spread * np.linalg.solve(known + np.eye(len(spread)), score))

    def likelihood(self, place: int, runs: Set[str]) -> np.ndarray:
        """Return the log likelihood of each share, of the deviations of some runs about their mean."""
        deviation, variance = np.array([*self._known(place, runs)]).reshape(-1, 2).T
        if len(deviation) < 2:
            return np.zeros(len(_SHARES))
        together = variance + _SHARES[:, None] ** 2
        weight = 1 / together
        mean = (deviation * weight).sum(axis=1) / weight.sum(axis=1)
        squares = ((deviation - mean[:, None]) ** 2 * weight).sum(axis=1)
        return np.asarray(-0.5 * (np.log(together).sum(axis=1) + squares + np.log(weight.sum(axis=1))))

    def _known(self, place: int, runs: Set[str]) -> Iterator[tuple[float, float]]:
        for run in sorted(runs & set(self.information)):
            known = self.information[run]
            if np.linalg.cond(known) < 1 / _KNOWN:
                inverse = np.linalg.inv(known)
                yield float((inverse @ self.score[run])[place]), float(inverse[place, place] * self.noise)


@dataclass(frozen=True)
class RunToRun:
    """`shares`: by what each kind of coefficient differs from run to run, one standard deviation, of itself.

    Empty where no side has two runs. `frictions`: each equation's, None where it has none.
    """

    shares: Mapping[str, float]
    frictions: tuple[RunFriction | None, ...]

    @classmethod
    def of(cls, system: System, sides: Sequence[Set[str]]) -> RunToRun:
        """Estimate it from runs of a system: those of one of the `sides` have the same coefficients but for it."""
        alone, runs = system.with_columns(())[0], set().union(*sides)
        apart, count = alone.by_speed, len(alone.pattern)
        noise = apart.residual_rms((), apart.noise_before)
        values = twin_values(apart, apart.solution((), apart.total(noise)))
        slow = (noise[:count] / noise[-count:]) ** 2
        frictions = tuple(_friction(alone, k, values, runs, float(slow[k])) for k in range(count))
        of_torque = frictions[: len(frictions) - system.beside_power]
        kinds = dict.fromkeys(kind for friction in of_torque if friction is not None for kind in friction.kinds)
        told = any(len(side) > 1 for side in sides)
        return cls({kind: _share(kind, of_torque, sides) for kind in kinds} if told else {}, frictions)

    def steadied(self, system: System) -> System:
        """Return the system with each run's rows times the inverse root of their covariance."""
        if not any(self.shares.values()):
            return system
        factors = [list(block.factors) for block in system.blocks]
        for equation, friction in enumerate(self.frictions):
            if friction is None:
                continue
            size = self._spread(friction) * friction.values / np.sqrt(friction.noise)
            for run in friction.information:
                mine = [k for k, block in enumerate(system.blocks) if block.run == run]
                counts = [_counting(system.blocks[k], equation, friction.slow) for k in mine]
                white = _whitened([factors[k][equation] for k in mine], counts, friction.places, size)
                for k, factor in zip(mine, white, strict=True):
                    factors[k][equation] = factor
        blocks = zip(system.blocks, factors, strict=True)
        return replace(system, blocks=tuple(replace(block, factors=tuple(own)) for block, own in blocks))

    def mean_squares(self, alike: Sequence[Sequence[str]], rows: Mapping[str, np.ndarray]) -> np.ndarray:
        """Return what it makes of each equation between runs that are `alike`, of `rows` (g,) each: (g,) a row."""
        means = np.zeros(len(self.frictions))
        for equation, friction in enumerate(self.frictions):
            if friction is None:
                continue
            squares = count = 0.0
            for some in alike:
                known = [run for run in some if run in friction.information]
                deviations = [friction.deviations(run, self._spread(friction)) for run in known]
                for run, own in zip(known, deviations, strict=True):
                    less = own - np.mean(deviations, axis=0)
                    squares += float(less @ friction.information[run] @ less)
                    count += float(rows[run][equation]) * (1 - 1 / len(known))
            means[equation] = squares / count if count else 0.0
        return means

    def _spread(self, friction: RunFriction) -> np.ndarray:
        return np.array([self.shares.get(kind, 0.0) for kind in friction.kinds])


def _whitened(
    factors: Sequence[np.ndarray], counts: Sequence[np.ndarray], places: np.ndarray, size: np.ndarray
) -> list[np.ndarray]:
    """Return a run's factors times the inverse root of their covariance, which their columns of a `size` (k,) make."""
    columns = [factor[:, places] * size for factor in factors]
    counting = [(count * own).T for count, own in zip(counts, columns, strict=True)]
    products = np.sum([counted @ own for counted, own in zip(counting, columns, strict=True)], axis=0)
    across = np.sum([counted @ factor for counted, factor in zip(counting, factors, strict=True)], axis=0)
    less = _root(products) @ across
    return [factor - own @ less for factor, own in zip(factors, columns, strict=True)]


def _root(products: np.ndarray) -> np.ndarray:
    """Return K with `I - Z K Z'` the inverse root of `I + Z Z'`, of the products Z'Z (k, k)."""
    squares, axes = np.linalg.eigh(products)
    squares = np.maximum(squares, np.finfo(float).tiny)
    return np.asarray((axes * (-np.expm1(-0.5 * np.log1p(squares)) / squares)) @ axes.T)


def _counting(block: Block, equation: int, slow: float) -> np.ndarray:
    """Return what each row of a factor counts, (r, 1)."""
    rows = np.ones((len(block.factors[equation]), 1))
    if block.slow is not None:
        rows[block.slow.begin[equation] :] = slow
    return rows


def _friction(system: System, equation: int, values: np.ndarray, runs: Set[str], slow: float) -> RunFriction | None:
    used = np.flatnonzero(system.pattern[equation])
    inside = used[used < system.base]
    differs = [system.terms[k][0].differs_by_run and values[k] > 0 for k in inside]
    places = np.flatnonzero(differs)
    if not len(places):
        return None
    own, known, scores = inside[places], dict[str, list[np.ndarray]](), dict[str, list[np.ndarray]]()
    for block in system.blocks:
        factor = block.factors[equation]
        if block.run in runs and len(factor):
            left = factor[:, -1] - factor[:, : len(inside)] @ values[inside]
            columns = factor[:, places] * values[own]
            counting = (_counting(block, equation, slow) * columns).T
            known.setdefault(block.run, []).append(counting @ columns)
            scores.setdefault(block.run, []).append(counting @ left)
    noise = _disagreement(known, scores)
    kinds = tuple(str(system.terms[k][0].differs_by_run) for k in own)
    if not noise:
        return None
    information, score = ({run: np.sum(blocks, axis=0) for run, blocks in of.items()} for of in (known, scores))
    return RunFriction(places, kinds, values[own], information, score, noise, slow)


def _disagreement(known: Mapping[str, Sequence[np.ndarray]], scores: Mapping[str, Sequence[np.ndarray]]) -> float:
    """Return by how much the blocks of a run disagree, of their information and score, a mean square; 0: unknown."""
    squares, more = 0.0, 0
    for run, matrices in known.items():
        whole = np.linalg.lstsq(np.sum(matrices, axis=0), np.sum(scores[run], axis=0), rcond=_KNOWN)[0]
        for products, score in zip(matrices, scores[run], strict=True):
            missed = score - products @ whole
            squares += float(missed @ np.linalg.pinv(products, rcond=_KNOWN, hermitian=True) @ missed)
        more += (len(matrices) - 1) * len(whole)
    return squares / more if more else 0.0


def _share(kind: str, frictions: Sequence[RunFriction | None], sides: Sequence[Set[str]]) -> float:
    """Return the likeliest share of a kind of coefficient, over all joints."""
    total = np.zeros(len(_SHARES))
    for friction in frictions:
        if friction is not None and kind in friction.kinds:
            likely = np.sum([friction.likelihood(friction.kinds.index(kind), side) for side in sides], axis=0)
            total += np.maximum(likely - likely.max(), -_ONE_JOINT)
    return float(_SHARES[np.argmax(total)])


def share_of_offsets(system: System, robot: Robot, sides: Sequence[Set[str]]) -> float | None:
    """Return by how much the offset of a run may differ, as a share of each joint's dry friction; None: nobody knows.

    Twice what runs of one of the `sides` differ by; each run of the system but the first has an `OffsetOfRun`.
    """
    vector = system.solution((), system.total(system.noise_before))
    values = twin_values(system, vector)
    offsets = {block.run: np.zeros(len(robot.joints)) for block in system.blocks}
    for value, (effect, term) in zip(values, system.terms, strict=True):
        if isinstance(effect, OffsetOfRun) and effect.runs and term.joint and effect.runs[0] in offsets:
            offsets[effect.runs[0]][robot.joint_names.index(term.joint)] = value
    friction = np.array([joint.dry_friction or 0.0 for joint in robot.joints])
    known = friction > _NONE
    squares = more = 0.0
    for side in sides:
        own = [offsets[run] for run in offsets if run in side]
        if len(own) > 1:
            differing = np.array(own)[:, known] / friction[known]
            squares += float(((differing - differing.mean(axis=0)) ** 2).sum())
            more += (len(own) - 1) * differing.shape[1]
    return max(_BEYOND * float(np.sqrt(squares / more)), _LEAST) if more else None


def with_offsets_held(system: System, chosen: Sequence[int]) -> System:
    """Return the system with the offset of each run as it is beside the chosen columns.

    So what these close is not made up for by offsets where they are left out.
    """
    if not chosen or not any(isinstance(effect, OffsetOfRun) for effect, _ in system.terms):
        return system
    noise = system.residual_rms(chosen, system.noise_before)
    values = twin_values(system, system.solution(chosen, system.total(noise)))
    held = tuple(
        (effect, replace(term, expected=float(value), spread=_HELD * term.spread))
        if isinstance(effect, OffsetOfRun)
        else (effect, term)
        for (effect, term), value in zip(system.terms, values, strict=True)
    )
    return replace(system, terms=held)

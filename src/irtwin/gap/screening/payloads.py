"""Payloads that nobody told, in some of the runs: which runs carry one.

A payload is a change of the last body, so that a fit to all runs takes half of it into the body where half of them
carry it. Here the runs are parted in two, and each run's part is told by some joints and judged on another.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from irtwin.effects.load import Payload
from irtwin.effects.rigid_body import flange_frame, to_body
from irtwin.gap.regression.cholesky import factored, solved
from irtwin.gap.regression.normal_equations import System
from irtwin.gap.thresholds import SomePayload
from irtwin.identification.progress import Tell, paced
from irtwin.robot.description import Robot

_FLIPS = 999
_SWEEPS = 10


def untold_payload(
    robot: Robot, system: System, noise: np.ndarray, limits: SomePayload, seed: int, tell: Tell | None = None
) -> Payload | None:
    """Return the payload that some observed runs carry and others do not; None where none shows.

    system: of torque, with the twin's rigid bodies; noise: (n,) RMS of each joint's residual, N m. It explains enough
    of joints by which it was not told which runs carry it, without the runs' group: more than under random signs of the
    groups, or of each joint in each where groups are so few that all of one sign would still be chance. `tell` is told
    how far that has come, where it takes long.
    """
    parts = _Parts.of(robot, system, noise, limits.fewest_runs, tell)
    if parts is None:
        return None
    with_load = parts.carrying(np.arange(len(parts.runs)))
    if not with_load.any() or with_load[parts.observed].all():
        return None
    of_joints = parts.judged(tell)
    gain = of_joints.sum(axis=1)
    told = gain if 2.0 ** -len(gain) <= limits.alpha else of_joints.ravel()
    signs = np.random.default_rng(seed).choice([-1.0, 1.0], (_FLIPS, len(told)))
    p = float((1 + np.sum(signs @ told >= told.sum())) / (1 + _FLIPS))
    if gain.mean() < limits.least_gain or p > limits.alpha:
        return None
    return Payload(runs=tuple(run for run, carries in zip(parts.runs, with_load, strict=True) if carries))


def beside(robot: Robot, system: System, noise: np.ndarray, payload: Payload) -> tuple[np.ndarray, np.ndarray] | None:
    """Return the twin's coefficients (D,), in units of the prior, and a payload's (10,) in some runs, fitted together.

    None where the twin has no last body, or groups are stretches of runs.
    """
    parts = _Parts.of(robot, system, noise, fewest=0)
    if parts is None:
        return None
    fold = _Fold(parts, np.arange(len(parts.runs)))
    values = fold.values(np.isin(parts.runs, payload.runs or ()))
    return values[: system.base], values[system.base :] * _spread(robot)


@dataclass(frozen=True)
class _Parts:
    """Each run's products (R, D, D) of [twin's columns | payload | measured], and its group (R,).

    of_joints: the products (R, n) of each joint among the columns that act on it, `acting` (n,): most do not.
    """

    runs: tuple[str, ...]
    products: np.ndarray
    of_joints: list[list[np.ndarray]]
    acting: list[np.ndarray]
    rows: np.ndarray
    group: np.ndarray
    observed: np.ndarray
    base: int
    prior: np.ndarray

    @classmethod
    def of(
        cls, robot: Robot, system: System, noise: np.ndarray, fewest: int, tell: Tell | None = None
    ) -> _Parts | None:
        """Take the runs apart; None where too few are observed, or groups are stretches of runs."""
        runs = tuple(dict.fromkeys(block.run for block in system.blocks))
        groups = [{int(g) for g, b in zip(system.group, system.blocks, strict=True) if b.run == run} for run in runs]
        seen = {block.run for block, observed in zip(system.blocks, system.observed, strict=True) if observed}
        observed = np.array([run in seen for run in runs])
        onto = _payload_columns(robot, system)
        if onto is None or observed.sum() < fewest or any(len(one) > 1 for one in groups):
            return None
        base, size = system.base, system.base + onto.shape[1] + 1
        full = np.zeros((base + 1, size))
        full[:base, :base], full[:base, base:-1], full[-1, -1] = np.eye(base), onto, 1.0
        acting = [_acting(full, row[:base]) for row in system.pattern]
        of_joints = [[np.zeros((len(own), len(own))) for own in acting] for _ in runs]
        rows, told = np.zeros(len(runs)), paced(tell)
        for number, block in enumerate(system.blocks):
            told(f"  payloads in {block.run}")
            run = runs.index(block.run)
            rows[run] += block.rows.max()
            for joint, level in enumerate(noise):
                factor, used = system.factor(number, joint)
                inside = used < base
                mapped = factor[:, np.append(inside, True)] @ full[np.append(used[inside], base)] / level
                of_joints[run][joint] += (mapped.T @ mapped)[np.ix_(acting[joint], acting[joint])]
        products = np.zeros((len(runs), size, size))
        for total, each in zip(products, of_joints, strict=True):
            for places, own in zip(acting, each, strict=True):
                total[np.ix_(places, places)] += own
        return cls(
            runs,
            products,
            of_joints,
            acting,
            rows,
            np.array([one.pop() for one in groups]),
            observed,
            base,
            system.prior(),
        )

    def carrying(self, inside: np.ndarray) -> np.ndarray:
        """Return (R,) which runs carry the payload, as runs `inside` tell; the heavier where either part could.

        Runs are ordered by the mass that each would have alone, parted at the best place, and then moved one by one.
        """
        fold = _Fold(self, inside)
        tried = [int(k) for k in inside if self.observed[k]]
        order = [tried[k] for k in np.argsort([-fold.mass(k) for k in tried])]
        every = np.arange(len(self.runs))
        splits = [np.isin(every, order[:count]) for count in range(1, len(order) + 1)]
        found = max(splits, key=fold.gain)
        best = fold.gain(found)
        for _ in range(_SWEEPS):
            splits = [found ^ (every == k) for k in tried]
            moved = max(splits, key=fold.gain)
            if fold.gain(moved) <= best:
                break
            found, best = moved, fold.gain(moved)
        if len(tried) == len(inside) and fold.values(found)[self.base] < 0:
            return np.asarray(np.isin(every, tried) & ~found)
        return found

    def judged(self, tell: Tell | None) -> np.ndarray:
        """Return (G, n) the mean square gained in each observed group and joint, which had no say in it."""
        found, told = [], paced(tell)
        for group in dict.fromkeys(self.group[self.observed].tolist()):
            told(f"  payloads without group {group + 1}")
            rest = np.flatnonzero(self.group != group)
            own = np.flatnonzero(self.group == group)
            with_load = self.carrying(rest)
            if not with_load[rest].any():
                found.append(np.zeros(len(self.acting)))
                continue
            fold = _Fold(self, rest)
            plain, loaded = fold.values(np.zeros(len(self.runs), dtype=bool)), fold.values(with_load)
            empty = loaded.copy()
            empty[self.base :] = 0.0
            gain = np.stack([self._losses(own, plain) - self._losses(own, one) for one in (empty, loaded)])
            others = gain.sum(axis=2, keepdims=True) - gain
            chosen = np.take_along_axis(gain, others.argmax(axis=0)[None], axis=0)
            found.append(chosen[0].sum(axis=0) / self.rows[own].sum())
        return np.array(found)

    def _losses(self, runs: np.ndarray, values: np.ndarray) -> np.ndarray:
        """Return the squares (r, n) that coefficients leave of runs and joints."""
        vector = np.append(-values, 1.0)
        weights = [vector[places] for places in self.acting]
        return np.array(
            [
                [np.einsum("ab,a,b->", own, each, each) for own, each in zip(self.of_joints[run], weights, strict=True)]
                for run in runs
            ]
        )


def _acting(full: np.ndarray, own: np.ndarray) -> np.ndarray:
    """Return which columns act on a joint: `full` (K + 1, D) makes them of the twin's, `own` (K,), and the measured."""
    return np.flatnonzero(full[np.append(own, True)].any(axis=0))


class _Fold:
    """The fit of the twin, and of a payload in any of the runs, to some runs; the twin's part is solved once."""

    def __init__(self, parts: _Parts, inside: np.ndarray):
        """Take the runs to fit to."""
        base = parts.base
        products = parts.products
        total = products[inside].sum(axis=0)
        factor = factored(total[:base, :base], parts.prior)
        used = np.isin(np.arange(len(products)), inside)[:, None, None]
        self._twin = solved(factor, total[:base, -1])
        self._beside = products[:, :base, base:-1] * used
        self._imitated = np.stack([solved(factor, one) for one in self._beside])
        self._own = products[:, base:-1, base:-1] * used
        self._right = (products[:, base:-1, -1] - np.einsum("rak,a->rk", self._beside, self._twin)) * used[:, 0]

    def mass(self, run: int) -> float:
        """Return the mass that a run alone would have, in units of its prior, beside the twin that fits all."""
        return float(np.linalg.solve(self._own[run] + np.eye(len(self._own[run])), self._right[run])[0])

    def gain(self, carrying: np.ndarray) -> float:
        """Return the squares that a payload in some runs explains, (R,)."""
        return float(self._load(carrying) @ self._right[carrying].sum(axis=0))

    def values(self, carrying: np.ndarray) -> np.ndarray:
        """Return the coefficients of twin and payload, in units of their priors."""
        load = self._load(carrying)
        return np.append(self._twin - self._imitated[carrying].sum(axis=0) @ load, load)

    def _load(self, carrying: np.ndarray) -> np.ndarray:
        imitated = self._beside[carrying].sum(axis=0).T @ self._imitated[carrying].sum(axis=0)
        normal = self._own[carrying].sum(axis=0) - imitated + np.eye(len(imitated))
        return np.asarray(np.linalg.solve(normal, self._right[carrying].sum(axis=0)))


def _payload_columns(robot: Robot, system: System) -> np.ndarray | None:
    """Return (K, 10) the payload's columns made of those of the body that carries the flange, in units of priors."""
    frame = flange_frame(robot)
    last = robot.model.names[frame.parentJoint]
    bodies = [k for k, (effect, term) in enumerate(system.terms) if effect.bodies and term.joint == last]
    if len(bodies) != 10:
        return None
    onto = np.zeros((system.base, 10))
    onto[bodies] = to_body(frame.placement) * _spread(robot) / system.scale[bodies][:, None]
    return onto


def _spread(robot: Robot) -> np.ndarray:
    return np.array([term.spread for term in Payload().terms(robot)])

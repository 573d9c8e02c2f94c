"""Payloads that nobody told, in some of the runs: which runs carry one.

A payload is a change of the last body, so that a fit to all runs takes half of it into the body where half of them
carry it. Here the runs are parted in two, as explains most; whether there is a payload, the search decides.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from irtwin.effects.load import Payload
from irtwin.effects.rigid_body import flange_frame, to_body
from irtwin.gap.regression.cholesky import factored, solved
from irtwin.gap.regression.normal_equations import System
from irtwin.identification.progress import track
from irtwin.robot.description import Robot

_SWEEPS = 10  # over the runs, each moved to the other part


def untold_payload(robot: Robot, system: System, noise: np.ndarray) -> Payload | None:
    """Return the payload in some of the runs that explains most; None where they cannot be parted.

    system: of torque, with the twin's rigid bodies; noise: (n,) RMS of each joint's residual, N m.
    """
    parts = _Parts.of(robot, system, noise, fewest=2)
    if parts is None:
        return None
    with_load = parts.carrying()
    if with_load.all():
        return None
    return Payload(runs=tuple(run for run, carries in zip(parts.runs, with_load, strict=True) if carries))


def beside(robot: Robot, system: System, noise: np.ndarray, payload: Payload) -> tuple[np.ndarray, np.ndarray] | None:
    """Return the twin's coefficients (D,), in units of the prior, and a payload's (10,) in some runs, fitted together.

    None where the twin has no last body.
    """
    parts = _Parts.of(robot, system, noise, fewest=0)
    if parts is None:
        return None
    fold = _Fold(parts)
    values = fold.values(np.isin(parts.runs, payload.runs or ()))
    return values[: system.base], values[system.base :] * _spread(robot)


@dataclass(frozen=True)
class _Parts:
    """Each run's products (R, D, D) of [twin's columns | payload | measured]; `base` columns are the twin's."""

    runs: tuple[str, ...]
    products: np.ndarray
    observed: np.ndarray
    base: int
    prior: np.ndarray

    @classmethod
    def of(cls, robot: Robot, system: System, noise: np.ndarray, fewest: int) -> _Parts | None:
        """Take the runs apart; None where too few are observed, or the twin has no last body."""
        runs = tuple(dict.fromkeys(block.run for block in system.blocks))
        of_runs = replace(system, group=np.array([runs.index(block.run) for block in system.blocks]))
        onto = _payload_columns(robot, system)
        if onto is None or of_runs.group_observed.sum() < fewest:
            return None
        base, size = system.base, system.base + onto.shape[1] + 1
        full = np.zeros((base + 1, size))
        full[:base, :base], full[:base, base:-1], full[-1, -1] = np.eye(base), onto, 1.0
        products = []
        every = zip(runs, of_runs.moments(noise), strict=True)
        for _, moments in track(every, lambda pair: f"payloads in {pair[0]}"):
            kept = np.append(np.arange(base), moments.size - 1)
            products.append(full.T @ moments.among(kept, kept) @ full)
        return cls(runs, np.array(products), of_runs.group_observed, base, system.prior())

    def carrying(self) -> np.ndarray:
        """Return (R,) which runs carry the payload; the heavier where either part could.

        Runs are ordered by the mass that each would have alone, parted at the best place, and then moved one by one.
        """
        fold, every = _Fold(self), np.arange(len(self.runs))
        tried = [int(k) for k in np.flatnonzero(self.observed)]
        order = [tried[k] for k in np.argsort([-fold.mass(k) for k in tried])]
        splits = [np.isin(every, order[:count]) for count in range(1, len(order) + 1)]
        carrying = max(splits, key=fold.gain)
        best = fold.gain(carrying)
        for _ in range(_SWEEPS):
            splits = [carrying ^ (every == k) for k in tried]
            moved = max(splits, key=fold.gain)
            if fold.gain(moved) <= best:
                break
            carrying, best = moved, fold.gain(moved)
        if len(tried) == len(every) and fold.values(carrying)[self.base] < 0:
            return ~carrying
        return carrying


class _Fold:
    """The fit of the twin, and of a payload in any of the runs; the twin's part is solved once."""

    def __init__(self, parts: _Parts):
        """Take all runs."""
        base, products = parts.base, parts.products
        total = products.sum(axis=0)
        factor = factored(total[:base, :base], parts.prior)
        self._twin = solved(factor, total[:base, -1])
        self._beside = products[:, :base, base:-1]
        self._imitated = np.stack([solved(factor, block) for block in self._beside])
        self._own = products[:, base:-1, base:-1]
        self._right = products[:, base:-1, -1] - np.einsum("rak,a->rk", self._beside, self._twin)

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

"""The equations of torque and of power, with every candidate effect's columns beside those of the twin."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from irtwin.effects.effect import Effect, Predicted
from irtwin.effects.stack import Stack
from irtwin.gap.hypotheses import Column, candidate_columns
from irtwin.gap.system import System
from irtwin.identification.accumulate import Block, Rows, accumulate
from irtwin.robot.description import Robot
from irtwin.signals.motion import Motion

_FEWEST_GROUPS = 4
_GROUPS = 8  # of time, where the runs are fewer


@dataclass(frozen=True)
class Grouping:
    """Which runs are left out together: `label` of each run's programmed motion; `observed` runs' names."""

    label: dict[str, str]
    observed: frozenset[str]

    def of(self, blocks: Sequence[Block]) -> tuple[np.ndarray, np.ndarray]:
        """Return (B,) each block's group and whether it is observed; few runs are cut into stretches of time."""
        observed = np.array([block.run in self.observed for block in blocks])
        labels = [(block.run in self.observed, self.label[block.run]) for block in blocks]
        if len({label for label in labels if label[0]}) < _FEWEST_GROUPS:
            labels = [(*label, k) for label, k in zip(labels, _stretches(blocks), strict=True)]  # type: ignore[misc]
        order = {label: k for k, label in enumerate(dict.fromkeys(labels))}
        return np.array([order[label] for label in labels]), observed


def _stretches(blocks: Sequence[Block]) -> list[int]:
    count = {run: sum(block.run == run for block in blocks) for run in {block.run for block in blocks}}
    per_run = max(2, -(-_GROUPS // len(count)))
    seen: dict[str, int] = {}
    found = []
    for block in blocks:
        k = seen.get(block.run, 0)
        seen[block.run] = k + 1
        found.append(k * min(per_run, count[block.run]) // count[block.run])
    return found


Torque = Callable[[Motion], np.ndarray]


def torque_system(
    stack: Stack, motions: Sequence[Motion], grouping: Grouping, effects: Sequence[Effect], predicted: Torque | None
) -> System:
    """Reduce the equations of measured torque; `predicted` gives the joint torque that candidates may need."""
    robot = stack.robot
    columns = candidate_columns(robot, effects)
    pattern = np.concatenate([stack.pattern, _pattern(robot, effects, columns)], axis=1)

    def equations(motion: Motion) -> Rows:
        assert motion.torque is not None
        own = stack.torque_columns(motion)
        added = candidate.part(motion)
        return Rows(
            np.concatenate([own, added], axis=2), own @ stack.shift(motion), motion.torque, stack.undecided(motion)
        )

    def whole(motion: Motion) -> np.ndarray:
        return _candidates(robot, motion, effects, Predicted(predicted(motion)) if predicted else None)

    candidate = _Whole(motions, whole)
    blocks = accumulate(motions, equations, pattern)
    group, observed = grouping.of(blocks)
    return System(stack.torque_terms, columns, pattern, tuple(blocks), group, observed)


def power_system(
    stack: Stack,
    motions: Sequence[Motion],
    grouping: Grouping,
    effects: Sequence[Effect],
    predicted: Torque,
    power_of: Callable[[Motion, np.ndarray], tuple[np.ndarray, np.ndarray]],
) -> System:
    """Reduce the equation of measured power, on top of the joint torque that is predicted."""
    robot = stack.robot
    columns = candidate_columns(robot, effects)
    free = tuple(pair for pair in stack.power_terms if not pair[1].fixed)
    pattern = np.ones((1, len(free) + len(columns)), dtype=bool)
    fixed_values = np.array([term.expected for _, term in stack.power_terms])[stack.fixed]

    def equations(motion: Motion) -> Rows:
        assert motion.power is not None
        torque = predicted(motion)
        own = stack.power_columns(motion, torque)
        added = candidate.part(motion)
        known = own[:, stack.fixed] @ fixed_values
        joined = np.concatenate([own[:, ~stack.fixed], added], axis=1)
        return Rows(joined[:, None], known[:, None], motion.power[:, None])

    def whole(motion: Motion) -> np.ndarray:
        torque = predicted(motion)
        power, axes = power_of(motion, torque)
        return _candidates(robot, motion, effects, Predicted(torque, power, axes), "power")

    candidate = _Whole(motions, whole)
    blocks = accumulate(motions, equations, pattern)
    group, observed = grouping.of(blocks)
    return System(free, columns, pattern, tuple(blocks), group, observed)


class _Whole:
    """Candidate columns over whole runs, as some effects remember what went before; one run is held at a time."""

    def __init__(self, motions: Sequence[Motion], columns: Callable[[Motion], np.ndarray]):
        self._motions = {motion.run: motion for motion in motions}
        self._columns = columns
        self._run = ""
        self._held = np.zeros(0)

    def part(self, motion: Motion) -> np.ndarray:
        """Return the columns of a part of a run."""
        if motion.run != self._run:
            self._run, self._held = motion.run, self._columns(self._motions[motion.run])
        start = int(np.searchsorted(self._motions[motion.run].time, motion.time[0] - 1e-9))
        return self._held[start : start + len(motion.time)]


def _candidates(
    robot: Robot, motion: Motion, effects: Sequence[Effect], predicted: Predicted | None, signal: str = "torque"
) -> np.ndarray:
    parts = [np.zeros((*motion.dq.shape[: 1 if signal == "power" else 2], 0))]
    for effect in effects:
        terms = effect.terms(robot)
        columns = effect.columns(robot, motion, predicted)
        if terms and all(term.fixed for term in terms):
            parts.append((columns @ np.array([term.expected for term in terms]))[..., None])
        else:
            parts.append(columns[..., [k for k, term in enumerate(terms) if not term.fixed]])
    return np.concatenate(parts, axis=-1)


def _pattern(robot: Robot, effects: Sequence[Effect], columns: Sequence[Column]) -> np.ndarray:
    """Return (n, M) whether a candidate column can act on a joint, found at a few random states."""
    rng = np.random.default_rng(0)
    shape = (16, len(robot.joints))
    q, dq, ddq = rng.uniform(-2, 2, (3, *shape))
    temperature = rng.uniform(20, 60, shape)
    probe = Motion("probe", np.arange(16.0), q, dq, ddq, temperature=temperature)
    pattern = np.any(_candidates(robot, probe, effects, Predicted(rng.uniform(-50, 50, shape))) != 0, axis=0)
    for k, column in enumerate(columns):
        if column.term.joint is not None and column.term.link is None:
            pattern[robot.index(column.term.joint), k] = True
        elif not pattern[:, k].any():
            pattern[:, k] = True
    return np.asarray(pattern)

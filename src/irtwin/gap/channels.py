"""The equations of torque and of power, with every candidate effect's columns beside those of the twin."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from irtwin.effects.compliance import load_inertia, load_torque
from irtwin.effects.effect import Effect, Predicted
from irtwin.effects.stack import Stack
from irtwin.errors import InputError
from irtwin.gap.candidates import Below, Candidates, candidate_pattern
from irtwin.gap.headway import Tell, watched
from irtwin.gap.hypotheses import candidate_columns
from irtwin.gap.system import System
from irtwin.identification.accumulate import Block, Rows, accumulate
from irtwin.signals.motion import Motion

_FEWEST_GROUPS = 4
_GROUPS = 8  # of time, where the runs are fewer


@dataclass(frozen=True)
class Grouping:
    """Which runs are left out together: `label` of each run's programmed motion; `observed` runs' names."""

    label: dict[str, str]
    observed: frozenset[str]

    def few(self, runs: Iterable[str]) -> bool:
        """Return whether the programmed motions of these runs are too few to leave each out in turn."""
        return len({self.label[run] for run in runs if run in self.observed}) < _FEWEST_GROUPS

    def of(self, blocks: Sequence[Block]) -> tuple[np.ndarray, np.ndarray]:
        """Return (B,) each block's group and whether it is observed; few runs are cut into stretches of time.

        Raises InputError where none is.
        """
        observed = np.array([block.run in self.observed for block in blocks])
        if not observed.any():
            raise InputError("no observed run is longer than the filter with a joint that moves; log longer ones")
        labels = [(block.run in self.observed, self.label[block.run]) for block in blocks]
        if self.few(block.run for block in blocks):
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
    stack: Stack,
    motions: Sequence[Motion],
    grouping: Grouping,
    effects: Sequence[Effect],
    below: Below | None,
    tell: Tell | None = None,
) -> System:
    """Reduce the equations of measured torque; `below` gives over a whole run what candidates are built on.

    `tell` is told how far that has come, where it takes long. Raises InputError where too few samples are left.
    """
    robot = stack.robot
    columns = candidate_columns(robot, effects)
    tried = candidate_pattern(robot, effects, columns)
    pattern = np.concatenate([stack.pattern, tried], axis=1)

    def loaded(whole: Motion) -> Predicted:
        assert below is not None, "candidates are built on what the twin predicts"
        before = below(whole)
        load, inertia = load_torque(robot, whole, before), load_inertia(robot, whole, before)
        return replace(before, load=load, inertia=inertia)

    candidates = Candidates(robot, effects, tried, loaded)

    def equations(motion: Motion) -> Rows:
        assert motion.torque is not None
        own = stack.torque_columns(motion)
        joined = [
            np.concatenate([own[:, joint, used], added], axis=1)
            for joint, (used, added) in enumerate(zip(stack.pattern, candidates.part(motion), strict=True))
        ]
        return Rows(joined, own @ stack.shift(motion), motion.torque, stack.undecided(motion))

    blocks = accumulate(motions, watched(equations, motions, tell), pattern)
    return _judged(System(stack.torque_terms, columns, pattern, tuple(blocks), *grouping.of(blocks)))


def power_system(
    stack: Stack,
    motions: Sequence[Motion],
    grouping: Grouping,
    effects: Sequence[Effect],
    predicted: Torque,
    power_of: Callable[[Motion, np.ndarray], tuple[np.ndarray, np.ndarray]],
    tell: Tell | None = None,
) -> System:
    """Reduce the equation of measured power, on top of the joint torque that is predicted; `tell` as above."""
    robot = stack.robot
    columns = candidate_columns(robot, effects)
    free = tuple(pair for pair in stack.power_terms if not pair[1].fixed)
    pattern = np.ones((1, len(free) + len(columns)), dtype=bool)
    fixed_values = np.array([term.expected for _, term in stack.power_terms])[stack.fixed]

    def below(whole: Motion) -> Predicted:
        torque = predicted(whole)
        return Predicted(torque, *power_of(whole, torque))

    candidates = Candidates(robot, effects, np.ones((1, len(columns)), dtype=bool), below)

    def equations(motion: Motion) -> Rows:
        assert motion.power is not None
        own = stack.power_columns(motion, predicted(motion))
        known = own[:, stack.fixed] @ fixed_values
        joined = np.concatenate([own[:, ~stack.fixed], *candidates.part(motion)], axis=1)
        return Rows([joined], known[:, None], motion.power[:, None])

    blocks = accumulate(motions, watched(equations, motions, tell), pattern)
    return _judged(System(free, columns, pattern, tuple(blocks), *grouping.of(blocks)))


def _judged(system: System) -> System:
    """Return the system; raise InputError where its samples are so few that the twin would fit whatever they say."""
    samples = int(system.rows.sum())
    if samples <= system.base:
        raise InputError(
            f"{samples} samples are left of all runs to find {system.base} coefficients of the twin, which would fit "
            "whatever they say; log longer runs"
        )
    return system

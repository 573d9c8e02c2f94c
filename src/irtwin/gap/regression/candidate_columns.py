"""The columns of every candidate effect, run by run and part by part."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from irtwin.effects.effect import Effect, Predicted, stays_within
from irtwin.effects.stack import side_by_side
from irtwin.gap.regression.hypotheses import CandidateColumn
from irtwin.robot.description import Robot
from irtwin.signals.motion import Motion

_PIECE = 65536  # samples: computed at once, where a part alone would be computed with much of what is around it

Below = Callable[[Motion], Predicted]
Parts = list[list[np.ndarray]]
"""For each equation the columns that act in it, (N, some) each."""


@dataclass(frozen=True)
class _Held:
    """An effect's columns from sample `first` of a run on; right from `start` to `stop`, exclusive."""

    parts: Parts
    first: int
    start: int
    stop: int

    def covers(self, start: int, stop: int) -> bool:
        return self.start <= start and stop <= self.stop

    def cut(self, start: int, stop: int) -> Parts:
        return [[columns[start - self.first : stop - self.first] for columns in equation] for equation in self.parts]


class Candidates:
    """M candidate columns in g equations, each column held only where it acts.

    Effects with memory are computed over a whole run, or over a long piece of it if their memory has an end; one run is
    held at a time.
    """

    def __init__(
        self, robot: Robot, effects: Sequence[Effect], pattern: np.ndarray, below: Below, *, in_order: bool = True
    ):
        """Take which columns act in each equation, (g, M), and what the twin predicts `below` them over a whole run.

        `in_order`: all of a run is asked for, part by part.
        """
        self._robot, self._effects, self._below, self._at_once = robot, effects, below, _PIECE if in_order else 0
        self._equations = len(pattern)
        ends = np.cumsum([0, *(_count(effect, robot) for effect in effects)])
        self._patterns = [pattern[:, start:stop] for start, stop in pairwise(ends)]
        self._run: Motion | None = None
        self._predicted: Predicted | None = None
        self._held: dict[int, _Held] = {}
        self._piece_cut: tuple[tuple[int, int], Motion, Predicted | None] | None = None

    def part(self, motion: Motion) -> list[np.ndarray]:
        """Return the columns (N, k_e) of each equation over a part of a run."""
        whole = motion.whole or motion
        if self._run is not whole:
            self._hold(whole)
        equations: Parts = [[np.zeros((len(motion.time), 0))] for _ in range(self._equations)]
        for place in range(len(self._effects)):
            for equation, own in zip(equations, self._own(place, whole, motion), strict=True):
                equation += own
        return [side_by_side(equation) for equation in equations]

    def _own(self, place: int, whole: Motion, motion: Motion) -> Parts:
        """Return an effect's columns over a part of the run that is held."""
        start, stop = motion.start, motion.start + len(motion.time)
        reach = self._effects[place].reach
        if place not in self._held and reach is None:
            return self._columns(place, motion, self._predicted and self._predicted.part(start, stop))
        if place not in self._held or not self._held[place].covers(start, stop):
            assert reach is not None, "what has no reach is held over the whole run"
            self._held[place] = self._piece(
                place, whole, start, max(stop, start + self._at_once), round(reach * whole.rate)
            )
        return self._held[place].cut(start, stop)

    def _piece(self, place: int, whole: Motion, start: int, stop: int, around: int) -> _Held:
        """Compute an effect's columns over a piece of a run, with `around` samples before and after."""
        first, last = max(0, start - around), min(stop + around, len(whole.time))
        parts = self._columns(place, *self._cut(whole, first, last))
        return _Held(_alone(parts), first, start if first else 0, stop if last < len(whole.time) else last)

    def _cut(self, whole: Motion, first: int, last: int) -> tuple[Motion, Predicted | None]:
        """Return a piece of the run that is held: the same for effects in turn, which keep there what they share."""
        if self._piece_cut is None or self._piece_cut[0] != (first, last):
            predicted = self._predicted and self._predicted.part(first, last)
            self._piece_cut = (first, last), whole.part(first, last), predicted
        return self._piece_cut[1:]

    def _hold(self, whole: Motion) -> None:
        self._held, self._piece_cut = {}, None  # let go of the run before
        self._run, self._predicted = whole, self._below(whole) if self._effects else None
        for place, effect in enumerate(self._effects):
            if effect.memory and effect.reach is None:
                every = len(whole.time)
                self._held[place] = _Held(_alone(self._columns(place, whole, self._predicted)), 0, 0, every)

    def _columns(self, place: int, motion: Motion, predicted: Predicted | None) -> Parts:
        effect, robot = self._effects[place], self._robot
        if not effect.acts_in(motion):
            return [[np.zeros((len(motion.time), int(used.sum())))] for used in self._patterns[place]]
        if stays_within(effect) and effect.signal == "torque":  # dense, it would be zeros for the most part
            samples = effect.samples(robot, motion, predicted)
            acting = {joint.name for joint in effect.acting(robot)}
            return [
                [part[:, joint : joint + 1] for part in samples if name in acting]
                for joint, name in enumerate(robot.joint_names)
            ]
        columns = free_columns(effect, robot, motion, predicted)
        by_equation = columns[:, None] if columns.ndim == 2 else columns
        return [[by_equation[:, equation, used]] for equation, used in enumerate(self._patterns[place])]


def _alone(parts: Parts) -> Parts:
    """Return copies of columns, in memory of their own: those of joints that an effect does not act on can go."""
    return [[np.array(columns, order="F") for columns in equation] for equation in parts]


def free_columns(effect: Effect, robot: Robot, motion: Motion, predicted: Predicted | None) -> np.ndarray:
    """Return an effect's columns whose coefficients are free, (N, n, k) or (N, k); if all are known, their sum."""
    terms = effect.terms(robot)
    if terms and all(term.fixed for term in terms):
        return effect.contribution(robot, motion, np.array([term.expected for term in terms]), predicted)[..., None]
    columns = effect.columns(robot, motion, predicted)
    return columns if not any(term.fixed for term in terms) else columns[..., [not term.fixed for term in terms]]


def candidate_pattern(robot: Robot, effects: Sequence[Effect], columns: Sequence[CandidateColumn]) -> np.ndarray:
    """Return (n, M) whether a candidate column can act on a joint, found at a few random states."""
    rng = np.random.default_rng(0)
    shape = (16, len(robot.joints))
    q, dq, ddq = rng.uniform(-2, 2, (3, *shape))
    temperature = rng.uniform(20, 60, shape)
    probe = Motion(np.arange(16.0), q, dq, ddq, run="probe", temperature=temperature)
    predicted = Predicted(rng.uniform(-50, 50, shape))
    parts = [free_columns(effect, robot, probe, predicted) for effect in effects]
    pattern = np.any(np.concatenate([np.zeros((*shape, 0)), *parts], axis=2) != 0, axis=0)
    for k, column in enumerate(columns):
        if column.term.joint is not None and column.term.link is None:
            pattern[robot.index(column.term.joint), k] = True
        elif not pattern[:, k].any():
            pattern[:, k] = True
    return np.asarray(pattern)


def _count(effect: Effect, robot: Robot) -> int:
    terms = effect.terms(robot)
    return 1 if terms and all(term.fixed for term in terms) else sum(not term.fixed for term in terms)

"""A programme: a measured motion as moves from rest to rest and the pauses between them; each may be retimed."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np

from irtwin.errors import InputError
from irtwin.signals.motion import BRIEF, Motion, standstill
from irtwin.signals.sampling import interpolated


@dataclass(frozen=True)
class Section:
    """Samples `first` to `last` of a motion: a "move", a "pause", or "cut": a move that the log has not whole."""

    first: int
    last: int
    kind: str


@dataclass(frozen=True)
class SectionedMotion:
    """A motion and its sections in order; they share their ends."""

    motion: Motion
    sections: tuple[Section, ...]

    @cached_property
    def seconds(self) -> np.ndarray:
        """How long each section takes, (S,) s."""
        time = self.motion.time
        return np.array([time[section.last] - time[section.first] for section in self.sections])

    def are(self, kind: str) -> np.ndarray:
        """Return which sections are of a kind, (S,) bool."""
        return np.array([section.kind == kind for section in self.sections])

    def alone(self, number: int, factor: float = 1.0) -> Motion:
        """Return a section alone, `factor` times as long."""
        section = self.sections[number]
        motion = self.motion.part(section.first, section.last + 1)
        return SectionedMotion(motion, (Section(0, len(motion.time) - 1, section.kind),)).retimed(np.array([factor]))

    def timed(self, factors: np.ndarray) -> SectionedMotion:
        """Return the programme with each section (S,) times as long; what takes no time is left out."""
        motion = self.retimed(factors)
        bounds = np.round(np.append(0.0, np.cumsum(self.seconds * factors)) * motion.rate).astype(int).tolist()
        ends = zip(self.sections, pairwise(bounds), strict=True)
        return SectionedMotion(motion, tuple(Section(*own, section.kind) for section, own in ends if own[1] > own[0]))

    def retimed(self, factors: np.ndarray) -> Motion:
        """Return the motion with each section (S,) times as long, at the log's rate; by a factor of zero left out."""
        old = self.motion.time[[self.sections[0].first, *(section.last for section in self.sections)]]
        new = np.concatenate([[0.0], np.cumsum(self.seconds * factors)])
        count = max(2, round(new[-1] * self.motion.rate) + 1)
        time = np.linspace(0.0, new[-1], count)
        own = np.clip(np.searchsorted(new, time, side="right") - 1, 0, len(factors) - 1)
        while (gone := factors[own] == 0.0).any():  # the last sample may lie at the end of what is left out
            own[gone] -= 1
        at = old[own] + (time - new[own]) / factors[own]
        motion, pace = self.motion, factors[own][:, None]
        q, dq, ddq = (interpolated(motion.time, values, at) for values in (motion.q, motion.dq, motion.ddq))
        return motion.moved(time, q, dq / pace, ddq / pace**2)


def programme_of(motion: Motion, place: str) -> SectionedMotion:
    """Return a motion's moves and pauses. Raises InputError by `place` where it has no whole move."""
    still = standstill(motion)
    bounds = _bounds(still)
    for first, last in pairwise(bounds[1:-1]):
        if still[first] and motion.time[last] - motion.time[first] < BRIEF:
            still[first:last] = False
    bounds = _bounds(still)
    kinds = ["pause" if still[first] else "move" for first in bounds[:-1]]
    for end in (0, -1):
        kinds[end] = "pause" if still[end] else "cut"
    if "move" not in kinds:
        raise InputError(f'{place}: run "{motion.run}" has no move from rest to rest; name a run that has one')
    sections = zip(pairwise(bounds.tolist()), kinds, strict=True)
    return SectionedMotion(motion, tuple(Section(*ends, kind) for ends, kind in sections))


def _bounds(still: np.ndarray) -> np.ndarray:
    """Return the samples at which standing and moving begin, and the last one."""
    return np.unique([0, *(np.flatnonzero(still[1:] != still[:-1]) + 1), len(still) - 1])

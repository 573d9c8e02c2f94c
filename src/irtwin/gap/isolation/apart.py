"""A channel's equations as a gap is judged by them: rows in which dry friction turns stand apart.

Nobody knows the law of friction there. What causes leave of these rows is their noise, and no gap; what they close of
them counts by it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from irtwin.gap.regression.held_out import HeldOut, held_out
from irtwin.gap.regression.normal_equations import System, noise_before, observed_rms, reference_rms
from irtwin.identification.progress import Tell


@dataclass(frozen=True)
class Apart:
    """`plain`: the equations of the twin as it is; `system`: with the causes, each one's columns in it `players`."""

    plain: System
    system: System
    players: tuple[list[int], ...]

    @classmethod
    def of(cls, plain: System, system: System, causes: Sequence[Sequence[int]]) -> Apart:
        """Take of a channel's equations the terms of the twin, and the causes' columns, alone."""
        kept, places = system.with_columns([k for columns in causes for k in columns])
        ends = np.cumsum([len(columns) for columns in causes])
        players = tuple(places[end - len(columns) : end] for end, columns in zip(ends, causes, strict=True))
        return cls(plain.with_columns(())[0].by_speed, kept.by_speed, players)

    @property
    def chosen(self) -> list[int]:
        """The columns of all causes."""
        return [k for columns in self.players for k in columns]

    @cached_property
    def noise(self) -> np.ndarray:
        """(g,), of rows apart (2 g,), RMS that the causes leave."""
        return self.system.residual_rms(self.chosen, noise_before(self.system))

    @cached_property
    def left(self) -> tuple[np.ndarray, np.ndarray]:
        """(g,) RMS left in observed runs by fits to all runs, without causes and with them, where the law is known."""
        known = self.plain.halves[0]
        before = observed_rms(self.plain, (), noise_before(self.plain))
        return before[known], observed_rms(self.system, self.chosen, self.noise)[known]

    def level(self, floor: np.ndarray) -> np.ndarray:
        """Return (g,) RMS beyond which a gap lies: the floor (g,), or what the other runs show, if that is more."""
        if not self.plain.both:
            return floor
        known = reference_rms(self.plain, noise_before(self.plain))[self.plain.halves[0]]
        return np.asarray(np.maximum(floor, known))

    def counted(self, squares: np.ndarray) -> np.ndarray:
        """Return squares of rows apart (..., 2 g) together, (..., g): slow ones in units of the noise of the others."""
        first = self.system.halves[0]
        weights = (self.noise[first] / np.stack([self.noise[half] for half in self.system.halves])) ** 2
        return np.asarray(sum(squares[..., half] * own for half, own in zip(self.system.halves, weights, strict=True)))

    def held_out(self, tell: Tell | None = None) -> HeldOut:
        """Return the squares of each observed group left out, counted so; `tell` as there."""
        found = held_out(self.system, noise_before(self.plain), self.noise, self.chosen, self.plain, tell)
        rows = np.asarray(sum(found.rows[:, half] for half in self.system.halves))
        return HeldOut(self.counted(found.before), self.counted(found.after), rows)

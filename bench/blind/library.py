"""The library of a case: measured torque (or power), the twin's columns, and those of every effect beside them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from irtwin.effects.catalogue import catalogue
from irtwin.effects.effect import Effect
from irtwin.gap.data.case import Case
from irtwin.gap.isolation.detectability import can_show
from irtwin.gap.regression.channel_equations import Torque, power_system, torque_system, with_load
from irtwin.gap.regression.cross_fitted import LeftOut, TwinPower
from irtwin.gap.regression.hypotheses import CHANGED, MISSING, Hypothesis, Variant, hypotheses
from irtwin.gap.regression.moments import Moments, Summed
from irtwin.gap.regression.normal_equations import System, twin_values
from irtwin.signals.motion import Motion


@dataclass(frozen=True)
class Library:
    """One channel's equations and the hypotheses about them, as the diagnosis has them.

    Products of columns are in units of the priors and of what the twin leaves of each equation.
    """

    channel: str
    system: System
    hypotheses: tuple[Hypothesis, ...]

    @cached_property
    def moments(self) -> list[Moments]:
        """Each group's products of columns, held equation by equation."""
        return list(self.system.moments(self.system.noise_before))

    @cached_property
    def groups(self) -> list[np.ndarray]:
        """Each group's products of all columns and the measurement, (D + 1, D + 1)."""
        return [one.of(np.arange(one.size)) for one in self.moments]

    @cached_property
    def total(self) -> np.ndarray:
        """The products over all groups."""
        return np.sum(self.groups, axis=0)

    @property
    def rows(self) -> float:
        """How many samples there are, over all equations."""
        return float(self.system.rows.sum())

    def beside_the_twin(self, products: np.ndarray) -> np.ndarray:
        """Return the products of what a fit of the twin's terms leaves of every column and the measurement."""
        return swept(products, range(self.system.base))


def torque_library(case: Case) -> tuple[Library, LeftOut]:
    """Return the library of torque, and what its columns are built on: what the twin says without the run."""
    stack = case.stack
    left_out = LeftOut(stack, torque_system(stack, case.with_torque, case.grouping, (), None))
    below = with_load(case.robot, left_out.below)
    system = torque_system(stack, case.with_torque, case.grouping, _shapes(case, "torque"), below)
    return Library("torque", system, _hypotheses(system, case)), left_out


def power_library(case: Case, torque: Torque) -> Library:
    """Return the library of power on top of a joint torque."""
    stack = case.stack
    power_of = TwinPower(stack, case.with_power, case.grouping, torque)
    shapes = _shapes(case, "power")
    system = power_system(stack, case.with_power, case.grouping, shapes, torque, power_of)
    return Library("power", system, _hypotheses(system, case))


class Explained:
    """The joint torque of the twin refitted with the variants chosen."""

    def __init__(self, case: Case, library: Library, left_out: LeftOut, chosen: Sequence[Variant]):
        """Take what was chosen of a library of torque, and what its columns were built on."""
        self._stack, self._system = case.stack, library.system
        self._below, self._chosen, self._observed = left_out.below, chosen, case.observed
        vector = self._system.solution([k for variant in chosen for k in variant.columns], Summed(library.moments))
        self._twin, self._values = twin_values(self._system, vector), vector * self._system.scale
        self._held: tuple[str, np.ndarray] | None = None

    def __call__(self, motion: Motion) -> np.ndarray:
        """Return the real joint torque, (N, n) N m, of a run or a part of one."""
        whole = motion.whole or motion
        if self._held is None or self._held[0] != whole.run:
            self._held = whole.run, self._torque(whole)
        return self._held[1][motion.start : motion.start + len(motion.time)]

    def _torque(self, whole: Motion) -> np.ndarray:
        system, torque = self._system, self._stack.real_torque(whole, self._twin)
        for variant in self._chosen:
            if variant.effect.channel != "torque":
                continue
            columns = variant.effect.columns(self._stack.robot, whole, self._below(whole))
            for k in variant.columns:
                if k < system.changed or whole.run in self._observed:
                    source = k - system.base - (len(system.columns) if k >= system.changed else 0)
                    torque = torque + columns[:, :, system.columns[source].index or 0] * self._values[k]
        return torque


def swept(products: np.ndarray, columns: Sequence[int] | range) -> np.ndarray:
    """Return the products of what a fit of these columns leaves of all (unit prior on each coefficient)."""
    inside = list(columns)
    normal = products[np.ix_(inside, inside)] + np.eye(len(inside))
    return np.asarray(products - products[inside].T @ np.linalg.solve(normal, products[inside]))


def _shapes(case: Case, signal: str) -> list[Effect]:
    return [
        shape
        for effect in catalogue().values()
        if effect.signal == signal and effect.id != "rigid_body" and can_show(effect, case.seen)
        for shape in effect.candidates(case.robot)
    ]


def _hypotheses(system: System, case: Case) -> tuple[Hypothesis, ...]:
    found = hypotheses(system.columns, system.base, MISSING, inside=case.modelled)
    if system.both:
        found += hypotheses(system.columns, system.changed, CHANGED)
    return tuple(found)

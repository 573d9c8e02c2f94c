"""A rehearsal: how sure the posterior would be of a cause once a programme was logged beside the data there are.

The programme is played in the twin with its causes: equations of a run, with what they give as measured. Beside those
of the data they are judged as these were.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache, cached_property

import numpy as np

from irtwin.effects.effect import Effect
from irtwin.effects.stack import Stack
from irtwin.errors import InputError
from irtwin.gap.data.case import Case
from irtwin.gap.isolation.cause import FoundCause
from irtwin.gap.isolation.finding import ChannelFinding
from irtwin.gap.isolation.structure_search import judged
from irtwin.gap.regression.candidate_columns import Below
from irtwin.gap.regression.channel_equations import Torque, power_system, torque_system
from irtwin.gap.regression.cross_fitted import TwinPower
from irtwin.gap.regression.groups import Grouping
from irtwin.gap.regression.hypotheses import Hypothesis
from irtwin.gap.regression.normal_equations import System
from irtwin.gap.thresholds import Criterion
from irtwin.identification.programmes import ExperimentProgramme
from irtwin.signals.motion import Motion

Equations = Callable[[Sequence[Motion], Sequence[Effect]], System]
"""A channel's equations of some motions, with the columns of some effects."""


@dataclass(frozen=True)
class Rehearsal:
    """The structure `true` (hypotheses of one shape each) and its `rivals`, in one channel.

    `sizes`: the coefficients of the true ones, by column. Causes have those of the fit; where `unseen`, data that hold
    an effect which they would not show are played, too.
    """

    finding: ChannelFinding
    equations: Equations
    true: tuple[Hypothesis, ...]
    rivals: tuple[Hypothesis, ...]
    sizes: Mapping[int, float]
    unseen: bool
    limits: Criterion

    def causes(self, programme: ExperimentProgramme | None) -> tuple[FoundCause, ...]:
        """Return the true structure's causes, as sure as the programme beside the data makes them; None: the data."""
        known, noise = self._known
        played = None if programme is None else self._played(programme)
        system = known.by_speed if played is None else known.joined(played).by_speed
        floor = self.finding.floor_within
        level = None if floor is None else np.tile(floor, len(system.halves))
        chosen = self._placed(self.true)
        return judged(system, chosen, [*chosen, *self._placed(self.rivals)], self.limits, level, noise)

    @cached_property
    def _reduced(self) -> tuple[System, dict[int, int]]:
        """The equations of the data with the columns in question alone, and the place of each of these."""
        asked = sorted(
            {k for hypothesis in (*self.true, *self.rivals) for shape in hypothesis.variants for k in shape.columns}
        )
        system, places = self.finding.steadied.system.with_columns(asked)
        return system, dict(zip(asked, places, strict=True))

    @cached_property
    def _known(self) -> tuple[System, np.ndarray]:
        """The equations of the data, and what the true structure leaves of each."""
        system = self._reduced[0]
        apart = system.by_speed
        chosen = [k for hypothesis in self._placed(self.true) for k in hypothesis.variants[0].columns]
        noise = apart.residual_rms(chosen, apart.noise_before)
        return system.measuring(self._values) if self.unseen else system, noise

    @cached_property
    def _values(self) -> np.ndarray:
        """The coefficients of all columns of the reduced equations, (D,)."""
        system, at = self._reduced
        values = np.zeros(len(system.scale))
        values[: system.base] = self.finding.estimate.values[: system.base]
        values[[at[k] for k in self.sizes]] = list(self.sizes.values())
        return values

    def _placed(self, some: Sequence[Hypothesis]) -> list[Hypothesis]:
        at = self._reduced[1]
        return [
            replace(
                hypothesis,
                variants=tuple(replace(v, columns=tuple(at[k] for k in v.columns)) for v in hypothesis.variants),
            )
            for hypothesis in some
        ]

    def _played(self, programme: ExperimentProgramme) -> System | None:
        """Return the equations of a programme; None where it is too short to say anything."""
        system = self._reduced[0]
        effects = list({id(column.effect): column.effect for column in system.columns}.values())
        acting = [replace(effect, runs=()) if effect.id in programme.without else effect for effect in effects]
        place = {id(effect): k for k, effect in enumerate(effects)}
        named = f"{programme.kind} {{}} {' '.join(programme.joints)}"
        motions = [
            replace(motion, run=named.format(k), torque=np.zeros(motion.dq.shape), power=np.zeros(len(motion.time)))
            for k, motion in enumerate(programme.motions)
        ]
        try:
            whole = self.equations(motions, acting)
        except InputError:
            return None
        index = {(id(column.effect), column.index): k for k, column in enumerate(whole.columns, start=whole.base)}
        columns = [index[id(acting[place[id(column.effect)]]), column.index] for column in system.columns]
        own, changes = np.split(self._values, [system.changed])
        own = own + np.pad(changes, (len(own) - len(changes), 0))
        return whole.with_columns(columns)[0].measuring(own)


def channel_equations(stacks: Mapping[str, Stack], case: Case, below: Below, torque: Torque) -> dict[str, Equations]:
    """Return each channel's equations.

    stacks: the effects that explain "torque" and "power"; `below` is what candidates for torque are built on, `torque`
    the joint torque for those of power.
    """

    @cache
    def power_of() -> TwinPower:
        return TwinPower(stacks["power"], case.with_power, case.grouping, torque)

    def of_torque(motions: Sequence[Motion], effects: Sequence[Effect]) -> System:
        return torque_system(stacks["torque"], motions, _each_alone(motions), effects, below)

    def of_power(motions: Sequence[Motion], effects: Sequence[Effect]) -> System:
        return power_system(stacks["power"], motions, _each_alone(motions), effects, torque, power_of())

    return {"torque": of_torque, "power": of_power}


def _each_alone(motions: Sequence[Motion]) -> Grouping:
    runs = [motion.run for motion in motions]
    return Grouping({run: run for run in runs}, frozenset(runs))

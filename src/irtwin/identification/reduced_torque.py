"""Measured torque, reduced once for many columns: a fit of some of them reads no sample again."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from irtwin.effects.effect import Effect, Term
from irtwin.effects.friction import CoulombFriction
from irtwin.effects.stack import Stack, side_by_side
from irtwin.identification.accumulate import Block, Rows, accumulate, triangle
from irtwin.signals.motion import Motion

Column = tuple[Effect, str | None, str | None, str]


@dataclass(frozen=True)
class ReducedTorque:
    """The equations of torque of each joint, without samples in which some effects are undecided, reduced to `blocks`.

    `places` say for each joint which column of its factors is which; one may stand under several names. `required`:
    effects without which a stack would have more samples.
    """

    blocks: Sequence[Block]
    places: Sequence[Mapping[Column, int]]
    required: frozenset[str] = frozenset({CoulombFriction.id})

    @classmethod
    def of_all(cls, stacks: Sequence[Stack], motions: Sequence[Motion]) -> ReducedTorque:
        """Reduce the columns of several stacks of one robot, which depend on no coefficients, reading samples once.

        Samples in which any of the stacks is undecided are left out for all: so they are held against one another.
        """
        robot, first = stacks[0].robot, stacks[0].effects
        common = [effect for effect in first if all(effect in stack.effects for stack in stacks)]
        joints: dict[Effect, set[str]] = {}
        for effect in (effect for stack in stacks for effect in stack.effects if effect not in common):
            joints.setdefault(replace(effect, joints=None), set()).update(joint.name for joint in effect.acting(robot))
        parts = [Stack(robot, common), *(Stack(robot, [shape.on(*sorted(own))]) for shape, own in joints.items())]

        def equations(motion: Motion) -> Rows:
            assert motion.torque is not None
            own, *others = (part.sparse_by_joint(motion) for part in parts)
            columns = [  # single columns take ten times as long to filter
                [*plain, side_by_side([column for columns in shapes for column in columns])]
                for plain, *shapes in zip(own, *others, strict=True)
            ]
            undecided = np.logical_or.reduce([part.undecided(motion) for part in parts])
            return Rows(columns, parts[0].shift_torque(motion, sparse=True), motion.torque, undecided)

        pattern = np.concatenate([part.pattern for part in parts], axis=1)
        terms = [column(*pair) for part in parts for pair in part.torque_terms]
        places = [{terms[k]: place for place, k in enumerate(np.flatnonzero(used))} for used in pattern]
        return cls(accumulate(motions, equations, pattern), places, frozenset())

    def of(self, stack: Stack) -> list[Block] | None:
        """Return the blocks of a stack's equations; None where some of its columns are not among these."""
        chosen = self._places_of(stack)
        if chosen is None:
            return None
        return [
            replace(block, factors=tuple(triangle(own[:, k]) for own, k in zip(block.factors, chosen, strict=True)))
            for block in self.blocks
        ]

    def has(self, stack: Stack) -> bool:
        """Return whether all columns of a stack are among these."""
        return self._places_of(stack) is not None

    def _places_of(self, stack: Stack) -> list[list[int]] | None:
        if not self.required.issubset(stack.ids):
            return None
        columns = [column(effect, term) for effect, term in stack.torque_terms]
        chosen = []
        for places, used in zip(self.places, stack.pattern, strict=True):
            own = [places.get(columns[k], -1) for k in np.flatnonzero(used)]
            if -1 in own:
                return None
            chosen.append([*own, -1])  # last the measurement
        return chosen


def column(effect: Effect, term: Term) -> Column:
    """Return what a column goes by: the same in whichever joints else the effect acts."""
    return replace(effect, joints=None), term.joint, term.link, term.name

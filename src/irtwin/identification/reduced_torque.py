"""Measured torque, reduced once for many columns: a fit of some of them reads no sample again."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from irtwin.effects.effect import Effect, Term
from irtwin.effects.friction import CoulombFriction
from irtwin.effects.stack import Stack
from irtwin.identification.accumulate import Block, triangle

Column = tuple[Effect, str | None, str | None, str]


@dataclass(frozen=True)
class ReducedTorque:
    """The equations of torque of each joint, without samples in which dry friction is undecided, reduced to `blocks`.

    `places` say for each joint which column of its factors is which; one may stand under several names.
    """

    blocks: Sequence[Block]
    places: Sequence[Mapping[Column, int]]

    def of(self, stack: Stack) -> list[Block] | None:
        """Return the blocks of a stack's equations; None where some of its columns are not among these."""
        if CoulombFriction.id not in stack.ids:
            return None
        columns = [column(effect, term) for effect, term in stack.torque_terms]
        chosen = []
        for places, used in zip(self.places, stack.pattern, strict=True):
            own = [places.get(columns[k], -1) for k in np.flatnonzero(used)]
            if -1 in own:
                return None
            chosen.append([*own, -1])  # last the measurement
        return [
            replace(block, factors=tuple(triangle(own[:, k]) for own, k in zip(block.factors, chosen, strict=True)))
            for block in self.blocks
        ]


def column(effect: Effect, term: Term) -> Column:
    """Return what a column goes by: the same in whichever joints else the effect acts."""
    return replace(effect, joints=None), term.joint, term.link, term.name

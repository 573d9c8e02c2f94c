"""Hypotheses: which effect may be missing or changed, and where."""

from __future__ import annotations

from collections.abc import Sequence, Set
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from irtwin.effects.effect import Effect, Term
from irtwin.robot.description import Robot

MISSING, CHANGED = "missing", "changed"

Place = tuple[str, str, str | None]
"""An effect, its scope, and the joint; None: of the whole robot."""


@dataclass(frozen=True)
class Variant:
    """An effect with one choice of its shape: the columns that it adds, by index, and their terms."""

    effect: Effect
    columns: tuple[int, ...]
    terms: tuple[Term, ...]

    @cached_property
    def unnamed(self) -> np.ndarray:
        """(k,) how large any healthy robot may have its coefficients, as a share of what the catalogue expects."""
        return np.array([term.unnamed / term.spread for term in self.terms])


@dataclass(frozen=True)
class Hypothesis:
    """An effect is missing from the twin, or has changed since the reference runs.

    `joint` is None for an effect of the whole robot; of the `variants` the data choose one.
    """

    effect: str
    joint: str | None
    scope: str
    variants: tuple[Variant, ...]

    @property
    def place(self) -> Place:
        """Its effect, scope and joint, which no other has."""
        return self.effect, self.scope, self.joint

    @property
    def nuisance(self) -> bool:
        """Whether it is what nobody states of any robot."""
        return self.variants[0].effect.nuisance


@dataclass(frozen=True)
class CandidateColumn:
    """One candidate column: the k-th of an effect, or (k None) what all its known coefficients give."""

    effect: Effect
    index: int | None
    term: Term


def place_of(term: Term) -> str | None:
    """Return the joint that a coefficient belongs to; None: the whole robot, or a link of it."""
    return term.joint if term.link is None else None


def candidate_columns(robot: Robot, effects: Sequence[Effect]) -> tuple[CandidateColumn, ...]:
    """Return the columns of effects with their terms; those of an effect without any free term become one."""
    columns: list[CandidateColumn] = []
    for effect in effects:
        terms = effect.terms(robot)
        if terms and all(term.fixed for term in terms):
            columns.append(CandidateColumn(effect, None, Term("share", "1", spread=1.0, lowest=0.0)))
        else:
            columns.extend(CandidateColumn(effect, k, term) for k, term in enumerate(terms) if not term.fixed)
    return tuple(columns)


def hypotheses(
    columns: Sequence[CandidateColumn], first: int, scope: str, *, inside: Set[tuple[str, str | None]] = frozenset()
) -> list[Hypothesis]:
    """Group candidate columns (the first of index `first`) into hypotheses of one scope, joint by joint.

    Effects on power, and those of which some size is expected in a joint, may also act in every joint at once; what is
    `inside` the twin, an effect and its joint, cannot be missing; joint None: nowhere.
    """
    places: dict[tuple[str, str | None], dict[int, list[int]]] = {}
    for k, column in enumerate(columns):
        effect = column.effect
        joint = place_of(column.term)
        if scope == MISSING and {(effect.id, joint), (effect.id, None)} & inside:
            continue
        keys = [joint, None] if joint and (effect.signal == "power" or column.term.expected) else [joint]
        for key in keys:
            places.setdefault((effect.id, key), {}).setdefault(id(effect), []).append(k)
    return [
        Hypothesis(
            effect,
            joint,
            scope,
            tuple(
                Variant(
                    columns[members[0]].effect,
                    tuple(first + k for k in members),
                    tuple(columns[k].term for k in members),
                )
                for members in variants.values()
            ),
        )
        for (effect, joint), variants in places.items()
    ]


def in_scope(candidates: Sequence[Hypothesis], *, both: bool) -> list[Hypothesis]:
    """Return hypotheses, the `missing` ones without the shapes that are a change's, those that changed with these.

    Such a shape is `of_change`, or acts in some observed runs only, beside reference runs (`both`).
    """
    inside = []
    for candidate in candidates:
        left_out = _never_changed if candidate.scope == CHANGED else _of_change
        kept = tuple(v for v in candidate.variants if not left_out(v.effect, both))
        if kept:
            inside.append(replace(candidate, variants=kept))
    return inside


def _never_changed(effect: Effect, both: bool) -> bool:
    return effect.never_changed and both


def _of_change(effect: Effect, both: bool) -> bool:
    return effect.of_change or (both and effect.runs is not None)

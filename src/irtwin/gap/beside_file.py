"""Causes beside a simulator: its numbers and the robot's; of its model's file, as they are best in that file."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Protocol

from irtwin.document.document import Cause, CauseParameter
from irtwin.effects.catalogue import catalogue
from irtwin.effects.effect import Term
from irtwin.gap.isolation.cause import FoundCause
from irtwin.gap.isolation.finding import ChannelFinding, numbers_without
from irtwin.gap.regression.hypotheses import CHANGED
from irtwin.gap.writing import least_change, parameter
from irtwin.twin.torque_scale import FittedTorqueScale

Changes = Mapping[tuple[str, str], CauseParameter]  # by joint and name
Numbers = Callable[[str], Mapping[str, float]]  # a simulator's, of a joint, by what MJCF calls them


class Simulator(Protocol):
    """A simulator's model of the robot."""

    @property
    def name(self) -> str:
        """What it is called."""

    def numbers(self, joint: str) -> Mapping[str, float]:
        """Return a joint's numbers, by what MJCF calls them."""


def of_simulated_runs(findings: Sequence[ChannelFinding]) -> Numbers:
    """Return the numbers of a simulator of which runs alone are there: those of the twin, which fits these."""
    known: dict[str, dict[str, float]] = {}
    for finding in findings:
        values = finding.estimate.values if finding.name == "torque" else ()
        for (effect, term), value in zip(finding.system.terms, values, strict=False):  # the causes' follow
            if term.joint is not None and term.name in effect.in_mjcf:
                known.setdefault(term.joint, {})[effect.in_mjcf[term.name]] = max(0.0, float(value))
    return lambda joint: known.get(joint, {})


def beside(numbers: Numbers, cause: Cause, alone: Changes) -> Cause:
    """Return a cause with the simulator's numbers beside the robot's; below zero they are zero in both.

    `alone`: changes by joint and name where they are others in a file, which has no place for all that differs. One
    that is not sure there goes with what the file cannot hold: the file's number stays.
    """

    def told(number: CauseParameter) -> CauseParameter:
        if number.joint is None or cause.scope != CHANGED:
            return number
        own = numbers(number.joint).get(catalogue()[cause.effect].changed_in_mjcf.get(number.name, ""))
        in_file = alone.get((number.joint, number.name), number)
        if own is None or (in_file is not number and not least_change(in_file)):
            return number
        return replace(in_file, simulator=own, robot=max(0.0, own + in_file.value))

    return replace(cause, parameters=tuple(map(told, cause.parameters)))


def alone_in_file(causes: Sequence[tuple[ChannelFinding, FoundCause]], scale: FittedTorqueScale | None) -> Changes:
    """Return changes of friction that a simulator's file holds, by joint and name, as they are best in that file.

    Friction that no number holds (by load, by temperature) leaves another Coulomb and viscous friction beside it than
    without it, so they are fitted without it; empty where nothing of that kind was found.
    """
    changed = [(finding, cause) for finding, cause in causes if finding.name == "torque" and cause.scope == CHANGED]
    held: dict[int, Term] = {}
    others: set[int] = set()
    for _, cause in changed:
        names = catalogue()[cause.effect].changed_in_mjcf
        columns = [pair for variant in cause.variants for pair in zip(variant.columns, variant.terms, strict=True)]
        for k, term in columns if catalogue()[cause.effect].family == "friction" else ():
            name = term.name.removeprefix("d")  # of a change beside another number
            if name in names:
                held[k] = replace(term, name=name)
            else:
                others.add(k)
    if not held or not others:
        return {}
    fitted = numbers_without(changed[0][0], held, others)
    widened = [quantity if scale is None else scale.widened(quantity) for quantity in fitted]
    return {(str(quantity.joint), quantity.name): parameter(quantity) for quantity in widened}

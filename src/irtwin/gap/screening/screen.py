"""What acts in some runs only, for a while, at one order or place of many: found before any effect is tried."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from irtwin.effects.catalogue import catalogue
from irtwin.effects.effect import Effect
from irtwin.effects.load import ExternalContact
from irtwin.effects.local import LocalEffect
from irtwin.effects.stack import Stack
from irtwin.effects.transmission import TorqueRipple
from irtwin.gap.data.case import Case
from irtwin.gap.regression.hypotheses import Variant
from irtwin.gap.regression.moments import summed
from irtwin.gap.regression.normal_equations import System, noise_before, twin_values
from irtwin.gap.screening.contact import contact
from irtwin.gap.screening.local import local_effects
from irtwin.gap.screening.remainder import remainders
from irtwin.gap.screening.ripples import fast_ripples, known_ripples
from irtwin.gap.screening.together import each_beside_the_other
from irtwin.identification.progress import Tell, paced
from irtwin.identification.two_processes import begun


@dataclass(frozen=True)
class Screened:
    """Ripples and local effects at their joints; contacts, and payloads in some runs, beside all that is tried anyway.

    `waited` gives these two: contacts are searched for beside other work.
    """

    waited: Callable[[], tuple[Effect, ...]]
    placed: tuple[Effect, ...]

    def shapes(self, effects: Sequence[Effect]) -> list[Effect]:
        """Return the effects to try: those that a screening places, in that place only."""
        loads = self.waited()
        touched = any(isinstance(one, ExternalContact) for one in loads)
        placed = (LocalEffect, TorqueRipple, *([ExternalContact] if touched else []))
        return [*(one for one in effects if not isinstance(one, placed)), *loads, *self.placed]


def screen(case: Case, stack: Stack, system: System, tell: Tell | None = None) -> Screened:
    """Search the runs' torque; system: its equations, with the terms of the twin at least.

    `tell` is told how far that has come, where it takes long.
    """
    noise = noise_before(system)
    values = twin_values(system, system.solution((), summed(system.moments(noise))))
    left = remainders(case, stack, values, tell=tell)
    in_contact = begun(lambda: contact(case.robot, left, noise, tell), worth=case.long)
    known = [effect for effect in catalogue().values() if isinstance(effect, LocalEffect)]
    ripples = (*known_ripples(case.robot, left), *fast_ripples(case.robot, left, tell))
    local = local_effects(case.robot, known, left, tell)

    def loads() -> tuple[Effect, ...]:
        told = paced(tell)
        touch = in_contact(lambda: told("  waiting for what shows contacts"))
        return each_beside_the_other(case, stack, system, noise, touch, tell)

    return Screened(loads, (*ripples, *local))


def acting(variants: Sequence[Variant]) -> tuple[tuple[str, ...], tuple[float, float] | None] | None:
    """Return the runs in which a cause acts, and the stretch of the clock, s; None for one that acts in all."""
    effects = [variant.effect for variant in variants if variant.effect.runs is not None]
    if not effects:
        return None
    runs = sorted({run for effect in effects for run in effect.runs or ()})
    window = next(((e.shape["start"], e.shape["stop"]) for e in effects if isinstance(e, ExternalContact)), None)
    return tuple(runs), window

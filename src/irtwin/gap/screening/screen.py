"""What acts in some runs only, for a while, at one order or place of many: found before any effect is tried."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

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
from irtwin.gap.screening.payloads import untold_payload
from irtwin.gap.screening.remainder import remainders
from irtwin.gap.screening.ripples import fast_ripples, known_ripples
from irtwin.gap.screening.together import Both, each_beside_the_other
from irtwin.identification.progress import Tell, paced
from irtwin.identification.two_processes import begun


@dataclass(frozen=True)
class Screened:
    """Ripples and local effects at their joints, and a contact and a payload in some runs (None: none stands out).

    `waited` gives these two: contacts are searched for beside other work.
    """

    waited: Callable[[], Both] = lambda: (None, None)
    ripples: tuple[Effect, ...] = ()
    local: tuple[LocalEffect, ...] = ()

    @cached_property
    def both(self) -> Both:
        """Contact and payload."""
        return self.waited()

    def shapes(self, effects: Sequence[Effect]) -> list[Effect]:
        """Return the effects to try with those found: screened ones in their place only, payloads in some runs too."""
        contact, payload = self.both
        placed = (LocalEffect, TorqueRipple, *([ExternalContact] if contact else []))
        found = [one for one in effects if not isinstance(one, placed)]
        return [*found, *(one for one in (contact, payload) if one), *self.ripples, *self.local]


def screen(case: Case, stack: Stack, system: System, seed: int, tell: Tell | None = None) -> Screened:
    """Search the runs' torque; system: its equations, with the terms of the twin at least.

    `tell` is told how far that has come, where it takes long.
    """
    noise, limits = noise_before(system), case.thresholds
    values = twin_values(system, system.solution((), summed(system.moments(noise))))
    left = remainders(case, stack, values, tell=tell)
    in_contact = begun(lambda: contact(case.robot, left, noise, limits.contact, tell), worth=case.long)
    known = [effect for effect in catalogue().values() if isinstance(effect, LocalEffect)]
    payload = untold_payload(case.robot, system, noise, limits.some_payload, seed, tell)
    known_orders = known_ripples(case.robot, left, limits.ripples.least_periods)
    ripples = (*known_orders, *fast_ripples(case.robot, left, limits.ripples.least_share, tell))
    local = tuple(local_effects(case.robot, known, left, limits.local, seed, tell))

    def both() -> Both:
        told = paced(tell)
        touch = in_contact(lambda: told("  waiting for what shows contacts"))
        return each_beside_the_other(case, stack, system, noise, (touch, payload), seed, tell)

    return Screened(both, ripples, local)


def acting(variants: Sequence[Variant]) -> tuple[tuple[str, ...], tuple[float, float] | None] | None:
    """Return the runs in which a cause acts, and the stretch of the clock, s; None for one that acts in all."""
    effects = [variant.effect for variant in variants if variant.effect.runs is not None]
    if not effects:
        return None
    runs = sorted({run for effect in effects for run in effect.runs or ()})
    window = next(((e.shape["start"], e.shape["stop"]) for e in effects if isinstance(e, ExternalContact)), None)
    return tuple(runs), window

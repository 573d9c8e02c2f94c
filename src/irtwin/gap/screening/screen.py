"""What acts in some runs only, for a while, at one order or place of many: found before any effect is tried."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from irtwin.effects.catalogue import catalogue
from irtwin.effects.effect import Effect
from irtwin.effects.load import ExternalContact, Payload
from irtwin.effects.local import LocalEffect
from irtwin.effects.stack import Stack
from irtwin.effects.transmission import TorqueRipple
from irtwin.gap.data.case import Case
from irtwin.gap.regression.hypotheses import Variant
from irtwin.gap.regression.normal_equations import System, twin_values
from irtwin.gap.screening.contact import contact
from irtwin.gap.screening.local import local_effects
from irtwin.gap.screening.payloads import beside, untold_payload
from irtwin.gap.screening.remainder import RunResidual, remainders
from irtwin.gap.screening.ripples import fast_ripples, known_ripples
from irtwin.identification.progress import tell_step
from irtwin.identification.two_processes import begun

_TURNS = 2


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
        touched = any(isinstance(load, ExternalContact) for load in loads)
        placed = (LocalEffect, TorqueRipple, *([ExternalContact] if touched else []))
        return [*(effect for effect in effects if not isinstance(effect, placed)), *loads, *self.placed]


def screen(case: Case, stack: Stack, system: System) -> Screened:
    """Search the runs' torque; system: its equations, with the terms of the twin at least."""
    noise = system.noise_before
    values = twin_values(system, system.solution((), system.total(noise)))
    left = remainders(case, stack, values)
    in_contact = begun(lambda: contact(case.robot, left, noise), worth=case.long)
    known = [effect for effect in catalogue().values() if isinstance(effect, LocalEffect)]
    ripples = (*known_ripples(case.robot, left), *fast_ripples(case.robot, left))
    local = local_effects(case.robot, known, left)

    @cache
    def loads() -> tuple[Effect, ...]:
        touch = in_contact(lambda: tell_step("  waiting for what shows contacts"))
        return each_beside_the_other(case, stack, system, noise, touch)

    return Screened(loads, (*ripples, *local))


def acting(variants: Sequence[Variant]) -> tuple[tuple[str, ...], tuple[float, float] | None] | None:
    """Return the runs in which a cause acts, and the stretch of the clock, s; None for one that acts in all."""
    effects = [variant.effect for variant in variants if variant.effect.runs is not None]
    if not effects:
        return None
    runs = sorted({run for effect in effects for run in effect.runs or ()})
    return tuple(runs), next((effect.window for effect in effects if effect.window), None)


def each_beside_the_other(
    case: Case, stack: Stack, system: System, noise: np.ndarray, touch: ExternalContact | None
) -> tuple[Effect, ...]:
    """Return the contacts and payloads to try: each by itself, and beside the other; `touch`: the contact by itself.

    A payload in all observed runs is tried anyway, as a change; what hides behind it is a contact.
    system: of torque, with the twin's terms; noise: (n,) RMS of each joint's residual, N m.
    """
    tried: dict[Effect | None, None] = {touch: None, untold_payload(case.robot, system, noise): None}
    for _ in range(_TURNS):
        apart = _apart_from(system, touch)
        payload = untold_payload(case.robot, apart, noise)
        left = None if payload is None else _beside(case, stack, apart, noise, payload)
        if left is None:
            break
        touch = contact(case.robot, left, _rms(left, noise))
        tried |= {payload: None, touch: None}
    anyway = [effect for effect in tried if isinstance(effect, Payload) and set(effect.runs or ()) >= case.observed]
    return tuple(effect for effect in tried if effect is not None and effect not in anyway)


def _apart_from(system: System, touch: ExternalContact | None) -> System:
    """Return the equations without the blocks of time in which a contact acts."""
    if touch is None:
        return system
    kept = [
        k
        for k, block in enumerate(system.blocks)
        if not (touch.runs and block.run in touch.runs and block.start <= touch.stop and block.stop >= touch.start)
    ]
    blocks = tuple(system.blocks[k] for k in kept)
    return replace(system, blocks=blocks, group=system.group[kept], observed=system.observed[kept])


def _beside(case: Case, stack: Stack, system: System, noise: np.ndarray, payload: Payload) -> list[RunResidual] | None:
    """Return what the twin and the payload leave of the runs."""
    both = beside(case.robot, system, noise, payload)
    if both is None:
        return None
    values, load = both
    return remainders(case, stack, twin_values(system, values), (payload, load))


def _rms(left: list[RunResidual], noise: np.ndarray) -> np.ndarray:
    """Return the RMS (n,) of what is left of each joint; `noise` where nothing is known, as the joint never moves."""
    residual = np.concatenate([run.residual for run in left])
    known = np.isfinite(residual)
    mean = np.where(known, residual, 0.0) ** 2 / np.maximum(known.sum(axis=0), 1)
    return np.where(known.any(axis=0), np.sqrt(mean.sum(axis=0)), noise)

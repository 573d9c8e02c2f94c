"""What acts in some runs only, for a while, at one order or place of many: found before any effect is tried."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from irtwin.effects.catalogue import catalogue
from irtwin.effects.effect import Effect
from irtwin.effects.local import LocalEffect
from irtwin.effects.stack import Stack
from irtwin.effects.transmission import TorqueRipple
from irtwin.gap.data.case import Case
from irtwin.gap.regression.hypotheses import Variant
from irtwin.gap.regression.normal_equations import System, noise_before, twin_values
from irtwin.gap.regression.residuals import torque_residual
from irtwin.gap.regression.transient import Transient, is_transient
from irtwin.gap.screening.contact import contact
from irtwin.gap.screening.local import local_effects
from irtwin.gap.screening.payloads import UntoldPayload, untold_payload
from irtwin.gap.screening.remainder import Remainder
from irtwin.gap.screening.ripples import fast_ripples
from irtwin.identification.two_processes import begun
from irtwin.signals.filter import decimation
from irtwin.signals.motion import Motion


@dataclass(frozen=True)
class Screened:
    """A contact and a payload in some of the runs (None: none stands out); fast ripples, and local effects."""

    contact: Transient | None = None
    payload: UntoldPayload | None = None
    ripples: tuple[TorqueRipple, ...] = ()
    local: tuple[LocalEffect, ...] = ()

    def shapes(self, effects: Sequence[Effect]) -> list[Effect]:
        """Return the effects to try with those found: contact and local ones in their place only, others there too."""
        found: list[Effect] = [
            effect
            for effect in effects
            if not isinstance(effect, LocalEffect) and not (self.contact and effect.id == self.contact.effect.id)
        ]
        return [*found, *(one.effect for one in (self.contact, self.payload) if one), *self.ripples, *self.local]


def screen(case: Case, stack: Stack, system: System, seed: int) -> Screened:
    """Search the runs' torque; system: its equations, with the terms of the twin at least."""
    noise, limits = noise_before(system), case.thresholds
    values = twin_values(system, system.solution((), np.sum(system.moments(noise), axis=0)))
    left = []
    for motion in case.with_torque:
        step = decimation(motion.rate, motion.cutoff) if motion.cutoff else 1
        residual = torque_residual(stack, motion, values)
        observed = motion.run in case.observed
        left.append(Remainder(_every(motion, step), residual[::step], observed, case.grouping.label[motion.run]))
    in_contact = begun(lambda: contact(case.robot, left, noise, limits.contact), worth=case.long)
    known = [effect for effect in catalogue().values() if isinstance(effect, LocalEffect)]
    others = (
        untold_payload(case.robot, system, noise, limits.some_payload, seed),
        tuple(fast_ripples(case.robot, left, limits.ripples.least_share)),
        tuple(local_effects(case.robot, known, left, limits.local, seed)),
    )
    return Screened(in_contact(), *others)


def acting(variants: Sequence[Variant]) -> tuple[tuple[str, ...], tuple[float, float] | None] | None:
    """Return the runs in which a cause acts, and the stretch of the clock, s; None for one that acts in all."""
    effects = [variant.effect for variant in variants if variant.effect.runs is not None]
    if not effects:
        return None
    runs = sorted({run for effect in effects for run in effect.runs or ()})
    window = next(((e.shape["start"], e.shape["stop"]) for e in effects if is_transient(e)), None)
    return tuple(runs), window


def _every(motion: Motion, step: int) -> Motion:
    cut = slice(None, None, step)
    return Motion(motion.time[cut], motion.q[cut], motion.dq[cut], motion.ddq[cut], run=motion.run)

"""Contacts and payloads in some runs where both may be there: each is found beside the other.

A payload that the twin lacks hides a contact, as what it leaves of its runs looks like contacts all the time; and a
contact in a run speaks for a payload there. So the two are looked for in turn: contacts in what twin and payload leave,
payloads in what lies apart from the contact. All that comes is tried.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from irtwin.effects.effect import Effect
from irtwin.effects.load import ExternalContact, Payload
from irtwin.effects.stack import Stack
from irtwin.gap.data.case import Case
from irtwin.gap.regression.normal_equations import System, twin_values
from irtwin.gap.screening.contact import contact
from irtwin.gap.screening.payloads import beside, untold_payload
from irtwin.gap.screening.remainder import Remainder, remainders
from irtwin.identification.progress import Tell

_TURNS = 2


def each_beside_the_other(
    case: Case,
    stack: Stack,
    system: System,
    noise: np.ndarray,
    touch: ExternalContact | None,
    tell: Tell | None = None,
) -> tuple[Effect, ...]:
    """Return the contacts and payloads to try: each by itself, and beside the other; `touch`: the contact by itself.

    system: of torque, with the twin's terms; noise: (n,) RMS of each joint's residual, N m. `tell` is
    told how far that has come, where it takes long.
    """
    found: dict[Effect | None, None] = {touch: None, untold_payload(case.robot, system, noise, tell): None}
    for _ in range(_TURNS):
        apart = _apart_from(system, touch)
        payload = untold_payload(case.robot, apart, noise, tell)
        left = None if payload is None else _beside(case, stack, apart, noise, payload, tell)
        if left is None:
            break
        touch = contact(case.robot, left, _rms(left, noise), tell)
        found |= {payload: None, touch: None}
    return tuple(one for one in found if one is not None)


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


def _beside(
    case: Case, stack: Stack, system: System, noise: np.ndarray, payload: Payload, tell: Tell | None
) -> list[Remainder] | None:
    """Return what the twin and the payload leave of the runs."""
    both = beside(case.robot, system, noise, payload)
    if both is None:
        return None
    values, load = both
    return remainders(case, stack, twin_values(system, values), (payload, load), tell)


def _rms(left: list[Remainder], noise: np.ndarray) -> np.ndarray:
    """Return the RMS (n,) of what is left of each joint; `noise` where nothing is known, as the joint never moves."""
    residual = np.concatenate([one.residual for one in left])
    known = np.isfinite(residual)
    mean = np.where(known, residual, 0.0) ** 2 / np.maximum(known.sum(axis=0), 1)
    return np.where(known.any(axis=0), np.sqrt(mean.sum(axis=0)), noise)

"""What a robot may do while it waits: wait where that costs less, close its brakes at once, be switched off."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from irtwin.planning.programme import SectionedMotion
from irtwin.signals.motion import Motion, trapezoid
from irtwin.twin.price import Figure, balance, saving
from irtwin.twin.twin import Twin

_WORTH = 1.0  # s: of a shorter pause nothing is said
_KEPT = 0.05  # s of a pause that is moved


@dataclass(frozen=True)
class PauseProposal:
    """What to do in a pause of a cycle, from `begin` on, `seconds` long, and what that saves a cycle, J.

    `takes`: s of the cycle; None: no log shows how long it takes to come back.
    """

    begin: float
    seconds: float
    what: str
    saved: Figure
    takes: float | None


def proposals(twin: Twin, programme: SectionedMotion, off: float | None) -> Iterator[PauseProposal]:
    """Yield what would take less than what the robot does in the pauses of a programme, by more than is unsure.

    Only states that logs have shown: brakes that the twin has, and off with the power that was logged there, `off` W;
    None: none was.
    """
    motion = programme.motion
    for number in np.flatnonzero(programme.are("pause")):
        section = programme.sections[number]
        begin, seconds = float(motion.time[section.first] - motion.time[0]), float(programme.seconds[number])
        if seconds < _WORTH:
            continue
        weights = np.zeros(len(motion.time))
        weights[section.first : section.last + 1] = trapezoid(motion.time[section.first : section.last + 1])
        savings: list[tuple[str, Figure, float | None]] = [_elsewhere(twin, programme, int(number))]
        if twin.stack.drives_on(motion) is not None:
            held = _held(motion, section.first, seconds)
            closed = balance(twin, (motion, weights), (held, -trapezoid(held.time)))
            savings.append(("close the brakes at once", closed, None))
        if off is not None:
            taken = balance(twin, (motion, weights))
            savings.append(("switch off", Figure(taken.value - off * seconds, taken.half_width), None))
        for action, saved, takes in savings:
            if saved.value > (saved.half_width or 0.0):
                yield PauseProposal(begin, seconds, action, saved, takes)


def _elsewhere(twin: Twin, programme: SectionedMotion, number: int) -> tuple[str, Figure, float]:
    """Return what it saves to wait at the pose of the pause of the programme where that costs least."""
    motion, pauses = programme.motion, np.flatnonzero(programme.are("pause"))
    spare = float(programme.seconds[number]) - _KEPT

    def moved(other: int) -> Motion:
        factors = np.ones(len(programme.sections))
        factors[number] = _KEPT / programme.seconds[number]
        factors[other] += spare / programme.seconds[other]
        return programme.retimed(factors)

    if len(pauses) == 1:
        return "", Figure(0.0, None), 0.0
    best = min((int(other) for other in pauses if other != number), key=lambda other: twin.energy(moved(other)))
    at = motion.time[programme.sections[best].first] - motion.time[0]
    return f"wait where it stands at {at:.2f} s", saving(twin, moved(best), motion), 0.0


def _held(motion: Motion, sample: int, seconds: float) -> Motion:
    """Return standing at the pose of a sample for so many seconds, with brakes closed if there are any."""
    count = max(2, round(seconds * motion.rate) + 1)
    q = np.repeat(motion.q[sample : sample + 1], count, axis=0)
    still = np.zeros_like(q)
    return motion.moved(np.linspace(0.0, seconds, count), q, still, still)

"""How far long work on runs has come."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence

from irtwin.identification.accumulate import Equations, Rows
from irtwin.identification.two_processes import in_copy
from irtwin.signals.motion import Motion

Tell = Callable[[str], None]

_EVERY = 2.5  # s between two lines at least: with a step that long there is one each 5 s, and short work says none


class Told:
    """What tells lines, and knows when it told the last: one clock for all that is done in turn."""

    def __init__(self, tell: Tell):
        self._tell, self._last = tell, time.monotonic()

    def __call__(self, line: str) -> None:
        """Tell a line."""
        self._last = time.monotonic()
        self._tell(line)

    def step(self, line: str) -> None:
        """Tell a line where the last was some seconds ago."""
        if time.monotonic() - self._last >= _EVERY and not in_copy():
            self(line)


def paced(tell: Tell | None) -> Tell:
    """Return what tells a line only where the last was some seconds ago: it may be given one at each step."""
    if tell is None:
        return lambda line: None
    told = getattr(tell, "__self__", tell)  # what is paced already keeps its clock
    return (told if isinstance(told, Told) else Told(tell)).step


def with_progress(equations: Equations, motions: Sequence[Motion], tell: Tell | None) -> Equations:
    """Return the equations, with a line every few seconds of how much of the motions they have been asked for."""
    if tell is None:
        return equations
    place = {motion.run: number for number, motion in enumerate(motions, start=1)}
    told = paced(tell)

    def asked(motion: Motion) -> Rows:
        share = 100 * motion.start // len((motion.whole or motion).time)
        told(f"  run {place[motion.run]} of {len(motions)}, {share} % of it")
        return equations(motion)

    return asked

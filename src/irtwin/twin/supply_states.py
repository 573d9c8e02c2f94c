"""The states of the supply in a run, each with its power: by the log, and by the twin."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from irtwin.signals.motion import Motion, standstill, trapezoid
from irtwin.twin.price import Figure, mean_power
from irtwin.twin.twin import Twin

_OFF = 0.1  # of the power that is drawn at rest


@dataclass(frozen=True)
class SupplyState:
    """A state, how long it lasts in a run (s), and its mean power (W); `logged`: None where no power was."""

    name: str
    seconds: float
    logged: float | None
    modelled: Figure

    @property
    def differs(self) -> bool:
        """Whether the twin says another power than the log, by more than it is unsure of."""
        width = self.modelled.half_width
        return self.logged is not None and width is not None and abs(self.logged - self.modelled.value) > width


def supply_states(twin: Twin, motion: Motion) -> tuple[SupplyState, ...]:
    """Return the states that a run passes through, by one rule.

    The supply is off where it takes less than a tenth of what the twin draws at rest. Else the robot moves where a
    joint does. At rest its brakes are closed where the twin has brakes that close so soon; else its drives hold it.
    """
    still = standstill(motion)
    off = np.zeros(len(still), dtype=bool)
    if motion.power is not None:
        off = motion.power < _OFF * _at_rest(twin)
    on = twin.stack.drives_on(motion)
    closed = still & (np.zeros_like(still) if on is None else on == 0)
    weights, passed = trapezoid(motion.time), []
    states = {"off": off, "moving": ~still, "brakes closed": closed, "drives on at rest": still}
    for name, where in states.items():
        own = np.where(where, weights, 0.0)
        weights = weights - own  # each state is where none before it is
        if seconds := float(own.sum()):
            logged = None if motion.power is None else float(own @ motion.power) / seconds
            passed.append(SupplyState(name, seconds, logged, mean_power(twin, motion, own > 0)))
    return tuple(passed)


def _at_rest(twin: Twin) -> float:
    """Return the power that is drawn whatever the robot does, W."""
    return sum(twin.value(effect.id, term) for effect, term in twin.stack.power_terms if effect.drawn_at_rest)

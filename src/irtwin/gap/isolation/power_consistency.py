"""The balance of torque and power: whether power takes what a cause adds to torque, or only the sensor shows it.

What is wrong in both by torque times speed is mechanical; what is wrong in torque alone lies in its measurement; what
is wrong in power alone is electrical. Causes are selected by both together; this is said beside each, and drops rivals.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

from irtwin.effects.effect import Effect
from irtwin.gap.isolation.cause import Cause
from irtwin.gap.thresholds import PowerConsistency

MECHANICAL, SENSOR = "mechanical", "sensor"
_CHANNELS = {"torque": MECHANICAL, "measurement": SENSOR}


@dataclass(frozen=True)
class PowerBalance:
    """What power says of a cause of torque.

    `gain`: logarithm of the held-out mean square of power where only the sensor shows the cause's torque, over that
    where power takes it, mean over groups of runs; `t` of it between groups.
    """

    gain: float
    t: float
    limits: PowerConsistency

    @property
    def kind(self) -> str | None:
        """Return "mechanical" or "sensor" where power decides, else None."""
        if abs(self.gain) < self.limits.least_gain or abs(self.t) < self.limits.least_t or self.gain * self.t < 0:
            return None
        return MECHANICAL if self.gain > 0 else SENSOR


def filtered(cause: Cause, balance: PowerBalance, known: Mapping[str, Effect]) -> Cause:
    """Return the cause without the rivals that power refutes: those of another kind than it says, where it decides.

    A cause that power itself refutes keeps its rivals.
    """
    if balance.kind is None or _kind_of(known[cause.effect]) != balance.kind:
        return cause
    return replace(cause, rivals=tuple(rival for rival in cause.rivals if _kind_of(known[rival]) == balance.kind))


def _kind_of(effect: Effect) -> str | None:
    """Return whether an effect of the torque signal is "mechanical" or one of the "sensor"; None for others."""
    return _CHANNELS[effect.channel] if effect.signal == "torque" else None

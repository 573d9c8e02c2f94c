"""The balance of torque and power: whether power takes what a cause adds to torque, or only the sensor shows it.

What is wrong in both by torque times speed is mechanical; what is wrong in torque alone lies in its measurement; what
is wrong in power alone is electrical. Causes are selected by both together; this is said beside each.
"""

from __future__ import annotations

from dataclasses import dataclass

from irtwin.gap.thresholds import PowerConsistency

MECHANICAL, SENSOR = "mechanical", "sensor"


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

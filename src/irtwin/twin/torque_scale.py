"""The scale of torque, logged over that which is there: how sure it is, and what goes with it.

Torque from current times a nominal constant may be off by a tenth on all joints alike. A fit does not see that, as all
it finds is off with it, so a twin's covariance does not hold it: what is common to all parameters is no noise of each.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from irtwin.effects.effect import Quantity, Term
from irtwin.errors import InputError
from irtwin.identification.accumulate import Rows
from irtwin.identification.estimators import estimate_one
from irtwin.identification.uncertainty import half_widths
from irtwin.signals.log import DataSet
from irtwin.signals.motion import Motion

STATED, SIMULATED, SENSOR, ASSUMED = "stated", "simulated", "sensor", "assumed"
_SENSOR = re.compile(r"\b(?:sensors?|link-side)\b", re.IGNORECASE)
_LOSSES = (  # of joint torques and speeds, (N, n) each
    lambda torque, speed: torque**2,
    lambda torque, speed: np.abs(torque),
    lambda torque, speed: np.abs(speed),
    lambda torque, speed: speed**2,
)
_ASSUMED = 0.1  # of torque of drives, where the data set states nothing: half a 95 % interval, as the next
_OF_SENSOR = 0.02  # of torque of sensors, and of power of a meter
_SPREAD = 1e3  # of a loss' coefficient: no more is known of it
_FORCES = re.compile(r"\b(?:kg|N)\b")
_POWER_OF = re.compile(r"\)\^(\d+)$")

Torque = Callable[[Motion], np.ndarray]


@dataclass(frozen=True)
class FittedTorqueScale:
    """Half the 95 % interval of logged torque over that which is there, a share, and where that comes from.

    low, high: the ends of what true torque is over logged torque; `why` says all of it in words.
    """

    uncertainty: float
    source: str
    low: float
    high: float
    why: str

    def interval(self, value: float, unit: str, lower: float | None, upper: float | None) -> tuple[float, float] | None:
        """Return a 95 % interval of noise with the scale in it; None where nothing changes: it does not go with torque.

        Both are added in quadrature, on each side by itself.
        """
        degree = torque_degree(unit)
        if degree == 0 or self.uncertainty == 0 or lower is None or upper is None:
            return None
        ends = sorted(value * factor**degree for factor in (self.low, self.high))
        below, above = max(value - ends[0], 0.0), max(ends[1] - value, 0.0)
        return value - float(np.hypot(value - lower, below)), value + float(np.hypot(upper - value, above))

    def widened(self, quantity: Quantity) -> Quantity:
        """Return a quantity with the scale in its interval; one that does not go with torque as it is."""
        ends = self.interval(quantity.value, quantity.unit, quantity.lower, quantity.upper)
        return quantity if ends is None else replace(quantity, lower=ends[0], upper=ends[1])


def torque_degree(unit: str) -> int:
    """Return the power of torque that a quantity of this unit goes with: kg and N m 1, W/(N m)^2 -2, rad 0."""
    above, _, below = unit.partition("/")
    return _degree(above) - _degree(below)


def _degree(part: str) -> int:
    if not _FORCES.search(part):
        return 0
    power = _POWER_OF.search(part)
    return int(power[1]) if power else 1


def torque_scale(data_set: DataSet, motions: Sequence[Motion], torque: Torque) -> FittedTorqueScale | None:
    """Return how sure the scale is by what the data set states, and by power where that tells more.

    motions: filtered alike; None where none has a torque. torque: the real joint torque, (N, n) N m, of each that
    explains what was logged. Power counts where it was measured on the DC bus: that of the mains holds the efficiency
    of a supply. Nor does it count twice: where the runs say no torque, power told the torque constants.
    """
    if not any(motion.torque is not None for motion in motions):
        return None
    by_power = bool(data_set.runs) and all(run.signals.torque is None for run in data_set.runs)
    known = _stated(data_set, by_power)
    with_power = [motion for motion in motions if motion.power is not None]
    if by_power or known.uncertainty == 0 or not with_power or data_set.power_at != "dc_bus":
        return known
    told = _told_by_power(with_power, torque)
    return known if told is None else _narrowed(known, *told)


def of_sensor(data_set: DataSet) -> float | None:
    """Return by which share torque may be off that a sensor measured, as the data set says; None: nothing says so."""
    note = data_set.notes.get("torque")
    return _OF_SENSOR if isinstance(note, str) and _SENSOR.search(note) else None


def _stated(data_set: DataSet, by_power: bool) -> FittedTorqueScale:
    if data_set.torque_scale_uncertainty is not None:
        share, source, why = data_set.torque_scale_uncertainty, STATED, "the data set states it"
    elif by_power:
        share, source, why = _ASSUMED, ASSUMED, "power tells the torque constants, joint by joint"
    elif data_set.simulated:
        share, source, why = 0.0, SIMULATED, "a simulator made it"
    elif (measured := of_sensor(data_set)) is not None:
        share, source, why = measured, SENSOR, "a sensor measured torque"
    else:
        share, source, why = _ASSUMED, ASSUMED, "torque of drives comes from nominal constants"
    words = f"The scale of torque is {f'uncertain by {100 * share:.3g} %' if share else 'exact'}: {why}"
    return FittedTorqueScale(share, source, 1 / (1 + share), 1 / (1 - share), words)


def _narrowed(known: FittedTorqueScale, slope: float, half: float) -> FittedTorqueScale:
    """Join what is known of true torque over logged, 1 give or take the uncertainty, with the slope of power."""
    half = float(np.hypot(half, _OF_SENSOR * abs(slope)))
    if half >= known.uncertainty:
        return known
    finding = f"power over torque times speed is {slope:.3f} (give or take {half:.3f})"
    if abs(slope - 1) > np.hypot(half, known.uncertainty):
        return replace(known, why=f"{known.why}; {finding}, farther off than that, and does not count")
    weights = np.array([known.uncertainty, half]) ** -2.0
    middle, rest = float(weights @ [1.0, slope] / weights.sum()), float(weights.sum() ** -0.5)
    return replace(known, low=middle - rest, high=middle + rest, why=f"{known.why}; {finding}, which narrows it")


def _told_by_power(motions: Sequence[Motion], torque: Torque) -> tuple[float, float] | None:
    """Return the slope of power over torque times speed, and half its 95 % interval; None where power does not tell.

    Losses of windings, inverters and iron are fitted beside it, joint by joint; where it depends on which, by so much
    it is unsure. Only while the robot takes power: what it gives back may be burnt.
    """
    whole, windings = (_slope(motions, torque, losses) for losses in (_LOSSES, _LOSSES[:1]))
    if whole is None or windings is None:
        return None
    return whole[0], float(np.hypot(whole[1], whole[0] - windings[0]))


def _slope(
    motions: Sequence[Motion], torque: Torque, losses: Sequence[Callable[[np.ndarray, np.ndarray], np.ndarray]]
) -> tuple[float, float] | None:
    joints = motions[0].dq.shape[1]
    terms = [Term("slope", "1", expected=1.0), Term("P0", "W", spread=_SPREAD)]
    terms += [Term("loss", "", spread=_SPREAD)] * (len(losses) * joints)

    def equations(motion: Motion) -> Rows:
        assert motion.power is not None
        real = torque(motion)
        work = (real * motion.dq).sum(axis=1)
        columns = np.column_stack([work, np.ones_like(work), *(loss(real, motion.dq) for loss in losses)])
        return Rows(columns[:, None], np.zeros((len(work), 1)), motion.power[:, None], (work < 0)[:, None])

    try:
        fitted = estimate_one(motions, equations, terms)[1]
    except InputError:  # nothing is left of runs that only brake
        return None
    half = float(half_widths(fitted.covariance, np.array([term.spread for term in terms]), fitted.blocks)[0])
    return (float(fitted.values[0]), half) if np.isfinite(half) else None

"""What a measurement of torque, position or power shows beside the thing itself."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from irtwin.effects.effect import (
    Coefficients,
    Effect,
    JointEffect,
    Possible,
    Predicted,
    Quantity,
    Stated,
    Term,
    force_unit,
    quantity,
)
from irtwin.effects.rigid_body import torque_slope
from irtwin.robot.description import Joint, Robot
from irtwin.signals.filter import lagged
from irtwin.signals.motion import Motion

_CONSTANTS = (0.4, 2.5)  # of a nominal torque constant that nobody vouches for: servos and desktop arms are off by two
_CLASS = 0.005  # by how much meters of a common class, 0.5, are off (IEC 62053-22)
_GAINS = (0.7, 1.4)  # of a meter
_FARTHEST = 0.35  # rad or m, of a zero
LONGEST_LAG = 5e-3  # s, of all joints' torque: filters of drives pass 100 Hz and more
_APART = 2.5e-4  # s, of channels: clocks, filters and samples put them so far apart, one standard deviation


@dataclass(frozen=True)
class TorqueOffset(JointEffect):
    """c: the reading where there is no torque."""

    id: ClassVar[str] = "torque_offset"
    family: ClassVar[str] = "sensing"
    channel: ClassVar[str] = "measurement"

    def joint_terms(self, joint: Joint) -> tuple[Term, ...]:
        """Return c."""
        return (Term("c", force_unit(joint), joint=joint.name, spread=5.0),)

    def samples(self, robot: Robot, motion: Motion, predicted: Predicted | None) -> tuple[np.ndarray, ...]:
        """Return ones."""
        return (np.ones_like(motion.dq),)


@dataclass(frozen=True)
class OffsetOfRun(TorqueOffset):
    """The same in some runs, as it differs from run to run: by a `share` of the joint's dry friction, where known."""

    prior_tells: ClassVar[bool] = True

    share: float | None = None

    def joint_terms(self, joint: Joint) -> tuple[Term, ...]:
        """Return c."""
        (term,) = super().joint_terms(joint)
        if self.share is None or not joint.dry_friction:
            return (term,)
        return (replace(term, spread=min(self.share * joint.dry_friction, term.spread)),)


@dataclass(frozen=True)
class TorqueDrift(JointEffect):
    """r t: a reading that drifts from the start of each run."""

    id: ClassVar[str] = "torque_drift"
    family: ClassVar[str] = "sensing"
    manual_test: ClassVar[str | None] = "holding one pose for ten minutes"
    channel: ClassVar[str] = "measurement"

    def joint_terms(self, joint: Joint) -> tuple[Term, ...]:
        """Return r."""
        return (Term("r", f"{force_unit(joint)}/s", joint.name, spread=0.2),)

    def samples(self, robot: Robot, motion: Motion, predicted: Predicted | None) -> tuple[np.ndarray, ...]:
        """Return the time since the run's start."""
        began = (motion.whole or motion).time[0]
        return (np.broadcast_to((motion.time - began)[:, None], motion.dq.shape),)


@dataclass(frozen=True)
class TorqueConstantError(JointEffect):
    """g tau: torque told from current by a wrong constant. The coefficient is g - 1."""

    id: ClassVar[str] = "torque_constant_error"
    family: ClassVar[str] = "sensing"
    channel: ClassVar[str] = "measurement"
    needs: ClassVar[str | None] = "torque"
    stage: ClassVar[int] = 2

    def joint_terms(self, joint: Joint) -> tuple[Term, ...]:
        """Return g - 1."""
        return (Term("g - 1", "1", joint.name, spread=0.3, lowest=-1.0),)

    def samples(self, robot: Robot, motion: Motion, predicted: Predicted | None) -> tuple[np.ndarray, ...]:
        """Return the predicted torque."""
        assert predicted is not None
        return (predicted.torque,)

    def parameters(self, robot: Robot, given: Coefficients) -> tuple[Quantity, ...]:
        """Return g."""
        return tuple(
            quantity("g", joint.name, value, "1", deviation, lambda excess: 1 + excess)
            for joint, value, deviation in zip(self.acting(robot), given.values, given.deviations, strict=True)
        )

    def possible(self, robot: Robot, stated: Stated) -> Mapping[str, Possible]:
        """Return the range of a constant that is off; of one that is known to be right within a share, that."""
        if (off := stated.torque_scale) is not None:
            return {"g": Possible(1 - off, 1 + off, "torque_scale_uncertainty of the data set allows no more")}
        if (off := stated.torque_sensor) is not None:
            why = "a sensor measured torque; if it may be off by more, say so by torque_scale_uncertainty"
            return {"g": Possible(1 - off, 1 + off, why)}
        return {"g": Possible(*_CONSTANTS, "beyond, a gear ratio or a unit is wrong rather than a constant")}


@dataclass(frozen=True)
class EncoderOffset(Effect):
    """(dG/dq) e: a position that is read e too small. Inertia and Coriolis torque change with it too."""

    id: ClassVar[str] = "encoder_offset"
    family: ClassVar[str] = "sensing"
    channel: ClassVar[str] = "measurement"
    needs: ClassVar[str | None] = "torque"
    stage: ClassVar[int] = 1

    def terms(self, robot: Robot) -> tuple[Term, ...]:
        """Return e per joint."""
        return tuple(Term("e", joint.unit, joint.name, spread=0.1) for joint in self.acting(robot))

    def columns(self, robot: Robot, motion: Motion, predicted: Predicted | None = None) -> np.ndarray:
        """Return (N, n, k) slopes of every joint's torque over the position of each acting one."""
        slopes = torque_slope(robot, None if predicted is None else predicted.bodies, motion)
        return slopes[:, :, self.places(robot)]

    def possible(self, robot: Robot, stated: Stated) -> Mapping[str, Possible]:
        """Return how far a joint's zero may be off."""
        return {"e": Possible(-_FARTHEST, _FARTHEST, "a zero that is farther off is another convention, no offset")}


@dataclass(frozen=True)
class TimeDelay(JointEffect):
    """tau(t - d). The column is the secant (tau(t - d) - tau(t))/d, its coefficient d again in the right shape."""

    id: ClassVar[str] = "time_delay"
    family: ClassVar[str] = "sensing"
    about_reversals: ClassVar[bool] = True
    manual_test: ClassVar[str | None] = "sines of rising frequency, up to 5 Hz"
    channel: ClassVar[str] = "measurement"
    needs: ClassVar[str | None] = "torque"
    stage: ClassVar[int] = 3
    ranges: ClassVar[dict[str, tuple[float, float]]] = {"d": (5e-4, 0.6)}

    d: float = 0.005  # s

    def candidates(self, robot: Robot | None = None) -> tuple[Effect, ...]:
        """Return delays over the range; short ones differ in size alone."""
        return self.variants(d=(0.005, 0.02, 0.05, 0.1, 0.2, 0.4))

    def joint_terms(self, joint: Joint) -> tuple[Term, ...]:
        """Return d."""
        return (Term("d", "s", joint.name, spread=0.6, lowest=0.0, unnamed=_APART),)

    def samples(self, robot: Robot, motion: Motion, predicted: Predicted | None) -> tuple[np.ndarray, ...]:
        """Return (tau(t - d) - tau(t))/d; before the run's start torque is what it was there."""
        assert predicted is not None
        whole, before, start = motion, predicted.torque, 0
        if motion.whole is not None and predicted.whole is not None:
            whole, before, start = motion.whole, predicted.whole.torque, motion.start
        near = slice(max(0, start - int(self.d * whole.rate) - 2), start + len(motion.time))
        late = [np.interp(motion.time - self.d, whole.time[near], torque) for torque in before[near].T]
        return ((np.array(late).T - predicted.torque) / self.d,)


@dataclass(frozen=True)
class TorqueLag(Effect):
    """tau(t - d) of all joints alike, as filters of drives and of loggers make it; the column as in `TimeDelay`."""

    id: ClassVar[str] = "torque_lag"
    family: ClassVar[str] = "sensing"
    about_reversals: ClassVar[bool] = True
    channel: ClassVar[str] = "measurement"
    needs: ClassVar[str | None] = "torque"
    stage: ClassVar[int] = 3
    nuisance: ClassVar[bool] = True
    never_changed: ClassVar[bool] = True

    def terms(self, robot: Robot) -> tuple[Term, ...]:
        """Return d."""
        return (Term("d", "s", spread=LONGEST_LAG, lowest=0.0, unnamed=_APART),)

    def columns(self, robot: Robot, motion: Motion, predicted: Predicted | None = None) -> np.ndarray:
        """Return (N, n, 1)."""
        (late,) = TimeDelay(d=LONGEST_LAG).samples(robot, motion, predicted)
        return late[..., None]


@dataclass(frozen=True)
class MeterLag(Effect):
    """P/(T s + 1): a power meter that lags. The column is the secant (lagged - P)/T, as in `TimeDelay`."""

    id: ClassVar[str] = "meter_lag"
    family: ClassVar[str] = "sensing"
    manual_test: ClassVar[str | None] = "steps of power, logged together with the motion"
    channel: ClassVar[str] = "measurement"
    signal: ClassVar[str] = "power"
    needs: ClassVar[str | None] = "power"
    stage: ClassVar[int] = 3
    memory: ClassVar[bool] = True
    ranges: ClassVar[dict[str, tuple[float, float]]] = {"T": (0.02, 2.0)}

    T: float = 0.1  # s

    def candidates(self, robot: Robot | None = None) -> tuple[Effect, ...]:
        """Return time constants over the range."""
        return self.variants(T=(0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0))

    def terms(self, robot: Robot) -> tuple[Term, ...]:
        """Return T."""
        return (Term("T", "s", spread=2.0, lowest=0.0),)

    def columns(self, robot: Robot, motion: Motion, predicted: Predicted | None = None) -> np.ndarray:
        """Return (N, 1) (lagged - P)/T, from rest at the run's first value."""
        assert predicted is not None and predicted.power is not None
        keep = np.exp(-1 / (motion.rate * self.T))
        power = predicted.power
        return np.asarray(lagged(power, keep, before=power[0]) - power)[:, None] / self.T


@dataclass(frozen=True)
class MeterGain(Effect):
    """g P: a power meter out of scale. The coefficient is g - 1."""

    id: ClassVar[str] = "meter_gain"
    family: ClassVar[str] = "sensing"
    scales_power: ClassVar[bool] = True
    manual_test: ClassVar[str | None] = "standing still with a load of known power on the same meter"
    channel: ClassVar[str] = "measurement"
    signal: ClassVar[str] = "power"
    needs: ClassVar[str | None] = "power"
    stage: ClassVar[int] = 4

    def terms(self, robot: Robot) -> tuple[Term, ...]:
        """Return g - 1."""
        return (Term("g - 1", "1", spread=0.3, lowest=-1.0, unnamed=_CLASS),)

    def columns(self, robot: Robot, motion: Motion, predicted: Predicted | None = None) -> np.ndarray:
        """Return (N, 1) the predicted power."""
        assert predicted is not None and predicted.power is not None
        return predicted.power[:, None]

    def possible(self, robot: Robot, stated: Stated) -> Mapping[str, Possible]:
        """Return the range of a meter that is out of scale."""
        return {"g": Possible(*_GAINS, "beyond, the unit of power is wrong rather than its scale")}

    def parameters(self, robot: Robot, given: Coefficients) -> tuple[Quantity, ...]:
        """Return g."""
        return (quantity("g", None, given.values[0], "1", float(given.deviations[0]), lambda excess: 1 + excess),)

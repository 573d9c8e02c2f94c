"""What the numbers of a channel say of its unit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from irtwin.robot.description import Joint, Robot
from irtwin.robot.model import inverse_dynamics
from irtwin.signals.sampling import interval
from irtwin.signals.unit import Unit, units

_BEYOND = 1.5  # times a joint's range that positions may span, and times its greatest position that they may reach
_TURNED = 6 * np.pi  # rad: a wrist without an end counts its turns (that of a measured UR3 stood at 4 pi)
_WIDE = 100.0  # rad (m) that a joint without limits may span
_FAST = 4.0  # times a joint's speed limit
_SLOW = 0.01
_SPEED = 10.0  # rad/s (m/s), of a joint whose limit nobody said
_INTERVALS = (1e-4, 5.0)  # s between samples of any log
_LATEST = 4.2e9  # s: a clock that counts from 1970 has passed fewer
_USUAL = (2e-4, 0.5)  # s, of nearly all
_MOVES = 0.02  # rad (m)
_NEAR = 1.5  # factor by which a speed may miss the derivative: units lie farther apart, noise and filters do not
_ALIKE = 0.8  # correlation of a speed and its position's
_TORQUE = (0.1, 100.0)  # logged over that of the description's bodies
_POWER = (0.3, 300.0)  # electrical over mechanical
_TAKEN = (10.0, 50_000.0)  # W
_WORKING = 1.0  # W: less mechanical power says nothing
_SMOOTHED = 9  # samples
_EVALUATED = 300  # samples of inverse dynamics


@dataclass(frozen=True)
class UnitEvidence:
    """The unit that the numbers choose, None where they cannot; those that they allow; and how, in words."""

    choice: Unit | None
    allowed: tuple[Unit, ...]
    why: str


@dataclass(frozen=True)
class MeasuredRun:
    """A run in SI units: time (N,), q (N, n), and torque (N, n) where it is known."""

    time: np.ndarray
    q: np.ndarray
    torque: np.ndarray | None = None

    def derivative(self, order: int) -> np.ndarray:
        """Return speeds (1) or accelerations (2) of the positions, smoothed, (N, n)."""
        speeds = smooth(np.gradient(self.q, self.time, axis=0))
        return speeds if order == 1 else smooth(np.gradient(speeds, self.time, axis=0))


def smooth(values: np.ndarray) -> np.ndarray:
    """Return a running mean of columns (N, n)."""
    size = min(_SMOOTHED, len(values))
    sums = np.cumsum(np.vstack([np.zeros((1, values.shape[1])), values]), axis=0)
    rows = np.arange(len(values))
    low, high = np.maximum(rows - size // 2, 0), np.minimum(rows + size // 2 + 1, len(values))
    return np.asarray((sums[high] - sums[low]) / (high - low)[:, None])


def position(joints: Sequence[Joint], runs: Sequence[np.ndarray]) -> UnitEvidence:
    """Positions (N, n) of joints of one kind: within their limits, or not. Small ones could be in degrees, too."""
    allowed = [unit for unit in units(joints[0].unit) if _within(joints, [unit.to_si(q) for q in runs])]
    span = max(float(np.ptp(q, axis=0).max()) for q in runs)
    for unit in allowed:
        if unit.name in ("rad", "deg", "m", "mm"):
            si = joints[0].unit
            why = f"by its numbers: as {si} they lie within the joints' limits (span {span:.3g} {si})"
            if unit.name != si:
                why = f"by its numbers: they span {span:.3g}, beyond the joints' limits in {si}, within in {unit.name}"
            return UnitEvidence(unit, tuple(allowed), why)
    return UnitEvidence(None, tuple(allowed), f"spans {span:.3g}, which is within the joints' limits in no unit")


def _within(joints: Sequence[Joint], runs: Sequence[np.ndarray]) -> bool:
    for index, joint in enumerate(joints):
        low = min(float(q[:, index].min()) for q in runs)
        high = max(float(q[:, index].max()) for q in runs)
        bounded = np.isfinite(joint.lower) and np.isfinite(joint.upper) and joint.upper > joint.lower
        wide = _BEYOND * (joint.upper - joint.lower) if bounded else _WIDE
        far = max(_BEYOND * max(abs(joint.lower), abs(joint.upper)), _TURNED) if bounded else _WIDE
        if high - low > wide or max(abs(low), abs(high)) > far:
            return False
    return True


def time(robot: Robot, runs: Sequence[tuple[np.ndarray, np.ndarray]]) -> UnitEvidence:
    """Times (N,) as they rise, beside positions (N, n) in rad (m)."""
    step = float(np.median([interval(times) for times, _ in runs]))
    last = max(float(np.abs(times).max()) for times, _ in runs)
    possible = [
        unit
        for unit in units("s")
        if _INTERVALS[0] <= unit.factor * step <= _INTERVALS[1] and unit.factor * last < _LATEST
    ]
    limits = np.array(
        [joint.velocity if np.isfinite(joint.velocity) and joint.velocity > 0 else _SPEED for joint in robot.joints]
    )
    fastest = (
        max(_fastest(times, q, limits) for times, q in runs) if robot.joints else 0.0
    )  # in parts of the limit, by raw times
    moves = any((np.ptp(q, axis=0) > _MOVES).any() for _, q in runs)
    if moves:
        possible = [unit for unit in possible if fastest / unit.factor <= _FAST]
        quick = [unit for unit in possible if fastest / unit.factor >= _SLOW]
        if len(quick) == 1:
            unit = quick[0]
            why = (
                f"by its numbers: a sample every {unit.factor * step:.3g} s, joints at up to "
                f"{fastest / unit.factor:.2g} of their speed limits"
            )
            return UnitEvidence(unit, tuple(possible), why)
    usual = [unit for unit in possible if _USUAL[0] <= unit.factor * step <= _USUAL[1]]
    choice = usual[0] if len(usual) == 1 else None
    return UnitEvidence(choice, tuple(possible), f"by its numbers: a sample every {step:.3g}")


def _fastest(times: np.ndarray, q: np.ndarray, limits: np.ndarray) -> float:
    speeds = np.abs(np.diff(q, axis=0)) / np.diff(times)[:, None] / limits
    return float(np.quantile(speeds, 0.99, axis=0).max())


def rate(
    motions: Sequence[MeasuredRun], logged: Sequence[np.ndarray], joints: Sequence[int], si: str, order: int = 1
) -> UnitEvidence:
    """Speeds (N, len(joints)) as logged, or accelerations, against the derivative of that order of the positions."""
    gains = []
    for column, joint in enumerate(joints):
        moving = [
            (m.derivative(order)[:, joint], smooth(raw)[:, column])
            for m, raw in zip(motions, logged, strict=True)
            if np.ptp(m.q[:, joint]) > _MOVES
        ]
        if not moving:
            continue
        derived, seen = (np.concatenate(parts) for parts in zip(*moving, strict=True))
        if np.std(seen) > 0 and abs(np.corrcoef(derived, seen)[0, 1]) > _ALIKE:
            gains.append(abs(float(derived @ seen / (derived @ derived))))
    known = units(si)
    if not gains:
        return UnitEvidence(None, tuple(known), "no joint moves, or none as its position's derivative says")
    gain = float(np.median(gains))
    fits = [unit for unit in known if 1 / _NEAR < gain * unit.factor < _NEAR]
    why = f"by a check: {gain:.4g} times the {['first', 'second'][order - 1]} derivative of the positions"
    return UnitEvidence(fits[0] if len(fits) == 1 else None, tuple(fits), why)


def torque(
    robot: Robot, motions: Sequence[MeasuredRun], logged: Sequence[np.ndarray], joints: Sequence[int], si: str
) -> UnitEvidence:
    """Torques (N, len(joints)) as logged, against those of the description's bodies."""
    model = np.vstack([_bodies(robot, motion)[:, joints] for motion in motions])
    size, own = float(np.sqrt(np.mean(np.vstack(logged) ** 2))), float(np.sqrt(np.mean(model**2)))
    known = units(si)
    if own < 1e-6 or size == 0:
        return UnitEvidence(None, tuple(known), "the description's bodies have no weight to hold it against")
    ratio = size / own
    fits = [unit for unit in known if _TORQUE[0] <= ratio * unit.factor <= _TORQUE[1]]
    why = f"by a check: {ratio:.2g} times what the description's bodies need"
    clear = fits if fits and fits[0].factor <= 1.0 else []  # what looks like kN m may be of the motor's side
    return UnitEvidence(clear[0] if len(clear) == 1 else None, tuple(fits), why)


def power(robot: Robot, motions: Sequence[MeasuredRun], logged: Sequence[np.ndarray], si: str = "W") -> UnitEvidence:
    """Electrical power (N,) as logged, or as a current, A, makes it with the voltage, V; against torque times speed.

    At rest, against what controllers take.
    """
    done = float(np.quantile(np.concatenate([_done(robot, motion) for motion in motions]), 0.99))
    taken = float(np.quantile(np.concatenate(logged), 0.99))
    if done >= _WORKING and taken > 0:
        fits = [unit for unit in units(si) if _POWER[0] <= taken * unit.factor / done <= _POWER[1]]
        why = f"by a check: it reaches {taken:.3g} where torque times speed reaches {done:.3g} W"
        return UnitEvidence(fits[0] if len(fits) == 1 else None, tuple(fits), why)
    return _by_size(si, taken, _TAKEN)


def by_size(si: str, logged: Sequence[np.ndarray], bounds: tuple[float, float]) -> UnitEvidence:
    """Values whose greatest (99 % of them are below) lies between bounds, in SI units, in one unit alone."""
    return _by_size(si, float(np.quantile(np.abs(np.concatenate([values.ravel() for values in logged])), 0.99)), bounds)


def _by_size(si: str, greatest: float, bounds: tuple[float, float]) -> UnitEvidence:
    fits = [unit for unit in units(si) if bounds[0] <= float(unit.to_si(np.array(greatest))) <= bounds[1]]
    why = f"by its numbers: they reach {greatest:.3g}"
    return UnitEvidence(fits[0] if len(fits) == 1 else None, tuple(fits), why)


def _bodies(robot: Robot, motion: MeasuredRun) -> np.ndarray:
    """Return the torques of the description's bodies at a few samples, (M, n)."""
    speed, acceleration = motion.derivative(1), motion.derivative(2)
    rows = np.linspace(0, len(motion.time) - 1, min(_EVALUATED, len(motion.time))).astype(int)
    return inverse_dynamics(robot.model, motion.q[rows], speed[rows], acceleration[rows])


def _done(robot: Robot, motion: MeasuredRun) -> np.ndarray:
    """Return the power that the joints put into the motion, W; by the description's bodies where no torque is known."""
    if motion.torque is not None:
        return np.asarray(np.maximum((motion.torque * motion.derivative(1)).sum(axis=1), 0.0))
    if not robot.joints:  # of a meter's log nothing is known of it
        return np.zeros(1)
    rows = np.linspace(0, len(motion.time) - 1, min(_EVALUATED, len(motion.time))).astype(int)
    return np.asarray(np.maximum((_bodies(robot, motion) * motion.derivative(1)[rows]).sum(axis=1), 0.0))

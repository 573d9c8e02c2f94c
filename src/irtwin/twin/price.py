"""What a motion costs by a twin: energy, peak and mean power, and how sure the twin is of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from irtwin.effects.effect import NORMAL
from irtwin.identification.power_line import power_slope
from irtwin.signals.motion import Motion, standstill, stretches, trapezoid
from irtwin.twin.twin import Twin

_PIECE = 4096  # samples whose regressor is held at once
_WATT_HOUR = 3600.0  # J
_SAME_POSE = 0.1  # rad (m)


@dataclass(frozen=True)
class Figure:
    """A predicted value with half its 95 % interval; None where the twin does not know how sure its numbers are."""

    value: float
    half_width: float | None

    def times(self, factor: float) -> Figure:
        """Return the figure times a factor, above 0."""
        return Figure(self.value * factor, None if self.half_width is None else self.half_width * factor)

    def __str__(self) -> str:
        by = "" if self.half_width is None else f" +- {float(f'{self.half_width:.2g}'):g}"
        return f"{self.value:.4g}{by}"


@dataclass(frozen=True)
class Price:
    """What a motion takes: seconds, energy J, greatest and mean electrical power W.

    The intervals hold how unsure the twin's parameters are, and what its effects leave of power.
    """

    seconds: float
    energy: Figure
    peak: Figure
    mean: Figure

    def __str__(self) -> str:
        hours = self.energy.times(1 / _WATT_HOUR)
        parts = (
            f"energy {self.energy} J ({hours} Wh)",
            f"peak power {self.peak} W",
            f"mean power {self.mean} W",
        )
        known = self.energy.half_width is not None
        return ", ".join(parts) + ("; +- 95 % interval" if known else "; intervals not known")


def price(twin: Twin, motions: Sequence[Motion]) -> Price | None:
    """Return what motions take together; None where the twin has identified nothing of power.

    To first order in the parameters; effects that build on predicted power (bus, chopper) are taken as they are.
    """
    return cost(twin, motions) if twin.knows_power else None


def cost(twin: Twin, motions: Sequence[Motion]) -> Price:
    """Return what `price` does; of a twin that knows nothing of power, what its joints take together."""
    powers = [twin.power(motion) for motion in motions]
    seconds = sum(map(_seconds, motions))
    highest = int(np.argmax([power.max() for power in powers]))
    most = int(np.argmax(powers[highest]))
    taken = balance(twin, *((motion, trapezoid(motion.time)) for motion in motions))
    width = None
    if twin.covariance is not None:
        at_peak = np.zeros(len(powers[highest]))
        at_peak[most] = 1.0
        slope = _slope(twin, motions[highest], at_peak)
        width = _half_width(twin, slope, twin.remainder.sample if twin.remainder else 0.0)
    return Price(seconds, taken, Figure(float(powers[highest][most]), width), taken.times(1 / seconds))


def balance(twin: Twin, *parts: tuple[Motion, np.ndarray]) -> Figure:
    """Return the energy, J, of motions by the weights of their samples, (N,) s each; of negative ones it is taken off.

    What is unsure in all alike, as the standby power, drops out; what effects leave of each motion does not.
    """
    value = sum(float(weights @ twin.power(motion)) for motion, weights in parts)
    if twin.covariance is None:
        return Figure(value, None)
    slope = sum((_slope(twin, motion, weights) for motion, weights in parts), np.zeros(len(twin.parameters)))
    return Figure(value, _half_width(twin, slope, *_left(twin, parts)))


def mean_power(twin: Twin, motion: Motion, where: np.ndarray) -> Figure:
    """Return the mean power over those samples of a motion `where` (N,) is true, W; some are."""
    weights = np.where(where, trapezoid(motion.time), 0.0)
    return balance(twin, (motion, weights)).times(1 / float(weights.sum()))


def saving(twin: Twin, motion: Motion, was: Motion) -> Figure:
    """Return the electrical energy, J, that a motion saves in place of one that was; negative if it costs.

    Where it lasts longer, the one that was stands longer where it stood last.
    """
    instead = with_standing(was, _seconds(motion))
    return balance(twin, (instead, trapezoid(instead.time)), (motion, -trapezoid(motion.time)))


def kilogram_less(twin: Twin, motion: Motion) -> Figure:
    """Return the electrical energy, J, that a motion saves by a kilogram less at the flange, where its payload is."""
    heavier = max(motion.payload_mass, 1.0)
    return saving(twin, replace(motion, payload_mass=heavier - 1), replace(motion, payload_mass=heavier))


def with_standing(motion: Motion, seconds: float) -> Motion:
    """Return a motion that lasts so many seconds, if it is shorter: it stands longer where it stood last."""
    more = round((seconds - _seconds(motion)) * motion.rate)
    if more < 1:
        return motion
    count = len(motion.time)
    last = max(np.flatnonzero(standstill(motion)), default=count - 1)
    rows = np.insert(np.arange(count), last, np.full(more, last))
    moves = np.insert(np.ones(count), last, np.zeros(more))[:, None]
    time = motion.time[0] + np.arange(count + more) / motion.rate
    return motion.moved(time, motion.q[rows], motion.dq[rows] * moves, motion.ddq[rows] * moves)


def _left(twin: Twin, parts: Sequence[tuple[Motion, np.ndarray]]) -> list[float]:
    """Return what effects leave of a balance, J, one standard deviation each: of motions, and of poses of their pauses.

    What is left at a pose is the same in each motion, so what stands there as long in both drops out; so does what is
    left of one way that is gone with two payloads.
    """
    if twin.remainder is None:
        return []
    standing: dict[tuple[int, ...], float] = {}
    ways: dict[int, float] = {}
    for motion, weights in parts:
        ways[id(motion.q)] = ways.get(id(motion.q), 0.0) + float(weights.sum())
        for own in stretches(standstill(motion)):
            pose = tuple(np.round(motion.q[own].mean(axis=0) / _SAME_POSE).astype(int).tolist())
            standing[pose] = standing.get(pose, 0.0) + float(weights[own].sum())
    lasting = (twin.remainder.energy(abs(seconds)) for seconds in ways.values())
    return [*lasting, *(twin.remainder.pause * seconds for seconds in standing.values())]


def _slope(twin: Twin, motion: Motion, weights: np.ndarray) -> np.ndarray:
    """Return the slope of the weighted (N,) sum of power over each of the twin's p parameters, (p,)."""
    stack = twin.stack
    torque_values, power_values = twin.torque_values, twin.power_values
    over_torque, over_power = np.zeros(len(torque_values)), np.zeros(len(power_values))
    for piece in motion.pieces(_PIECE):
        own = weights[piece.start - motion.start : piece.start - motion.start + len(piece.time)]
        if not own.any():
            continue
        torque = stack.real_torque(piece, torque_values)
        slope = own[:, None] * power_slope(stack, piece, torque, power_values)
        over_torque[stack.real] += stack.carried(piece, slope, torque_values).sum(axis=0)
        over_power += own @ stack.predicted_power_columns(piece, torque_values, power_values)
    return twin.over_parameters(over_torque, over_power)


def _half_width(twin: Twin, slope: np.ndarray, *left: float) -> float:
    """Return half the 95 % interval of what goes by a `slope` (p,) with the parameters; `left`: what effects leave."""
    assert twin.covariance is not None
    return NORMAL * float(np.sqrt(max(float(slope @ twin.covariance @ slope), 0.0) + sum(rest**2 for rest in left)))


def _seconds(motion: Motion) -> float:
    return float(motion.time[-1] - motion.time[0])

"""The timing of a programme that takes least energy, in a given cycle time and in any."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
import scipy

from irtwin.errors import InputError
from irtwin.planning.programme import SectionedMotion
from irtwin.signals.motion import Motion
from irtwin.twin.price import Figure, cost, saving
from irtwin.twin.twin import Twin

_FACTORS = np.geomspace(0.5, 4.0, 19)  # of a move's duration; 1 is the tenth step of seven to a doubling
_DENSE = 400  # factors between them, at which energy is interpolated
_POINTS = 7  # of the curve
_LONGER = 1.5  # times the cycle of least energy, or of today, where the curve ends


@dataclass(frozen=True)
class Cycle:
    """A programme's timing: how many times longer each section is (S,), the motion, what it takes and saves a cycle.

    `saved`, J: against the motion as it was, and standing still after it as long as the new one lasts longer.
    """

    factors: np.ndarray
    motion: Motion
    energy: Figure
    saved: Figure

    @property
    def seconds(self) -> float:
        """The cycle time."""
        return float(self.motion.time[-1])


class CycleTimes:
    """What the moves of a programme take by a twin, at any duration that the robot can keep.

    A move goes faster than it did only where speed and torque of all joints have limits that it keeps. `least_pause`,
    s, is what a pause needs; what is longer may be given to the moves. None: pauses stay as they are.
    """

    def __init__(self, twin: Twin, programme: SectionedMotion, least_pause: float | None = None) -> None:
        self._twin, self._programme = twin, programme
        self._pauses = programme.are("pause")
        self._least = np.where(programme.are("move"), 0.0, programme.seconds)
        if least_pause is not None:
            self._least = np.where(self._pauses, np.minimum(self._least, least_pause), self._least)
        self._moves = np.flatnonzero(programme.are("move"))
        self._durations, self._energies = zip(*(self._of_move(int(number)) for number in self._moves), strict=True)
        pauses = [programme.alone(int(number)) for number in np.flatnonzero(self._pauses)]
        self._waiting = min(float(np.mean(twin.power(pause))) for pause in pauses)  # W

    @property
    def fastest(self) -> float:
        """The least cycle time, s."""
        return float(sum(durations[0] for durations in self._durations) + self._least.sum())

    @property
    def cheapest(self) -> float:
        """The cycle time in which the programme takes least energy, s; what waits after it is not counted."""
        return float(self._chosen(0.0).sum() + self._least.sum())

    def in_time(self, seconds: float) -> Cycle:
        """Return the timing that takes least in a cycle of so many seconds. Raises InputError where there is none."""
        room = seconds - self._least.sum()
        if self.fastest > seconds * (1 + 1e-9):
            raise InputError(
                f'run "{self._programme.motion.run}" cannot be done in {seconds:g} s; '
                f"the fastest that the robot's limits and its pauses allow is {self.fastest:.4g} s"
            )
        price = _least_price(lambda watts: float(self._chosen(watts).sum()), room, -self._waiting)
        own = self._programme.seconds[self._moves]
        timings = [self._chosen(price), *([own] if own.sum() <= room else [])]
        motions = [(factors, self._programme.retimed(factors)) for factors in self._with_pauses(timings, seconds)]
        factors, motion = min(motions, key=lambda pair: self._twin.energy(pair[1]))
        saved = saving(self._twin, motion, self._programme.motion)
        return Cycle(factors, motion, cost(self._twin, [motion]).energy, saved)

    def curve(self) -> list[Cycle]:
        """Return the timings that take least from the fastest cycle to beyond the cheapest."""
        today = float(self._programme.seconds.sum())
        return [
            self.in_time(seconds)
            for seconds in np.geomspace(self.fastest, _LONGER * max(today, self.cheapest), _POINTS)
        ]

    def _of_move(self, number: int) -> tuple[np.ndarray, np.ndarray]:
        """Return the durations that a move may have, (D,) s rising, and the energy that each takes, (D,) J."""
        own = float(self._programme.seconds[number])
        factors, energies = [], []
        for factor in _FACTORS:
            motion = self._programme.alone(number, factor)
            if factor >= 1.0 - 1e-9 or self._keeps_limits(motion):
                factors.append(factor)
                energies.append(self._twin.energy(motion))
        dense = np.geomspace(factors[0], factors[-1], _DENSE)
        return own * dense, scipy.interpolate.PchipInterpolator(np.log(factors), energies)(np.log(dense))

    def _keeps_limits(self, motion: Motion) -> bool:
        joints = self._twin.robot.joints
        speed, effort = np.array([(joint.velocity, joint.effort) for joint in joints]).T
        known = np.isfinite([speed, effort]).all()
        return bool(
            known and (np.abs(motion.dq) <= speed).all() and (np.abs(self._twin.joint_torque(motion)) <= effort).all()
        )

    def _chosen(self, price: float) -> np.ndarray:
        """Return the moves' durations, (M,) s, that take least where each second costs so many watts besides."""
        moves = zip(self._durations, self._energies, strict=True)
        return np.array([seconds[np.argmin(energy + price * seconds)] for seconds, energy in moves])

    def _with_pauses(self, timings: Sequence[np.ndarray], seconds: float) -> Iterator[np.ndarray]:
        """Yield the factors (S,) of timings of the moves, (M,) s each, in a cycle of so many `seconds`.

        What the moves leave goes to the pauses as they had it, or all of it, or all but what they had, to the last one:
        brakes close in a long pause alone.
        """
        was = np.where(self._pauses, self._programme.seconds, self._least)
        last = np.zeros(len(was))
        last[np.flatnonzero(self._pauses)[-1]] = 1.0
        had = was - self._least
        for moves, (least, share) in product(timings, ((self._least, had), (self._least, last), (was, last))):
            left = seconds - moves.sum() - least.sum()
            if left < -1e-9 or (left > 1e-9 and not share.any()):
                continue
            taken = least + max(left, 0.0) * share / max(share.sum(), 1e-9)
            taken[self._moves] = moves
            yield taken / self._programme.seconds


def _least_price(room_taken: Callable[[float], float], room: float, lowest: float) -> float:
    """Return the least price of time, W and at least `lowest`, at which the moves keep to their room, s."""
    if room_taken(lowest) <= room:
        return lowest
    low, high = lowest, max(1.0, -2 * lowest)
    while room_taken(high) > room:
        low, high = high, 4 * high
        if high > 1e9:
            return high  # what is left is rounding: the fastest
    for _ in range(60):
        middle = (low + high) / 2
        low, high = (low, middle) if room_taken(middle) <= room else (middle, high)
    return high

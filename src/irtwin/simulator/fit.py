"""Numbers of servos by least squares on what is played: the joints side by side, one change tried in all at once."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np

from irtwin.identification.progress import tell_step
from irtwin.signals.sampling import interval
from irtwin.simulator.alone import Alone
from irtwin.simulator.equations import Equations
from irtwin.simulator.play import PlayedStretch, play
from irtwin.simulator.servos import HOLDS, NAMES, OF_JOINTS, OF_ROBOT, SOFT, Servos

_HOLDING = NAMES.index("holding")
# rows of joints that least squares finds by single joints, and by the whole model
SMOOTH = tuple(row for row in range(len(OF_JOINTS)) if row not in (_HOLDING, *SOFT))
BY_WHOLE = (*SMOOTH, *SOFT)
SHARED = tuple(NAMES.index(name) for name in OF_ROBOT)
_LEAST, _LEAST_OF_TORQUE = 2e-4, 1e-3  # rad (m); share of a joint's torque
_BEGUN, _LOOKS = 50.0, 3.0  # times that, and independent samples, before either is known
_SETTLED = 0.3  # s after which where a stretch began is forgotten
_TIMES = (1.0, 0.3, 0.1, 0.03, 0.01)  # the simulator's stiffness, where it is begun
_SETTLES = 0.06  # s, damping over stiffness there
_STICKS = (0.005, 0.02)  # rad, friction over stiffness there
_DAMPINGS = (0.2, 1.0, 8.0, 64.0)  # times that of the pass before
_PASSES, _WORTH = 12, 0.05
_LIMITS = (0.95, 0.85, 0.7, 0.5, 0.35, 0.25, 0.15)  # of the limit, or of the most that the servo is asked for, tried
_LATE = (0, 1, 2, 3, 4, 6, 8)  # samples by which commands are tried later
_NEARER = (0.8, 0.9, 1.1, 1.25)  # times the best of them
_CHART = {  # step of a difference quotient, farthest that one step goes, and standard deviation from the simulator's
    "armature": (0.05, 1.0, 0.5),
    "offset": (0.002, 0.05, 0.1),
    "delay": (0.004, 0.02, 0.05),
    "dead_band": (0.001, 0.01, 0.02),
    "spring": (0.02, 0.3, 0.5),
    "compliance": (0.05, 0.5, 1.0),
    "link_compliance": (0.05, 0.5, 1.0),
    "payload": (0.05, 1.0, 9.0),
    **dict.fromkeys(OF_ROBOT[1:], (0.01, 0.05, 0.2)),
}
_OTHERS = (0.05, 1.0, 3.0)
STEP, FARTHEST, LIKELY = np.array([_CHART.get(name, _OTHERS) for name in NAMES]).T[:, :, None]


@dataclass(frozen=True)
class Played:
    """What is left of stretches beside numbers (k, n): squares (p, c, n), means over each stretch; `remainders`.

    Of positions, rad, and of torques, N m, where they were logged.
    """

    at: np.ndarray  # (k, n), in the chart
    remainders: tuple[np.ndarray, ...]  # a stretch: (N, c, n), robot less model
    squares: np.ndarray


def _remainder(stretch: PlayedStretch, moved: np.ndarray) -> np.ndarray:
    """Return what of a stretch (N, c, n) is left once where it began is forgotten."""
    left = (stretch.measured - moved)[stretch.time >= _SETTLED]
    return np.asarray(np.nan_to_num(left, nan=1e3, posinf=1e3, neginf=-1e3))


@dataclass(frozen=True)
class Fit:
    """What numbers are fitted to, and how a misfit counts.

    A stretch counts by the logarithm of its mean square: how much any may be off is not known before. `certainty`
    (c, n): independent samples a stretch has; `floor` (c, n), rad and N m: misfits below it are none.
    """

    alone: Alone
    floor: np.ndarray
    certainty: np.ndarray
    beyond: tuple[np.ndarray, ...] | None = None  # a stretch: (N, c, n), the whole model beyond single joints
    known: dict[bytes, list[np.ndarray]] = field(default_factory=dict)  # what the whole model did, by its numbers

    @cached_property
    def least(self) -> np.ndarray:
        """A misfit that is none (c, n): less than encoders resolve, and torques are measured to."""
        squares = np.mean([(stretch.measured**2).mean(axis=0) for stretch in self.stretches], axis=0)
        return np.vstack([np.full_like(squares[:1], _LEAST), _LEAST_OF_TORQUE * np.sqrt(squares[1:])])

    @property
    def servos(self) -> Servos:
        """The simulator's servos."""
        return self.alone.servos

    @property
    def stretches(self) -> tuple[PlayedStretch, ...]:
        """What is played."""
        return self.alone.stretches

    def played(self, at: np.ndarray) -> Played:
        """Play numbers (k, n) of the chart."""
        return self.all_played([at])[0]

    def all_played(self, many: Sequence[np.ndarray]) -> list[Played]:
        """Play several numbers of the chart."""
        all_moved = self.alone.play([self.servos.of_chart(at) for at in many])
        beyond = self.beyond or (0.0,) * len(self.stretches)
        return [
            self._left(at, [motion + more for motion, more in zip(moved, beyond, strict=True)])
            for at, moved in zip(many, all_moved, strict=True)
        ]

    def rolled(self, at: np.ndarray) -> Played:
        """Play numbers (k, n) of the chart by the whole model."""
        return self._left(at, self._whole(at))

    def all_rolled(self, many: Sequence[np.ndarray]) -> list[Played]:
        """Play several numbers of the chart by the whole model."""
        all_moved = play(self.servos, [self.servos.of_chart(at) for at in many], self.stretches)
        return [self._left(at, moved) for at, moved in zip(many, all_moved, strict=True)]

    def _whole(self, at: np.ndarray) -> list[np.ndarray]:
        asked = at.tobytes()
        if asked not in self.known:
            self.known[asked] = play(self.servos, [self.servos.of_chart(at)], self.stretches)[0]
        return self.known[asked]

    def about(self, at: np.ndarray) -> Fit:
        """Return the fit that plays as the whole model at numbers (k, n) of the chart, with slopes of single joints."""
        single = self.alone.play([self.servos.of_chart(at)])[0]
        return replace(self, beyond=tuple(whole - alone for whole, alone in zip(self._whole(at), single, strict=True)))

    def _left(self, at: np.ndarray, moved: Sequence[np.ndarray]) -> Played:
        left = [_remainder(stretch, played) for stretch, played in zip(self.stretches, moved, strict=True)]
        return Played(at, tuple(left), np.array([(remainder**2).mean(axis=0) for remainder in left]))

    def replaced(self, played: Played, place: int, moved: np.ndarray) -> Played:
        """Return what is left where the model did otherwise in a stretch: `moved` (N, c, n)."""
        left, squares = list(played.remainders), played.squares.copy()
        left[place] = _remainder(self.stretches[place], moved)
        squares[place] = (left[place] ** 2).mean(axis=0)
        return Played(played.at, tuple(left), squares)

    def cost(self, played: Played) -> np.ndarray:
        """Return how bad numbers are, (n,), as a logarithm of probability: what is left, and how far they are."""
        return np.asarray(self.misfit(played) + (self.away(played.at) ** 2).sum(axis=0) / 2)

    def total(self, played: Played) -> float:
        """Return how bad numbers of all joints are."""
        return float(self.cost(played).sum())

    def misfit(self, played: Played) -> np.ndarray:
        """Return what is left as a logarithm of probability, (n,)."""
        return np.asarray((self.certainty / 2 * np.log1p(played.squares / self.floor**2)).sum(axis=(0, 1)))

    def away(self, at: np.ndarray) -> np.ndarray:
        """Return how far numbers (k, n) are from the simulator's, in standard deviations of what is likely."""
        off = (at - self.servos.chart(self.servos.numbers)) / LIKELY
        off[_HOLDING] = 0.0
        return np.asarray(off)

    def slopes(self, played: Played, rows: Sequence[int] = SMOOTH) -> Equations:
        """Return the equations (p, n, ...) of each stretch and joint for a step of some rows of the numbers."""
        return self.all_slopes([(played, rows)])[0]

    def all_slopes(self, many: Sequence[tuple[Played, Sequence[int]]]) -> list[Equations]:
        """Return the equations about several numbers, each of its rows."""
        stepped = [played.at + STEP * (np.arange(len(NAMES)) == row)[:, None] for played, rows in many for row in rows]
        moved = iter(self.all_played(stepped))
        return [
            self.sums(played, rows, [next(moved) for _ in rows], np.array([STEP[row, 0] for row in rows]))
            for played, rows in many
        ]

    def sums(self, played: Played, rows: Sequence[Any], moved: Sequence[Played], steps: np.ndarray) -> Equations:
        """Return the equations (p, n, ...) of each stretch and joint, weighted as the misfit counts.

        By what is left where each of the rows is `moved` by one of `steps` (k,).
        """
        equations = []
        for place, left in enumerate(played.remainders):
            columns = left - np.array([stepped.remainders[place] for stepped in moved]).reshape(-1, *left.shape)
            weight = self.certainty / (len(left) * (played.squares[place] + self.floor**2))
            equations.append(Equations.of(rows, columns / steps[:, None, None, None], left, weight))
        return Equations.beside(equations)

    def solved(self, best: Played, free: np.ndarray, passes: int = _PASSES) -> Played:
        """Return numbers with those that are free (k, n) fitted."""
        return self.all_solved([(best, free)], passes)[0]

    def all_solved(self, begun: Sequence[tuple[Played, np.ndarray]], passes: int = _PASSES) -> list[Played]:
        """Return several numbers, each with those that are free (k, n) fitted, by Levenberg's way, all played at once.

        Each joint has a damping of its own. It keeps what it has where nothing better is found; all joints do where
        what they share is free.
        """
        solved, free = [best for best, _ in begun], [some for _, some in begun]
        rows = [[row for row in (*SMOOTH, *SHARED) if some[row].any()] for some in free]
        damping = np.full((len(begun), len(self.servos.model.joints)), 1e-2)
        going = [k for k, own in enumerate(rows) if own]
        for number in range(passes):
            every = self.all_slopes([(solved[k], rows[k]) for k in going])
            steps = [
                self._steps(solved[k].at, slopes, free[k], damping[k] * times)
                for k, slopes in zip(going, every, strict=True)
                for times in _DAMPINGS
            ]
            ways = [solved[k].at for k in going for _ in _DAMPINGS]
            numbers = [self.servos.of_chart(at + step) for at, step in zip(ways, steps, strict=True)]
            tried = iter(self.all_played([self.servos.chart(candidate) for candidate in numbers]))
            for k in tuple(going):
                own, together = [next(tried) for _ in _DAMPINGS], any(row in SHARED for row in rows[k])
                before, chosen = self.cost(solved[k]), np.argmin(self._costs(own, together), axis=0)
                solved[k] = self.best((solved[k], *own), together)
                damping[k] = np.maximum(damping[k] * np.array(_DAMPINGS)[chosen], 1e-4)
                if (before - self.cost(solved[k]) < _WORTH).all():
                    going.remove(k)
            if not going:
                break
            left = 1e3 * np.sqrt(min(solved[k].squares[:, 0].mean() for k in going))
            tell_step(f"  numbers of servos, pass {number + 1} of {passes} at most: {left:.3g} mrad left")
        return solved

    def _steps(self, at: np.ndarray, slopes: Equations, free: np.ndarray, damping: np.ndarray) -> np.ndarray:
        """Return the step (k, n) of all numbers, none of those that are not free."""
        steps = np.zeros(at.shape)
        joints = [self.equations(at, slopes, free, joint).damped(own) for joint, own in enumerate(damping)]
        alike = [row for row in slopes.rows if row in SHARED]
        if alike:
            shared = Equations.beside([equations.marginal(alike) for equations in joints]).together()
            steps[alike] = shared.step(FARTHEST[alike, 0])[:, None]
        for joint, equations in enumerate(joints):
            own = [row for row in equations.rows if row not in SHARED]
            # less the step of what they share
            beside = replace(equations, right=equations.right - equations.normal @ steps[equations.rows, joint])
            steps[own, joint] = beside.some(own).step(FARTHEST[own, 0])
        return steps

    def equations(
        self, at: np.ndarray, slopes: Equations, free: np.ndarray, joint: int, chosen: np.ndarray | slice = slice(None)
    ) -> Equations:
        """Return a joint's equations of those of the slopes' rows that are free (k, n), from stretches chosen."""
        own = [row for row in slopes.rows if free[row, joint]]
        every = Equations(slopes.rows, slopes.normal[chosen, joint], slopes.right[chosen, joint])
        return every.together().some(own).likely(self.away(at)[own, joint], LIKELY[own, 0])

    def _costs(self, tried: Sequence[Played], together: bool) -> np.ndarray:
        costs = np.array([self.cost(played) for played in tried])
        return np.broadcast_to(costs.sum(axis=1, keepdims=True), costs.shape) if together else costs

    def best(self, tried: Sequence[Played], together: bool = False) -> Played:
        """Return of each joint, or of all `together`, the numbers that cost least.

        One joint's play is nothing to another's.
        """
        chosen = np.argmin(self._costs(tried, together), axis=0)

        def mixed(parts: Sequence[np.ndarray]) -> np.ndarray:
            return np.stack([parts[winner][..., joint] for joint, winner in enumerate(chosen)], axis=-1)

        stretches = range(len(self.stretches))
        return Played(
            mixed([played.at for played in tried]),
            tuple(mixed([played.remainders[place] for played in tried]) for place in stretches),
            mixed([played.squares for played in tried]),
        )

    def limited(self, best: Played) -> Played:
        """Return numbers with the limits of torque that are better, if any: one that is never reached has no slope."""
        numbers, row = self.servos.of_chart(best.at), NAMES.index("torque_limit")
        _, servo = self.servos.dampings(numbers[NAMES.index("damping")])
        asked = []
        for stretch in self.stretches:
            off = stretch.commands(stretch.time, 1e-3, numbers) + numbers[NAMES.index("offset")] - stretch.q
            asked.append(np.abs(numbers[0] * off - servo * stretch.speed).max(axis=0))
        better, most = best, np.minimum(numbers[row], np.max(asked, axis=0))
        for shares, about in ((_LIMITS, most), (_NEARER, None)):
            middle = self.servos.of_chart(better.at)[row] if about is None else about
            tried = [np.where(self._free(row), middle * share, numbers) for share in shares]
            better = self.best((better, *self.all_played([self.servos.chart(candidate) for candidate in tried])))
        return better

    def delayed(self, best: Played) -> Played:
        """Return numbers with the delays that are better, if any, by whole samples.

        Torque has a step at each command, so that a delay between samples is worse than any next to it.
        """
        numbers, row = self.servos.of_chart(best.at), NAMES.index("delay")
        is_delay = self._free(row)
        apart = interval(self.stretches[0].time)
        tried = [np.where(is_delay, self.servos.numbers + late * apart, numbers) for late in _LATE]
        return self.best((best, *self.all_played([self.servos.chart(candidate) for candidate in tried])))

    def _free(self, row: int) -> np.ndarray:
        """Return where a row of numbers (k, n) can differ."""
        return np.asarray(self.servos.can_differ & (np.arange(len(NAMES)) == row)[:, None])

    def begun(self) -> Played:
        """Return numbers to begin with: of several stiffnesses, the others fitted beside each, each joint's best."""
        own, grids = self.servos.numbers, []
        free = self.servos.can_differ.copy()
        free[[NAMES.index("stiffness"), NAMES.index("holding"), *SOFT]] = False
        for times in _TIMES:
            stiffness = own[0] * times
            ways = [own[1:3]] + [np.array([stiffness * _SETTLES, stiffness * share]) for share in _STICKS]
            every = [np.vstack([stiffness, *way, np.full_like(stiffness, HOLDS), own[4:]]) for way in ways]
            grids.append([np.where(self.servos.can_differ, start, own) for start in every])
        begun = [self.best(self.all_played([self.servos.chart(start) for start in grid])) for grid in grids]
        return self.best(self.all_solved([(played, free) for played in begun], 3))


def unjudged(alone: Alone) -> Fit:
    """Return a fit that knows nothing of its misfit yet."""
    fit = Fit(alone, np.array(0.0), np.array(0.0))
    return replace(fit, floor=_BEGUN * fit.least, certainty=np.full(fit.least.shape, _LOOKS))

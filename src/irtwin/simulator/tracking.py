"""Tracking error: what a robot's positions and torques have beyond a model's, by run, horizon and what differs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from math import factorial

import numpy as np

from irtwin.identification.progress import track
from irtwin.identification.validation import energy, energy_error
from irtwin.robot.description import Robot
from irtwin.robot.kinematics import placements
from irtwin.signals.log import Run
from irtwin.simulator.choice import DifferingNumbers
from irtwin.simulator.play import PlayedStretch, Push, each, play, speeds, whole
from irtwin.simulator.servos import NAMES, Servos, part_of

_FOLDS = 3
_BEGUN_ANEW, _MOST = 0.5, 60  # s; how often in a run
_HORIZONS = (0.1, 0.2, 0.3, 0.4, 0.5)  # s
_NONE = 1e-14  # rad^2 (m^2), a mean square as good as none
_POSES = 500  # of a run, of which the flange's place is told

OfRun = Mapping[str, np.ndarray]  # by a run's name, numbers (k, n)


@dataclass(frozen=True)
class Tracked:
    """A run played as a whole: the tracking error's mean `squares` (c, n), rad^2 and N^2 m^2.

    energy_error: %, of the work that joints do on the arm; None where no torque was logged. At some times (P,), s:
    positions of robot and model (P, n), and how far apart they have the flange, `off` (P,) m.
    """

    squares: np.ndarray
    energy_error: float | None
    time: np.ndarray
    robot: np.ndarray
    model: np.ndarray
    off: np.ndarray

    @property
    def flange(self) -> float:
        """The error of the flange's place, m, RMS."""
        return float(np.sqrt((self.off**2).mean()))


@dataclass(frozen=True)
class Parts:
    """Mean squares (G, c, n) of what groups of stretches leave, by which names' numbers are the robot's.

    A group is a run; a stretch where there is one run.
    """

    names: tuple[str, ...]
    squares: Mapping[frozenset[str], np.ndarray]

    @property
    def before(self) -> np.ndarray:
        """What the model leaves."""
        return self.squares[frozenset()]

    @property
    def after(self) -> np.ndarray:
        """What the robot's numbers leave."""
        return self.squares[frozenset(self.names)]

    def alone(self, name: str) -> np.ndarray:
        """What is left with the numbers of one name alone."""
        return self.squares[frozenset([name])]

    def without(self, name: str) -> np.ndarray:
        """What is left with all numbers but those of one name."""
        return self.squares[frozenset(self.names) - {name}]

    def relative(self, squares: np.ndarray) -> np.ndarray:
        """Return squares (G,) summed over joints, and over channels, each in units of what the model leaves of it."""
        return np.asarray((squares / np.maximum(self.before.mean(axis=(0, 2)), _NONE)[:, None]).sum(axis=(1, 2)))

    def closed(self, names: Sequence[str], of: Sequence[Sequence[str]]) -> np.ndarray:
        """Return the mean squares (G, c, n) that some names close, on average over orders in which parts `of` join."""
        others, closed = [part for part in of if part != names], np.zeros_like(self.before)
        for count in range(len(others) + 1):
            weight = factorial(count) * factorial(len(others) - count) / factorial(len(of))
            for some in combinations(others, count):
                there = frozenset(name for part in some for name in part)
                closed += weight * (self.squares[there] - self.squares[there | set(names)])
        return closed


def held_out(chosen: DifferingNumbers, runs: Sequence[Run]) -> OfRun:
    """Return for each run numbers that other runs alone say; of one run alone its own."""
    folds = min(_FOLDS, len(runs))
    by_run: dict[str, np.ndarray] = {}
    for fold in range(folds):
        names = {run.name for run in runs[fold::folds]}
        left_out = np.array([stretch.run.name in names for stretch in chosen.fit.stretches])
        by_run |= dict.fromkeys(names, chosen.without(left_out) if folds > 1 else chosen.numbers)
    return by_run


def tracked(
    robot: Robot, own: Servos, runs: Sequence[Run], numbers: OfRun, pushes: tuple[Push, ...] = ()
) -> list[Tracked]:
    """Play runs as a whole, each with its numbers and pushes.

    Raises InputError where the model as it is, with its own numbers, is unstable.
    """
    tracks = []
    for run in track(runs, lambda run: f"playing {run.name}"):
        every = whole(run, pushes)
        as_it_is = numbers[run.name] is own.numbers
        measured, played = every.measured, play(own, [numbers[run.name]], [every], strict=as_it_is)[0][0]
        left = measured - played
        some = slice(None, None, max(1, len(left) // _POSES))
        poses = every.q[some], (every.q - left[:, 0])[some]
        places = [placements(robot, q)[:, :3, 3] for q in poses]
        off = np.linalg.norm(places[0] - places[1], axis=1)
        works = [work(every.time, done) for done in (measured, played)] if measured.shape[1] > 1 else None
        error = None if works is None else energy_error(*works)
        tracks.append(Tracked((left**2).mean(axis=0), error, run.signals.time[some], *poses, off))
    return tracks


def work(time: np.ndarray, done: np.ndarray) -> float:
    """Return the work (J) that joints do, of positions and torques (N, 2, n): what they take back feeds no other."""
    power = done[:, 1] * speeds(time, done[:, 0])
    return energy(time, np.maximum(power, 0.0).sum(axis=1))


def restarted(own: Servos, runs: Sequence[Run], numbers: OfRun, pushes: tuple[Push, ...] = ()) -> dict[float, float]:
    """Return the tracking error of runs that begin anew each half second, from a horizon, s, to the one before."""
    times, left = [], []
    for run in track(runs, lambda run: f"{run.name} played again and again from where the robot is"):
        stretches = each(run, _BEGUN_ANEW, _MOST, pushes)
        times += [stretch.time for stretch in stretches]
        played = play(own, [numbers[run.name]], stretches)[0]
        left += [(stretch.q - moved[:, 0]) ** 2 for stretch, moved in zip(stretches, played, strict=True)]
    time, squares = np.concatenate(times), np.concatenate(left).mean(axis=1)
    errors = {}
    for low, high in zip((0.0, *_HORIZONS), _HORIZONS, strict=False):
        inside = (time >= low) & (time < high)
        if inside.any():
            errors[high] = float(np.sqrt(squares[inside].mean()))
    return errors


def parts(
    own: Servos,
    stretches: Sequence[PlayedStretch],
    numbers: OfRun,
    families: Sequence[Sequence[str]],
    pushes: Mapping[str, Push],
) -> Parts:
    """Play stretches with each name's numbers alone, with all but them, and with those of any families.

    `pushes`: by their names, which are among those of families.
    """
    names = tuple(name for family in families for name in family)
    sets = {frozenset[str](), frozenset(names)}
    sets |= {subset for name in names for subset in (frozenset([name]), frozenset(names) - {name})}
    sets |= {
        frozenset(name for family in some for name in family)
        for count in range(len(families))
        for some in combinations(families, count)
    }
    squares = {subset: np.empty((len(stretches), *stretches[0].measured.shape[1:])) for subset in sets}
    for same in track(_alike(stretches, numbers), "what each number closes in runs"):
        robots = numbers[stretches[same[0]].run.name]
        for subset, left in squares.items():
            those = tuple(push for name, push in pushes.items() if name in subset)
            pushed = [replace(stretches[place], pushes=those) for place in same]
            differs = np.array([part_of(name) in subset for name in NAMES])[:, None]
            played = play(own, [np.where(differs, robots, own.numbers)], pushed)[0]
            for place, stretch, moved in zip(same, pushed, played, strict=True):
                left[place] = ((stretch.measured - moved) ** 2).mean(axis=0)
    runs = np.array([stretch.run.name for stretch in stretches])
    groups = [runs == name for name in dict.fromkeys(runs)] if len(set(runs)) > 1 else np.eye(len(runs), dtype=bool)
    means = {subset: np.array([left[group].mean(axis=0) for group in groups]) for subset, left in squares.items()}
    return Parts(names, means)


def _alike(stretches: Sequence[PlayedStretch], numbers: OfRun) -> list[list[int]]:
    """Return places of stretches, those of runs with the same numbers together."""
    by_numbers: dict[bytes, list[int]] = {}
    for place, stretch in enumerate(stretches):
        by_numbers.setdefault(numbers[stretch.run.name].tobytes(), []).append(place)
    return list(by_numbers.values())

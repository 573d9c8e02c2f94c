"""The cutoff of the filter by what the sensors resolve: the one with which a fitted twin tells other data best.

An encoder of coarse steps makes noise of the acceleration. A filter lets the less of it pass, the lower its cutoff;
too low a cutoff takes the motion away too. So it begins no higher than that noise makes no more of a torque than its
sensor does, and torque that took no part in the fit says whether less is better.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from irtwin.document.document import Cutoff
from irtwin.effects.catalogue import EXCITED
from irtwin.effects.stack import Stack
from irtwin.errors import InputError
from irtwin.identification.fits import fit_torque
from irtwin.robot.description import Robot
from irtwin.signals.conditioning import condition, cutoff_of_motion, white_noise
from irtwin.signals.log import Run
from irtwin.signals.motion import Motion
from irtwin.signals.sampling import interpolated

_MOST_SAMPLES = 40_000  # that are looked at: enough to tell one cutoff from its half
_FEWEST_PERIODS = 20  # of the cutoff in what is fitted, and in what is held out
_BETTER = 0.01  # of the squares that a lower cutoff has to save in each joint, in the mean: less is chance


def cutoff_for(robot: Robot, runs: Sequence[Run], stated: float | None) -> Cutoff:
    """Return the cutoff for runs that are to be treated alike: the one that is stated, Hz, as it is.

    It is of the robot's runs where there are any: a simulator has no sensors that noise could come of.
    Else it is ten times the band of the motion (`cutoff_of_motion`). Where noise of positions is louder than that of
    torque it is half of it, and that halved as long as the torque of what is held out is told better so.
    """
    if stated is not None:
        return Cutoff(hz=stated, stated=True, why="stated")
    runs = [run for run in runs if run.role != "simulated"] or runs
    highest, why = cutoff_of_motion(runs)
    resolved = _resolved(robot, runs)
    if resolved < highest:
        why = f"{why}, {highest:.3g} Hz, halved as noise of positions is louder than that of torque"
        highest /= 2
    halved = _halved(robot, runs, highest, resolved)
    if halved:
        times = {1: "once", 2: "twice"}.get(halved, f"{halved} times")
        why = f"{why}, {highest:.3g} Hz, halved {times}, as that tells held-out torque better"
    return Cutoff(hz=highest / 2**halved, stated=False, why=f"found: {why}")


def _resolved(robot: Robot, runs: Sequence[Run]) -> float:
    """Return up to which frequency, Hz, white noise of positions makes less of each torque than that has of its own.

    Below f it makes M (2 pi f)^2 / sqrt(5) as much of the torque, M being the inertia that a joint moves.
    """
    seen = [run.signals.rows(slice(_MOST_SAMPLES)) for run in runs if run.signals.torque is not None]
    if not seen:
        return np.inf
    of_positions = np.median([white_noise(signals.time, signals.q) for signals in seen], axis=0)
    of_torques = np.median(
        [white_noise(signals.time, signals.torque) for signals in seen if signals.torque is not None], axis=0
    )
    makes = robot.mean_inertia * of_positions
    told = (makes > 0) & (of_torques > 0)
    return float(np.sqrt(np.sqrt(5) * np.min(of_torques[told] / makes[told], initial=np.inf)) / (2 * np.pi))


def _halved(robot: Robot, runs: Sequence[Run], cutoff: float, resolved: float) -> int:
    """Return how often a cutoff, Hz, is halved; what is `resolved` is no noise to be taken away."""
    halvings = 0
    measured = [run for run in runs if run.signals.torque is not None]
    if not measured:
        return halvings
    share = max(_MOST_SAMPLES // len(measured), 1)
    looked_at = [replace(run, signals=run.signals.rows(slice(share))) for run in measured]
    parts = 1 if len(looked_at) > 1 else 2
    seconds = min(float(run.signals.time[-1] - run.signals.time[0]) for run in looked_at) / parts
    try:
        error = _held_out(robot, looked_at, cutoff)
        while cutoff > resolved and cutoff / 2 * seconds >= _FEWEST_PERIODS:
            lower = _held_out(robot, looked_at, cutoff / 2)
            if lower > error + np.log(1 - _BETTER):
                break
            cutoff, error, halvings = cutoff / 2, lower, halvings + 1
    except InputError:  # too short or too still to be cut in two: the fit of all of it says what is wrong, if anything
        pass
    return halvings


def _held_out(robot: Robot, runs: Sequence[Run], cutoff: float) -> float:
    """Return the mean over joints of the logarithm of the squares left in torque as logged, by a fit to the rest."""
    stack = Stack(robot, EXCITED)
    motions = [condition(run, robot, cutoff) for run in runs]
    logged = {run.name: run.signals for run in runs}
    squares, count = np.zeros(len(robot.joints)), np.zeros(len(robot.joints))
    for fitted, judged in _halves(motions):
        values = fit_torque(stack, fitted)[1].values
        for motion in judged:
            run = logged[motion.run]
            assert run.torque is not None
            torque = interpolated(run.time, run.torque, motion.time)
            decided = ~stack.undecided(motion)
            squares += np.sum((torque - stack.shown_torque(motion, values)) ** 2, axis=0, where=decided)
            count += decided.sum(axis=0)
    told = (squares > 0) & (count > 0)
    return float(np.mean(np.log(squares[told] / count[told]))) if told.any() else 0.0


def _halves(motions: Sequence[Motion]) -> list[tuple[list[Motion], list[Motion]]]:
    """Return what is fitted and what is judged, both ways: every second run, or the halves of the only one."""
    if len(motions) > 1:
        first, second = list(motions[::2]), list(motions[1::2])
    else:
        half = len(motions[0].time) // 2
        first, second = [motions[0].part(0, half)], [motions[0].part(half, len(motions[0].time))]
    return [(first, second), (second, first)]

"""What a stretch that is no motion of the robot's own does to its twin: `python bench/spoilt_stretches.py DATASET...`.

The first two thirds of each run are spoilt and fitted, the last third judges. Printed (Markdown) is the root mean
square of what the twin leaves of the joints' torques there, each joint's over that of the twin of the log as it is,
and that of the worst joint.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import numpy as np

from irtwin.effects.catalogue import BASELINE
from irtwin.signals.conditioning import choose_cutoff, condition, condition_for_fit
from irtwin.signals.log import DataSet, Run, read_data_set
from irtwin.twin.identify import identify
from irtwin.twin.validate import validate

Torque = np.ndarray  # (N, n)


def spikes(torque: Torque) -> Torque:
    """Return torque with one sample in 200 off by ten times the joint's usual size."""
    rng = np.random.default_rng(0)
    hit = rng.random(torque.shape) < 0.005
    return torque + hit * rng.choice([-10, 10], torque.shape) * torque.std(axis=0)


def contact(torque: Torque) -> Torque:
    """Return torque with somebody leaning on the arm for 4 % of the time."""
    return _between(torque, 0.4, 0.44, torque + 2 * torque.std(axis=0))


def held(torque: Torque) -> Torque:
    """Return torque that stays as it was for 5 % of the time."""
    return _between(torque, 0.3, 0.35, np.broadcast_to(torque[int(0.3 * len(torque))], torque.shape))


def dropped(torque: Torque) -> Torque:
    """Return torque that is zero for 5 % of the time."""
    return _between(torque, 0.6, 0.65, np.zeros_like(torque))


def loaded(torque: Torque) -> Torque:
    """Return torque that is 1.3 times as large in the last fifth."""
    return _between(torque, 0.8, 1.0, 1.3 * torque)


SPOILT: tuple[Callable[[Torque], Torque], ...] = (spikes, contact, held, dropped, loaded)


def _between(torque: Torque, begin: float, end: float, other: Torque) -> Torque:
    at = np.arange(len(torque)) / len(torque)
    return np.where(((at >= begin) & (at < end))[:, None], other, torque)


def cut(run: Run, rows: slice, spoil: Callable[[Torque], Torque] | None = None) -> Run:
    """Return some samples of a run, its torque spoilt."""
    signals = run.signals
    own: dict[str, Any] = {one.name: getattr(signals, one.name) for one in fields(signals)}
    own = {name: values[rows] for name, values in own.items() if isinstance(values, np.ndarray)}
    if spoil is not None and "torque" in own:
        own["torque"] = spoil(own["torque"])
    return replace(run, signals=replace(signals, **own))


def left(data_set: DataSet, spoil: Callable[[Torque], Torque] | None) -> np.ndarray:
    """Return what the twin leaves of the last thirds, (n,) N m RMS."""
    cutoff, robot = choose_cutoff(data_set.runs), data_set.robot
    ends = [2 * len(run.signals.time) // 3 for run in data_set.runs]
    pairs = list(zip(data_set.runs, ends, strict=True))
    fitted = [condition_for_fit(cut(run, slice(end), spoil), robot, cutoff) for run, end in pairs]
    judging = [condition(cut(run, slice(end, None)), robot, cutoff) for run, end in pairs]
    fits = validate(identify(robot, fitted, data_set.effects or BASELINE), judging)
    return np.sqrt(np.mean([fit.torque_rmse**2 for fit in fits if fit.torque_rmse is not None], axis=0))


def row(folder: Path) -> str:
    """Return the row of one data set."""
    data_set = read_data_set(folder)
    clean = left(data_set, None)
    ratios = [left(data_set, spoil) / clean for spoil in SPOILT]
    return f"| {folder.name} | " + " | ".join(f"{np.exp(np.log(r).mean()):.2f}, {r.max():.2f}" for r in ratios) + " |"


if __name__ == "__main__":
    print(f"| mean over joints, worst joint | {' | '.join(spoil.__name__ for spoil in SPOILT)} |")
    print("| --- " * (len(SPOILT) + 1) + "|")
    for argument in sys.argv[1:]:
        print(row(Path(argument)), flush=True)

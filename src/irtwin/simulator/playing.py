"""A simulator held against logs of commands and positions: which numbers of its servos differ, and what that closes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from irtwin.document.curves import Curves
from irtwin.document.document import Document
from irtwin.errors import InputError
from irtwin.identification.progress import tell
from irtwin.robot.description import Joint
from irtwin.signals.log import DataSet, Run
from irtwin.simulator import writing
from irtwin.simulator.alone import alone
from irtwin.simulator.choice import DifferingNumbers, choose
from irtwin.simulator.fit import unjudged
from irtwin.simulator.model import Model
from irtwin.simulator.play import PlayedStretch, Push, each, play
from irtwin.simulator.push import FoundPush, find_pushes
from irtwin.simulator.refined import softened
from irtwin.simulator.servos import NAMES, Servos, part_of, servos
from irtwin.simulator.tracking import held_out, parts, restarted, tracked
from irtwin.simulator.trusted import NOTHING, Trusted

_STRETCHES, _LASTS = 16, 15.0  # of all runs that numbers are fitted to; s, of each
_FALLEN, _BRIEF = 0.3, 2.0  # rad (m), RMS from the model, of a robot that falls; s, of its stretches
_LEAST = 3  # stretches of a run that is alone: to fit and to judge by
_STEP = 0.005  # s, of a joint played by itself
_AGREES = 0.03  # share of a joint's torque that is no gap
_FOLLOWS = 0.8  # correlation of positions with commands, from which a joint goes where it is told
_DEGREES = (50.0, 65.0)  # commands over positions, as slope: 180/pi is between
_UNMOVED = 0.1  # rad or m: a joint that is told to go farther moves, whatever its friction and play


@dataclass(frozen=True)
class Playing:
    """A diagnosis by playing: its document, what a page draws, and the robot's numbers."""

    document: Document
    curves: Curves
    chosen: DifferingNumbers
    against: str = "simulated"  # the role of what the observed runs are held against
    twin: None = None  # positions alone make none

    @property
    def is_open(self) -> bool:
        """Whether no number differs, and yet the torque, if it was logged, has more than noise beside the model's."""
        named = any(finding.matters for finding in self.document.findings)
        return not named and bool((self.chosen.torque_left > _AGREES).any())

    def written(self) -> bytes:
        """Return the model's file with the robot's numbers."""
        return self.chosen.fit.servos.written(self.chosen.numbers, self.chosen.differs)

    @property
    def unwritten(self) -> list[str]:
        """Which of the robot's numbers that file has no place for."""
        return self.chosen.fit.servos.unwritten(self.chosen.differs)

    def drawn(self, rng: np.random.Generator) -> bytes:
        """Return the model's file with the robot's numbers as they could be."""
        return self.chosen.fit.servos.written(self.chosen.drawn(rng), self.chosen.differs)


def diagnose(data_set: DataSet, model: Model, trust: Trusted = NOTHING) -> Playing:
    """Hold a model against the observed runs by playing their commands, and its servos' torque against what was logged.

    What it is to `trust` differs in no number.

    Raises InputError where `commanded_runs` does, or the model has no position servos.
    """
    runs = commanded_runs(data_set)
    if any(run.signals.torque is None for run in runs):
        runs = [replace(run, signals=replace(run.signals, torque=None)) for run in runs]
    own = replace(servos(model), trusted=trust.numbers)
    clipped = _clipped(own, runs)
    for line in clipped:
        tell(f"  {line}")
    tell("Fitting numbers of servos")
    stretches = _stretches(runs, _LASTS)
    if _falls(own, stretches):
        stretches = _stretches(runs, _BRIEF)
    step = max(_STEP, model.compiled.opt.timestep)
    chosen, pushes = _chosen(own, stretches, step, trust.pushes)
    chosen = softened(chosen)
    tell("Playing all runs")
    numbers, names = held_out(chosen, runs), [run.name for run in runs]
    before = tracked(data_set.robot, own, runs, dict.fromkeys(names, own.numbers))
    after = tracked(data_set.robot, own, runs, numbers, _of(pushes))
    differing = list(dict.fromkeys(part_of(name) for row, name in enumerate(NAMES) if chosen.differs[row].any()))
    named = {f"{writing.PUSH} {place}": found_push for place, found_push in enumerate(pushes)}
    families = writing.families([*differing, *named])
    closed = parts(chosen, numbers, families, {name: found_push.push for name, found_push in named.items()})
    horizons = restarted(own, runs, numbers, _of(pushes))
    return Playing(
        replace(
            writing.document(data_set.robot, model.name, names, chosen, named, closed, before, after, horizons),
            mended="\n".join([*clipped, *data_set.repairs]) or None,
        ),
        writing.curves(data_set.robot, names, before, after),
        chosen,
    )


def _chosen(
    own: Servos, stretches: Sequence[PlayedStretch], step: float, untouched: bool
) -> tuple[DifferingNumbers, tuple[FoundPush, ...]]:
    """Return the numbers that differ, and pushes: numbers are chosen anew beside these, and these beside numbers.

    A robot that is `untouched` has no pushes.
    """
    chosen = choose(unjudged(alone(own, stretches, step)))
    pushes = () if untouched else find_pushes(chosen)
    if not pushes:
        return chosen, ()
    tell("Fitting numbers of servos beside what pushed the flange")
    beside = choose(unjudged(alone(own, [replace(stretch, pushes=_of(pushes)) for stretch in stretches], step)))
    bare = replace(beside.fit, alone=replace(beside.fit.alone, stretches=tuple(stretches)), known={})
    again = find_pushes(replace(beside, fit=bare))
    return (beside, again) if again else (chosen, ())


def _of(pushes: Sequence[FoundPush]) -> tuple[Push, ...]:
    return tuple(found_push.push for found_push in pushes)


def _stretches(runs: Sequence[Run], lasts: float) -> list[PlayedStretch]:
    most = max(1, round(_STRETCHES / len(runs)))
    alone = runs[0].signals.time if len(runs) == 1 else None
    lasts = lasts if alone is None else min(lasts, float(alone[-1] - alone[0]) / _LEAST)
    return [stretch for run in runs for stretch in each(run, lasts, most)]


def _falls(own: Servos, stretches: Sequence[PlayedStretch]) -> bool:
    """Return whether the robot ends far from its model: too far for slopes to say which number does that."""
    moved = play(own, [own.numbers], stretches)[0]
    left = [stretch.q - played[:, 0] for stretch, played in zip(stretches, moved, strict=True)]
    return bool(max(np.sqrt((remainder**2).mean(axis=0)).max() for remainder in left) > _FALLEN)


def _clipped(own: Servos, runs: Sequence[Run]) -> list[str]:
    shares = own.clipped(np.concatenate([run.signals.command for run in runs if run.signals.command is not None]))
    return [
        f"{joint}: {100 * share:.3g} % of its commands are beyond the model's ctrlrange, which clips them"
        for joint, share in shares.items()
    ]


def commanded_runs(data_set: DataSet) -> list[Run]:
    """Return the observed runs, whose commands can be played.

    Raises InputError where there are none, or one has no commands, or those of a joint are in degrees, are its
    positions, go against these, or move nothing.
    """
    runs = [run for run in data_set.runs if run.role == "observed"]
    if not runs:
        raise InputError(f"{data_set.folder}: no run is observed; there is nothing to hold the model against")
    for run in runs:
        if run.signals.command is None:
            raise InputError(f"{run.file}: has no commands to play; log cmd_JOINT, or leave the run out")
    for k, joint in enumerate(data_set.robot.joints):
        signals = [
            (run, run.signals.command[:, k], run.signals.q[:, k]) for run in runs if run.signals.command is not None
        ]
        for run, told, q in signals:
            _check_run(run, joint, told, q)
        _check_sense(runs[0], joint, [(told, q) for _, told, q in signals])
    return runs


def _check_run(run: Run, joint: Joint, told: np.ndarray, q: np.ndarray) -> None:
    if np.ptp(q) == 0 and np.ptp(told) > _UNMOVED:
        raise InputError(
            f"{run.file}: column q_{joint.name} does not change, though the joint is told to move by "
            f"{np.ptp(told):.2g} {joint.unit}: a dead channel, or a joint without power; leave the run out"
        )
    slope = np.polyfit(q - q.mean(), told - told.mean(), 1)[0] if np.ptp(q) > 0 else 1.0
    follows = slope * q.std() >= _FOLLOWS * told.std()  # a joint that is stuck may have any slope
    if joint.unit == "rad" and _DEGREES[0] < slope < _DEGREES[1] and follows:
        raise InputError(f"{run.file}: column cmd_{joint.name} is in degrees beside positions in rad; give it in rad")


def _check_sense(run: Run, joint: Joint, pairs: Sequence[tuple[np.ndarray, np.ndarray]]) -> None:
    """Raise where the commands of all runs go against the joint's positions, or are these; `run` is the first."""
    told, q = (np.concatenate([values - values.mean() for values in some]) for some in zip(*pairs, strict=True))
    if np.ptp(told) > _UNMOVED and np.array_equal(told, q):
        raise InputError(f"{run.file}: column cmd_{joint.name} is q_{joint.name}; log what the joint was told")
    if told @ q < -_FOLLOWS * np.linalg.norm(told) * np.linalg.norm(q):
        raise InputError(
            f"{run.file}: column cmd_{joint.name} goes against q_{joint.name}, as in all runs; reverse the sign of one"
        )

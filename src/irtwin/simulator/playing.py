"""A simulator held against logs of commands and positions: which numbers of its servos differ, and what that closes."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace

import numpy as np

from irtwin.check.commands import faults
from irtwin.document.curves import Curves
from irtwin.document.document import Document
from irtwin.errors import InputError
from irtwin.identification.progress import tell
from irtwin.signals.log import DataSet, Run
from irtwin.simulator import writing
from irtwin.simulator.alone import alone
from irtwin.simulator.choice import DifferingNumbers, choose
from irtwin.simulator.fit import unjudged
from irtwin.simulator.model import Model
from irtwin.simulator.play import PlayedStretch, Push, each, play
from irtwin.simulator.push import FoundPush, find_pushes
from irtwin.simulator.refined import limited, softened
from irtwin.simulator.servos import NAMES, SOFT, Servos, part_of, servos
from irtwin.simulator.tracking import held_out, parts, restarted, tracked
from irtwin.simulator.trusted import NOTHING, Trusted

_STRETCHES, _LASTS = 16, 15.0  # of all runs that numbers are fitted to; s, of each
_FALLEN, _BRIEF = 0.3, 2.0  # rad (m), RMS from the model, of a robot that falls; s, of its stretches
_LEAST = 3  # stretches of a run that is alone: to fit and to judge by
_STEP = 0.005  # s, of a joint played by itself
_AGREES = 0.03  # share of a joint's torque that is no gap
_CLIPPED = 0.05  # of a joint's commands: with more, what it does is the clipping's


@dataclass(frozen=True)
class Playing:
    """A diagnosis by playing: its document, what a page draws, and the robot's numbers.

    `in_file`: those that come nearest in the model's file, which has no place for a soft joint.
    """

    document: Document
    curves: Curves
    chosen: DifferingNumbers
    in_file: DifferingNumbers
    against: str = "simulated"  # the role of what the observed runs are held against
    twin: None = None  # positions alone make none

    @property
    def is_open(self) -> bool:
        """Whether no number differs, and yet the torque, if it was logged, has more than noise beside the model's."""
        named = any(finding.matters for finding in self.document.findings)
        return not named and bool((self.chosen.torque_left > _AGREES).any())

    def written(self) -> bytes:
        """Return the model's file with the robot's numbers."""
        return self.in_file.fit.servos.written(self.in_file.numbers, self.in_file.differs)

    @property
    def unwritten(self) -> list[str]:
        """Which of the robot's numbers that file has no place for."""
        return self.chosen.fit.servos.unwritten(self.chosen.differs)

    def drawn(self, rng: np.random.Generator) -> bytes:
        """Return the model's file with the robot's numbers as they could be."""
        return self.in_file.fit.servos.written(self.in_file.drawn(rng), self.in_file.differs)


def diagnose(data_set: DataSet, model: Model, trust: Trusted = NOTHING, held_out_runs: Collection[str] = ()) -> Playing:
    """Hold a model against the observed runs by playing their commands, and its servos' torque against what was logged.

    What it is to `trust` differs in no number. Runs that are held out, by name, judge numbers that all others say;
    without any, each run judges those of others.

    Raises InputError where `commanded_runs` does, or the model has no position servos, or clips commands, or no run has
    a name that is held out, or all have.
    """
    runs = commanded_runs(data_set)
    apart = _apart(runs, held_out_runs)
    if any(run.signals.torque is None for run in runs):
        runs = [replace(run, signals=replace(run.signals, torque=None)) for run in runs]
    own = replace(servos(model), trusted=trust.numbers)
    clipped = clipping(own, runs)
    tell("Fitting numbers of servos")
    fitted, judged = (
        [run for run in runs if run.name not in apart],
        [run for run in runs if run.name in apart or not apart],
    )
    lasts = _BRIEF if _falls(own, _stretches(fitted, _LASTS)) else _LASTS
    stretches = _stretches(fitted, lasts)
    step = max(_STEP, model.compiled.opt.timestep)
    rigid, pushes = _chosen(own, stretches, step, trust.pushes)
    chosen = softened(rigid)
    tell("Playing the runs that are held out" if apart else "Playing all runs")
    names = [run.name for run in judged]
    numbers = dict.fromkeys(names, chosen.numbers) if apart else held_out(chosen, runs)
    as_it_is = dict.fromkeys(names, own.numbers)
    before = tracked(data_set.robot, own, judged, as_it_is)
    after = tracked(data_set.robot, own, judged, numbers, _of(pushes))
    differing = list(dict.fromkeys(part_of(name) for row, name in enumerate(NAMES) if chosen.differs[row].any()))
    named = {f"{writing.PUSH} {place}": found_push for place, found_push in enumerate(pushes)}
    families = writing.families([*differing, *named])
    judging = _stretches(judged, lasts) if apart else chosen.fit.stretches
    closed = parts(own, judging, numbers, families, {name: found_push.push for name, found_push in named.items()})
    anew = restarted(own, judged, as_it_is), restarted(own, judged, numbers, _of(pushes))
    horizons = [(seconds, error, anew[1][seconds]) for seconds, error in anew[0].items()]
    return Playing(
        replace(
            writing.document(data_set.robot, model.name, names, chosen, named, closed, before, after, horizons),
            mended="\n".join([*clipped, *data_set.repairs]) or None,
        ),
        writing.curves(data_set.robot, names, before, after),
        chosen,
        limited(rigid) if chosen.differs[list(SOFT)].any() else chosen,
    )


def _apart(runs: Sequence[Run], names: Collection[str]) -> set[str]:
    """Return the names of runs that are held out, with all pieces of those with holes. Raises InputError."""
    pieces = {name: {run.name for run in runs if name in (run.name, run.file.stem)} for name in names}
    apart = set[str]().union(*pieces.values())
    for name, own in pieces.items():
        if not own:
            raise InputError(f'no observed run is named "{name}"; there are {", ".join(run.name for run in runs)}')
    if len(apart) == len(runs):
        raise InputError("all runs are held out; leave some to fit to")
    return apart


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
    """Return whether the robot ends far from its model: too far for slopes to say which number does that.

    Raises InputError where the model is unstable.
    """
    moved = play(own, [own.numbers], stretches, strict=True)[0]
    left = [stretch.q - played[:, 0] for stretch, played in zip(stretches, moved, strict=True)]
    return bool(max(np.sqrt((remainder**2).mean(axis=0)).max() for remainder in left) > _FALLEN)


def clipping(own: Servos, runs: Sequence[Run]) -> list[str]:
    """Say and return of which joints the model clips commands. Raises InputError where it clips more than a few."""
    shares = own.clipped(np.concatenate([run.signals.command for run in runs if run.signals.command is not None]))
    lines = []
    for joint, share in shares.items():
        line = f"{joint}: {100 * share:.3g} % of its commands are beyond the model's ctrlrange, which clips them"
        if share > _CLIPPED:
            raise InputError(f"{own.model.file.path}: {line}; correct ctrlrange, or zero and unit of the commands")
        tell(f"  {line}")
        lines.append(line)
    return lines


def commanded_runs(data_set: DataSet) -> list[Run]:
    """Return the observed runs, whose commands can be played.

    Raises InputError where there are none, one has no commands, or these have faults.
    """
    runs = [run for run in data_set.runs if run.role == "observed"]
    if not runs:
        raise InputError(f"{data_set.folder}: no run is observed; there is nothing to hold the model against")
    for run in runs:
        if run.signals.command is None:
            raise InputError(f"{run.file}: has no commands to play; log cmd_JOINT, or leave the run out")
    for fault in faults(data_set.robot, runs):
        raise InputError(fault.say)
    return runs

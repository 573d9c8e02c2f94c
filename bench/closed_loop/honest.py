"""`python -m closed_loop.honest MODELS FOLDER [CASE...]`: what a twin that knows all leaves of the logs, beside noise.

Masses, friction and effects are the true ones, states those that a diagnosis makes of the log. While joints move, hard
friction leaves the noise in the filter's band, and up to three times that near pauses, whose steps the filter smears;
soft friction, which turns with speed and acceleration, leaves up to six times. With true states nothing is left:
`closed_loop.cases` makes no case otherwise.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import Any

import numpy as np

from closed_loop.cases import SEEDS, Case, Plan, plans
from closed_loop.effects import Effect, sensed
from closed_loop.simulation import Trace, torque_of
from irtwin.gap.data.case import case_of
from irtwin.gap.thresholds import DEFAULT
from irtwin.signals.filter import low_pass
from irtwin.signals.log import read_data_set

SLOW = 0.03  # rad/s, below which dry friction turns
ENDS = 20  # samples that the filter cannot know


def effects_of(label: dict[str, Any], joints: tuple[str, ...], runs: int) -> tuple[Effect, ...]:
    """Return the effects that a label tells of."""
    return tuple(
        Effect(
            one["effect"],
            tuple(joints.index(joint) for joint in one["joints"]) or (0,),
            np.array([f"run_{run:02d}" in one["runs"] for run in range(runs)]),
            one["strength"],
            np.inf,
            {key: np.asarray(value) for key, value in one["shape"].items()},
        )
        for one in label["effects"]
    )


def left(plan: Plan, models: Path, folder: Path, label: dict[str, Any]) -> tuple[np.ndarray, np.ndarray]:
    """Return the RMS of what is left while a joint moves, and of noise in the band, (n,) N m each."""
    case = Case(plan, models)
    machine = case.machine
    data_set = read_data_set(folder / plan.name)
    motions = case_of(data_set, (), DEFAULT).motions
    effects = effects_of(label, machine.model.joints, len(case.programmes))
    stride = round(machine.interval / machine.step)
    parts, share = [], 1.0
    for number, run in enumerate(data_set.runs):
        motion = motions[run.name]
        assert motion.torque is not None and motion.cutoff is not None
        states = Trace(motion.q, motion.dq, motion.ddq, motion.torque, case.around[number].warmth[::stride])
        taken = torque_of(machine, states, effects, number, case.around[number].friction, machine.interval)
        said = sensed(effects, taken, machine.interval, number) + machine.sensors.offset
        rest = motion.torque - low_pass(said, motion.rate, motion.cutoff)
        share = min(1.0, motion.cutoff / (motion.rate / 2))
        parts.append(np.where(np.abs(motion.dq) > SLOW, rest, np.nan)[ENDS:-ENDS])
    return np.sqrt(np.nanmean(np.concatenate(parts) ** 2, axis=0)), machine.sensors.torque * np.sqrt(share)


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m closed_loop.honest", description=__doc__)
    parser.add_argument("models", type=Path)
    parser.add_argument("folder", type=Path)
    parser.add_argument("cases", nargs="*")
    parser.add_argument("--split", choices=sorted(SEEDS), default="development")
    parser.add_argument("--count", type=int, default=24, help="as the cases were made")
    arguments = parser.parse_args()
    file = arguments.folder.with_name(arguments.folder.name + "_labels") / "labels.json"
    labels = json.loads(file.read_text(encoding="utf-8"))
    for plan in plans(arguments.split, arguments.count):
        if plan.name in labels and plan.name in (arguments.cases or labels):
            rest, noise = left(plan, arguments.models, arguments.folder, labels[plan.name])
            friction = "hard" if labels[plan.name]["hard"] else "soft"
            print(plan.name, friction, "left over noise:", *(f"{one:.2f}" for one in rest / noise), flush=True)


if __name__ == "__main__":
    main()

"""How twins do on measured robots: `python bench/measured.py DATASET...` prints a page (Markdown).

Each data set is split as `irtwin run` splits it; what is judged took no part in the fit.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

import numpy as np

from irtwin.effects.catalogue import BASELINE
from irtwin.identification.validation import split
from irtwin.signals.conditioning import choose_cutoff, condition
from irtwin.signals.log import DataSet, read_data_set
from irtwin.signals.motion import Motion
from irtwin.twin.identify import identify
from irtwin.twin.twin import Parameter
from irtwin.twin.validate import RunFit, validate


def page(folder: Path) -> str:
    """Return the section of one data set."""
    data_set = read_data_set(folder)
    robot = data_set.robot
    cutoff = choose_cutoff(data_set.runs)
    motions = [condition(run, robot, cutoff) for run in data_set.runs]
    parts = split(motions, {run.name: run.repeat_of for run in data_set.runs if run.repeat_of})
    began = time.perf_counter()
    twin = identify(robot, parts.fit, data_set.effects or BASELINE)
    seconds = time.perf_counter() - began
    lines = [
        f"## {robot.name}",
        "",
        f"{parts.rule}; cutoff {cutoff:.1f} Hz; condition number {twin.condition_number or float('nan'):.1f}; "
        f"identified in {seconds:.1f} s.",
        "",
        "| held out | " + " | ".join(robot.joint_names) + " | power RMSE, W | energy error, % |",
        "| --- " * (len(robot.joints) + 3) + "|",
    ]
    for fit in validate(twin, parts.held_out):
        lines += _rows(fit, len(robot.joints))
    viscous = {parameter.joint: parameter for parameter in twin.parameters if parameter.effect == "viscous_friction"}
    lines.append("| Fv, N m s/rad | " + " | ".join(_value(viscous[name]) for name in robot.joint_names) + " | | |")
    lines += _left_out_in_turn(data_set, motions)
    return "\n".join(lines) + "\n"


def _left_out_in_turn(data_set: DataSet, motions: list[Motion]) -> list[str]:
    """Return the energy error of every run by a twin that saw neither it nor a repeat of it."""
    if any(motion.power is None for motion in motions):
        return []
    first = {run.name: run.repeat_of or run.name for run in data_set.runs}
    errors = {}
    for group in dict.fromkeys(first.values()):
        others = [motion for motion in motions if first[motion.run] != group]
        if others:
            twin = identify(data_set.robot, others, data_set.effects or BASELINE)
            left_out = [motion for motion in motions if first[motion.run] == group]
            errors |= {fit.run: fit.energy_error for fit in validate(twin, left_out) if fit.energy_error is not None}
    if not errors:
        return []
    worst = max(errors, key=lambda run: errors[run])
    mean = np.mean([*errors.values()])
    return [
        "",
        f"Each programmed motion left out in turn, {len(errors)} runs: energy error {mean:.2f} % "
        f"in the mean, {errors[worst]:.2f} % at worst ({worst}); the seed paper reached 6.54 %.",
    ]


def _rows(fit: RunFit, joints: int) -> list[str]:
    r_squared = np.full(joints, np.nan) if fit.r_squared is None else fit.r_squared
    rmse = np.full(joints, np.nan) if fit.torque_rmse is None else fit.torque_rmse
    power = "-" if fit.power_rmse is None else f"{fit.power_rmse:.2f}"
    energy = "-" if fit.energy_error is None else f"{fit.energy_error:.2f}"
    return [
        f"| {fit.run}: R² | " + " | ".join(f"{value:.3f}" for value in r_squared) + f" | {power} | {energy} |",
        f"| {fit.run}: RMSE, N m | " + " | ".join(f"{value:.2f}" for value in rmse) + " | | |",
    ]


def _value(parameter: Parameter) -> str:
    if parameter.lower is None:
        return f"{parameter.value:.2f} (not decided)"
    return f"{parameter.value:.2f} ({parameter.lower:.2f} ... {parameter.upper:.2f})"


if __name__ == "__main__":
    for argument in sys.argv[1:]:
        print(page(Path(argument)))

"""`python -m energy_twin.savings [--seeds N...] [--only WORD]`: savings that are said, and those when it is executed.

Runs that took no part in the fit are timed anew, in a quarter more time and with pauses that may shrink.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from scipy.interpolate import CubicSpline

from energy_twin.cases import STEP, Case, cases
from irtwin.demo.plant.motion import PlantMotion as Programmed
from irtwin.errors import InputError
from irtwin.gap.choice import identified
from irtwin.identification.cutoff import cutoff_for
from irtwin.identification.validation import split
from irtwin.planning.cycle import CycleTimes
from irtwin.planning.programme import programme_of
from irtwin.signals.conditioning import condition
from irtwin.signals.motion import Motion, standstill, stretches
from irtwin.twin.price import Figure, with_standing

LONGER, PAUSE = 1.25, 0.1


def savings(case: Case) -> Iterator[tuple[str, Figure, float, float]]:
    """Yield each held-out run with moves from rest to rest: its saving as said and as executed, and its energy, J."""
    robot = case.data_set.robot
    cutoff = cutoff_for(robot, case.data_set.runs, None).hz
    parts = split([condition(run, robot, cutoff) for run in case.data_set.runs])
    fitted = {motion.run for motion in parts.fit}
    runs = tuple(run for run in case.data_set.runs if run.name in fitted)
    twin = identified(replace(case.data_set, runs=runs, cutoff=cutoff), parts.fit)
    for motion in parts.held_out:
        try:
            programme = programme_of(motion, case.name)
        except InputError:
            continue
        cycle = LONGER * float(programme.seconds.sum())
        new = CycleTimes(twin, programme, PAUSE).in_time(cycle)
        before, after = (_energy(case, one) for one in (with_standing(motion, cycle), new.motion))
        yield motion.run, new.saved, before - after, before


def _energy(case: Case, motion: Motion) -> float:
    """Return what a motion takes on the plant, J: told to stand where it stood."""
    q = motion.q.copy()
    for own in stretches(standstill(motion)):
        q[own] = q[own].mean(axis=0)
    law = CubicSpline(motion.time - motion.time[0], q)
    time = np.arange(0.0, law.x[-1], STEP)
    return float(np.trapezoid(case.plant(Programmed(*(law(time, order) for order in range(3)))), dx=STEP))


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m energy_twin.savings", description=__doc__)
    parser.add_argument("--seeds", type=int, nargs="+", default=[0])
    parser.add_argument("--only", default="", help="cases whose name has this word")
    arguments = parser.parse_args()
    print("| case | run | takes, J | saves: said | executed |\n| --- | --- | --- | --- | --- |")
    held = []
    for case in cases(arguments.seeds, arguments.only):
        for run, said, executed, taken in savings(case):
            held.append(said.half_width is not None and abs(said.value - executed) <= said.half_width)
            print(f"| {case.name} | {run} | {taken:.0f} | {said} | {executed:.1f} |", flush=True)
    print(f"\n{sum(held)} of {len(held)} within the interval")


if __name__ == "__main__":
    main()

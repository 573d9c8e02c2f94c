"""`python -m energy_twin.savings [--seeds N...] [--only WORD] [--base | --payload]`: savings said, and as executed.

Runs that took no part in the fit are timed anew, in a quarter more time and with pauses that may shrink; or, by
`--base`, the flange goes the same way with the robot's base elsewhere; by `--payload`, the same way with 2 kg for 3.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np
from scipy.interpolate import CubicSpline

from energy_twin.cases import STEP, Case, cases
from irtwin.demo.plant.arm import PlantPayload
from irtwin.demo.plant.motion import PlantMotion as Programmed
from irtwin.errors import InputError
from irtwin.gap.choice import identified
from irtwin.identification.cutoff import cutoff_for
from irtwin.identification.validation import split
from irtwin.planning.cycle import CycleTimes
from irtwin.planning.placement import better_placement
from irtwin.planning.programme import programme_of
from irtwin.signals.conditioning import condition
from irtwin.signals.motion import Motion, standstill, stretches
from irtwin.twin.price import Figure, kilogram_less, with_standing
from irtwin.twin.twin import Twin

LONGER, PAUSE = 1.25, 0.1

# a saving as it is said, the motion without it, and with it
Proposal = tuple[Figure, Motion, Motion]


def savings(
    case: Case, propose: Callable[[Twin, Motion], Proposal | None]
) -> Iterator[tuple[str, Figure, float, float]]:
    """Yield each held-out run that something is proposed for: its saving as said and as executed, and its energy, J."""
    robot = case.data_set.robot
    cutoff = cutoff_for(robot, case.data_set.runs, None).hz
    parts = split([condition(run, robot, cutoff) for run in case.data_set.runs])
    fitted = {motion.run for motion in parts.fit}
    runs = tuple(run for run in case.data_set.runs if run.name in fitted)
    twin = identified(replace(case.data_set, runs=runs, cutoff=cutoff), parts.fit)
    for motion in parts.held_out:
        if (proposal := propose(twin, motion)) is None:
            continue
        saved, without, with_it = proposal
        same_day = without.payload_mass != with_it.payload_mass
        before, after = (_energy(case, one, day) for one, day in ((without, 0), (with_it, 0 if same_day else 1)))
        yield motion.run, saved, before - after, before


def timed_anew(twin: Twin, motion: Motion) -> Proposal | None:
    """Return what other times of a programme's moves save; None where the motion has none from rest to rest."""
    try:
        programme = programme_of(motion, motion.run)
    except InputError:
        return None
    cycle = LONGER * float(programme.seconds.sum())
    new = CycleTimes(twin, programme, PAUSE).in_time(cycle)
    return new.saved, with_standing(motion, cycle), new.motion


def moved_base(twin: Twin, motion: Motion) -> Proposal | None:
    """Return what a better place of the base saves; None where there is none."""
    placed = better_placement(twin, motion)
    return None if placed is None else (placed.saved, motion, placed.motion)


def lightened(twin: Twin, motion: Motion) -> Proposal:
    """Return what 2 kg at the flange save in place of 3."""
    heavy, light = (replace(motion, payload_mass=mass, payload_com=(0.0, 0.0, 0.05)) for mass in (3.0, 2.0))
    return kilogram_less(twin, heavy), heavy, light


def _energy(case: Case, motion: Motion, day: int) -> float:
    """Return what a motion takes on the plant, J, by a day's friction: told to stand where it stood."""
    q = motion.q.copy()
    for own in stretches(standstill(motion)):
        q[own] = q[own].mean(axis=0)
    law = CubicSpline(motion.time - motion.time[0], q)
    time = np.arange(0.0, law.x[-1], STEP)
    programmed = Programmed(*(law(time, order) for order in range(3)))
    payload = PlantPayload(motion.payload_mass, motion.payload_com)
    return float(np.trapezoid(case.plant(programmed, payload, np.random.default_rng(day)), dx=STEP))


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m energy_twin.savings", description=__doc__)
    parser.add_argument("--seeds", type=int, nargs="+", default=[0])
    parser.add_argument("--only", default="", help="cases whose name has this word")
    parser.add_argument("--base", action="store_true", help="the base elsewhere, in place of other times")
    parser.add_argument("--payload", action="store_true", help="a kilogram less, in place of other times")
    arguments = parser.parse_args()
    propose = moved_base if arguments.base else lightened if arguments.payload else timed_anew
    print("| case | run | takes, J | saves: said | executed |\n| --- | --- | --- | --- | --- |")
    held = []
    for case in cases(arguments.seeds, arguments.only):
        for run, said, executed, taken in savings(case, propose):
            held.append(said.half_width is not None and abs(said.value - executed) <= said.half_width)
            print(f"| {case.name} | {run} | {taken:.0f} | {said} | {executed:.1f} |", flush=True)
    print(f"\n{sum(held)} of {len(held)} within the interval")


if __name__ == "__main__":
    main()

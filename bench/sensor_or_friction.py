"""`python sensor_or_friction.py CASE...`: a constant torque put into healthy runs, real or in the sensor alone.

A case is a data set with reference runs. Each joint in turn gets a torque of three noise floors in the observed runs:
real, it costs power, and is friction that differs by direction; else it is an offset of the sensor. Told apart: the
first cause is the right one, and the other is not in its ambiguity group. Without power both have to be in it.
"""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path

import numpy as np

from irtwin.gap.data.case import case_of
from irtwin.gap.data.noise_floor import noise_floor
from irtwin.gap.diagnosis import diagnose
from irtwin.gap.thresholds import DEFAULT
from irtwin.signals.log import DataSet, Run, read_data_set

FLOORS = 3.0
SLOW = 0.03  # rad/s: below, friction has not its full size
REAL, SHOWN = "asymmetric_friction", "torque_offset"


def put_in(run: Run, data_set: DataSet, joint: int, size: float, *, real: bool, power: bool) -> Run:
    """Return an observed run with a constant torque more, N m; without power unless that is asked for."""
    signals = run.signals
    assert signals.torque is not None and signals.power is not None
    taken = signals.power
    if run.role == "observed":
        speed = np.gradient(signals.q[:, joint], signals.time)
        more = size * np.tanh(np.abs(speed) / SLOW) if real else np.full(len(speed), size)
        if real:
            drive = data_set.robot.joints[joint]
            ohms = drive.winding_resistance or 0.0 if "copper_loss" in (data_set.effects or ()) else 0.0
            loss = ohms / (drive.torque_constant or 1.0) ** 2
            taken = taken + more * speed + loss * (2 * signals.torque[:, joint] * more + more**2)
        torque = signals.torque.copy()
        torque[:, joint] += more
        signals = replace(signals, torque=torque)
    return replace(run, signals=replace(signals, power=taken if power else None))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("cases", type=Path, nargs="+")
    right = {True: [], False: []}  # type: dict[bool, list[bool]]
    for place in parser.parse_args().cases:
        data_set = read_data_set(place)
        motions = case_of(data_set, (), DEFAULT).motions
        floor = noise_floor(data_set.runs, motions, DEFAULT.data).torque
        assert floor is not None, f"{place}: no torque"
        for joint, name in enumerate(data_set.robot.joint_names):
            for power in (True, False):
                for real in (True, False):
                    size = FLOORS * float(floor[joint])
                    runs = [put_in(run, data_set, joint, size, real=real, power=power) for run in data_set.runs]
                    diagnosis = diagnose(replace(data_set, runs=tuple(runs)))
                    first = diagnosis.causes[0][1] if diagnosis.causes else None
                    named = {first.effect, *first.rivals} if first else set()
                    true, other = (REAL, SHOWN) if real else (SHOWN, REAL)
                    told = first is not None and first.effect == true and other not in named
                    right[power].append(told if power else {true, other} <= named)
                    how = f"{'real' if real else 'shown'}, {'with' if power else 'without'} power"
                    print(place.name, name, f"{size:.3g} N m {how}:", diagnosis.verdict, *sorted(named), flush=True)
    for power, answers in right.items():
        what = "told apart" if power else "ambiguous without power"
        print(f"{what}: {sum(answers)} of {len(answers)}")


if __name__ == "__main__":
    main()

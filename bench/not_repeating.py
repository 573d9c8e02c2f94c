"""Disturbances that do not repeat, put into healthy robots: `python bench/not_repeating.py CASES... [--diagnose N]`.

CASES are folders of healthy blind cases (`blind.cases`, kinds `clean_null` and `dirty_null`). Into two to four runs of
each, repeats among them, one disturbance is put: a torque that swings, a load that switches on the supply, a drift, an
offset of one run. Printed: how many are located, by kind, and what is found where nothing was put. `--diagnose` runs so
many whole diagnoses of the same cases, and prints their verdicts.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from irtwin.gap.data.case import case_of
from irtwin.gap.data.noise_floor import sensor_noise
from irtwin.gap.diagnosis import diagnose
from irtwin.gap.repeats.disturbances import BAND, DRIFT, LINE, OFFSET, SWITCHING, Disturbance, disturbances
from irtwin.gap.thresholds import DEFAULT
from irtwin.signals.log import DataSet, Run, read_data_set

FREQUENCIES = (0.5, 0.8, 1.3, 2.0, 2.9, 4.7, 8.0, 13.0, 20.0, 30.0)  # Hz
AMPLITUDES = (10.0, 60.0)  # times the sensor's noise
DUTIES = (0.1, 0.3, 0.5, 0.8)
PERIODS = (1.5, 3.0)  # s
KINDS = (LINE, SWITCHING, DRIFT, OFFSET)


@dataclass(frozen=True)
class Put:
    """A disturbance that was put into a data set."""

    kind: str
    joint: str | None
    frequency: float = 0.0  # Hz
    size: float = 0.0  # N m, N m/s or W

    def located(self, found: Sequence[Disturbance]) -> bool:
        """Return whether it is among those found, at its joint and of its kind."""
        kinds = {LINE: (LINE, BAND)}.get(self.kind, (self.kind,))
        return any(
            one.joint == self.joint
            and one.kind in kinds
            and (self.kind != LINE or abs(one.quantities[0].value - self.frequency) < 0.1)
            for one in found
        )

    def __str__(self) -> str:
        return f"{self.kind} {self.joint or 'power'} f={self.frequency:.3g} size={self.size:.3g}"


def few(data_set: DataSet, rng: np.random.Generator) -> DataSet:
    """Return two to four observed runs of a data set, at least one a repeat of another."""
    runs = [run for run in data_set.runs if run.role == "observed"]
    repeats = [run for run in runs if run.repeat_of]
    chosen = [repeats[int(rng.integers(len(repeats)))]]
    if rng.random() < 0.5 and len(repeats) > 1:
        chosen.append(next(run for run in repeats if run is not chosen[0]))
    names = {name for run in chosen for name in (run.name, run.repeat_of)}
    if len(names) < 4 and rng.random() < 0.5:
        names.add(next(run.name for run in runs if run.name not in names))
    return replace(data_set, runs=tuple(run for run in runs if run.name in names))


def disturbed(data_set: DataSet, number: int, rng: np.random.Generator) -> tuple[DataSet, Put]:
    """Return the data set with a disturbance, of a kind by its number."""
    case = case_of(data_set, (), DEFAULT)
    torque, power = sensor_noise(data_set.runs, case.motions, DEFAULT.repeats)
    assert torque is not None and power is not None
    names = data_set.robot.joint_names
    joint, times = int(rng.integers(len(names))), float(rng.choice(AMPLITUDES))
    kind, turn = KINDS[number % len(KINDS)], number // len(KINDS)
    if kind == LINE:
        frequency = FREQUENCIES[turn % len(FREQUENCIES)]
        put = Put(kind, names[joint], frequency, times * float(torque[joint]))
        return _with(data_set, lambda run: put.size * np.sin(
            2 * np.pi * frequency * run.signals.time + rng.uniform(0, 2 * np.pi)), joint), put  # fmt: skip
    if kind == SWITCHING:
        duty, period = DUTIES[turn % len(DUTIES)], float(rng.choice(PERIODS))
        put = Put(kind, None, 1 / period, times * float(power[0]))
        return _with(data_set, lambda run: put.size * (
            (run.signals.time / period + rng.random()) % 1 < duty), None), put  # fmt: skip
    if kind == DRIFT:
        put = Put(kind, names[joint], 0.0, times * float(torque[joint]) / 8.0)
        return _with(data_set, lambda run: put.size * _either(rng) * (run.signals.time - run.signals.time[0]),
                     joint), put  # fmt: skip
    put = Put(kind, names[joint], 0.0, times * float(torque[joint]))
    return _with(data_set, lambda run: put.size * _either(rng) + 0 * run.signals.time, joint), put


def _either(rng: np.random.Generator) -> float:
    """Return -1 to -0.5 or 0.5 to 1."""
    return float(rng.choice([-1.0, 1.0]) * rng.uniform(0.5, 1.0))


def _with(data_set: DataSet, added, joint: int | None) -> DataSet:  # type: ignore[no-untyped-def]
    runs = []
    for run in data_set.runs:
        signals: Run = run.signals
        more = added(run)
        if joint is None:
            signals = replace(signals, power=signals.power + more)
        else:
            torque = signals.torque.copy()
            torque[:, joint] += more
            signals = replace(signals, torque=torque)
        runs.append(replace(run, signals=signals))
    return replace(data_set, runs=tuple(runs))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("cases", type=Path, nargs="+")
    parser.add_argument("--put", type=int, default=40, help="disturbances to put")
    parser.add_argument("--diagnose", type=int, default=0, help="of these, whole diagnoses")
    parser.add_argument("--seed", type=int, default=0)
    arguments = parser.parse_args()
    folders = sorted(arguments.cases)
    located: dict[str, list[bool]] = {kind: [] for kind in KINDS}
    for number in range(arguments.put):
        rng = np.random.default_rng([arguments.seed, number])
        data_set, put = disturbed(few(read_data_set(folders[number % len(folders)]), rng), number, rng)
        started = time.process_time()
        found = disturbances(case_of(data_set, (), DEFAULT))
        located[put.kind].append(put.located(found))
        said = f"located, {len(found)} found" if located[put.kind][-1] else f"MISSED: {[_said(one) for one in found]}"
        print(f"{number} {len(data_set.runs)} runs, {put}: {said}, {time.process_time() - started:.2f} s", flush=True)
        if number < arguments.diagnose:
            print(f"   {diagnose(data_set).verdict}", flush=True)
    for kind, hits in located.items():
        print(f"{kind}: {sum(hits)} of {len(hits)} located")
    false = 0
    for number, folder in enumerate(folders):
        data_set = read_data_set(folder)
        for part in (data_set, few(data_set, np.random.default_rng([arguments.seed, 999, number]))):
            found = disturbances(case_of(part, (), DEFAULT))
            false += bool(found)
            if found:
                print(f"{folder.name}, {len(part.runs)} runs, nothing put: {[_said(one) for one in found]}")
    print(f"nothing put: {false} of {2 * len(folders)} false")


def _said(one: Disturbance) -> str:
    return f"{one.kind} {one.joint or 'power'} " + ", ".join(f"{q.name}={q.value:.3g}" for q in one.quantities)


if __name__ == "__main__":
    main()

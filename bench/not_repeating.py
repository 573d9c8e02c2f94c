"""Disturbances that do not repeat, put into healthy robots: `python bench/not_repeating.py CASES... [--diagnose N]`.

CASES are folders of healthy blind cases (`blind.cases`, kinds `clean_null` and `dirty_null`). Into two to four runs of
each, repeats among them, one disturbance is put: a torque that swings, a load that switches on the supply, a drift, an
offset of one run, or windings that warm (copper loss that rises as each run begins). Printed, by kind: how many are
located; of these, how many are described right (`TOLERANCES`, or by an interval that holds the truth and not zero); and
how many are told as another kind. Then what is found where nothing was put. `--diagnose` runs so many whole diagnoses
of the same cases, and prints their verdicts.
"""

from __future__ import annotations

import argparse
import time
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import cycle
from pathlib import Path

import numpy as np

from irtwin.effects.effect import Quantity
from irtwin.gap.data.case import Case, case_of
from irtwin.gap.data.noise_floor import sensor_noise
from irtwin.gap.diagnosis import diagnose
from irtwin.gap.regression.channel_equations import torque_system
from irtwin.gap.repeats.disturbances import BAND, DRIFT, LINE, OFFSET, SWITCHING, Disturbance, disturbances
from irtwin.gap.repeats.removal import removed
from irtwin.gap.thresholds import DEFAULT
from irtwin.signals.log import DataSet, Run, read_data_set

FREQUENCIES = (0.5, 0.8, 1.3, 2.0, 2.9, 4.7, 8.0, 13.0, 20.0, 30.0)  # Hz
AMPLITUDES = (10.0, 60.0)  # times the sensor's noise
DUTIES = (0.1, 0.3, 0.5, 0.8)
PERIODS = (1.5, 3.0)  # s
LOSSES = (10.0, 60.0)  # times the noise of power: the rise of the copper loss, RMS over the motion
CONSTANTS = (2.0, 5.0, 10.0, 20.0)  # s, in which a winding warms
WARMING = "warming"
KINDS = (LINE, SWITCHING, DRIFT, OFFSET)
TOLD_AS = {LINE: (LINE, BAND), WARMING: (DRIFT, OFFSET)}
TOLERANCES = {"f": 0.02, "A": 0.2, "P": 0.2, "period": 0.1, "duty": 0.1, "drift": 0.2, "offset": 0.2}
"""Shares of what is true, or of the whole time for the duty."""


@dataclass(frozen=True)
class Put:
    """A disturbance that was put into a data set, with the values that its quantities may be said to have."""

    kind: str
    joint: str | None
    truth: Mapping[str, Sequence[float]] = field(default_factory=dict)

    def located(self, found: Sequence[Disturbance]) -> Disturbance | None:
        """Return it among those found: at its joint, of its kind, at its frequency."""
        for one in found:
            near = self.kind != LINE or abs(one.quantities[0].value - self.truth["f"][0]) < 0.1
            if one.joint == self.joint and one.kind in TOLD_AS.get(self.kind, (self.kind,)) and near:
                return one
        return None

    def wrong(self, one: Disturbance) -> list[str]:
        """Return the names of the quantities that it is described by wrongly, or not at all."""
        said = {quantity.name: quantity for quantity in one.quantities}
        return [name for name, true in self.truth.items() if not any(_right(said.get(name), value) for value in true)]

    def __str__(self) -> str:
        return f"{self.kind} {self.joint or 'power'} " + _numbers({name: some[0] for name, some in self.truth.items()})


def _right(said: Quantity | None, true: float) -> bool:
    if said is None:
        return False
    if abs(said.value - true) <= TOLERANCES[said.name] * (1.0 if said.name == "duty" else abs(true)):
        return True
    if said.lower is None or said.upper is None or said.name == "period":  # its ends are the shortest and the longest
        return False
    return said.lower <= true <= said.upper and (said.lower > 0 or said.upper < 0)


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


def disturbed(data_set: DataSet, kind: str, turn: int, rng: np.random.Generator) -> tuple[DataSet, Put]:
    """Return the data set with a disturbance of a kind, the `turn`-th of it."""
    case = case_of(data_set, (), DEFAULT)
    torque, power = sensor_noise(data_set.runs, case.motions, DEFAULT.data)
    assert torque is not None and power is not None
    names = data_set.robot.joint_names
    joint, times = int(rng.integers(len(names))), float(rng.choice(AMPLITUDES))
    name, size = names[joint], times * float(torque[joint])
    if kind == LINE:
        frequency = FREQUENCIES[turn % len(FREQUENCIES)]
        made = _with(data_set, lambda run: size * np.sin(
            2 * np.pi * frequency * run.signals.time + rng.uniform(0, 2 * np.pi)), joint)  # fmt: skip
        return made, Put(kind, name, {"f": [frequency], "A": [size]})
    if kind == SWITCHING:
        return _switched(data_set, times * float(power[0]), DUTIES[turn % len(DUTIES)], rng)
    if kind == WARMING:
        return _warmed(data_set, float(rng.choice(LOSSES) * power[0]), CONSTANTS[turn % len(CONSTANTS)], rng)
    if kind == DRIFT:
        slopes = {run.name: size / 8.0 * _either(rng) for run in data_set.runs}
        made = _with(data_set, lambda run: slopes[run.name] * (run.signals.time - run.signals.time[0]), joint)
        return made, Put(kind, name, {DRIFT: [*_apart(data_set, slopes), *slopes.values()]})
    offsets = {run.name: size * _either(rng) for run in data_set.runs}
    made = _with(data_set, lambda run: offsets[run.name] + 0 * run.signals.time, joint)
    return made, Put(kind, name, {OFFSET: _apart(data_set, offsets)})


def _switched(data_set: DataSet, size: float, duty: float, rng: np.random.Generator) -> tuple[DataSet, Put]:
    period, shares = float(rng.choice(PERIODS)), []

    def added(run: Run) -> np.ndarray:
        on = (run.signals.time / period + rng.random()) % 1 < duty
        shares.append(float(np.mean(on)))
        return size * on

    made = _with(data_set, added, None)
    return made, Put(SWITCHING, None, {"P": [size], "duty": [float(np.mean(shares))], "period": [period]})


def _warmed(data_set: DataSet, size: float, constant: float, rng: np.random.Generator) -> tuple[DataSet, Put]:
    """Return the data set with a copper loss that rises as each run goes on: from cold, from warm, in turn."""
    joints = data_set.robot.joints
    per_torque = np.array([joint.winding_resistance / joint.torque_constant**2 for joint in joints])  # type: ignore[operator]

    colds = (rng.uniform(*ends) for ends in cycle(((0.7, 1.0), (0.0, 0.3))))

    def added(run: Run) -> np.ndarray:
        loss = np.asarray(run.signals.torque**2 @ per_torque)
        since, cold = run.signals.time - run.signals.time[0], next(colds)
        return np.asarray(size * loss / np.sqrt(np.mean(loss**2)) * (1 - cold * np.exp(-since / constant)))

    return _with(data_set, added, None), Put(WARMING, None)


def _apart(data_set: DataSet, values: Mapping[str, float]) -> list[float]:
    """Return what the repeats differ by."""
    pairs = [(one, other) for one in data_set.runs for other in data_set.runs if other.repeat_of == one.name]
    return [values[one.name] - values[other.name] for one, other in pairs]


def _either(rng: np.random.Generator) -> float:
    """Return -1 to -0.5 or 0.5 to 1."""
    return float(rng.choice([-1.0, 1.0]) * rng.uniform(0.5, 1.0))


def _with(data_set: DataSet, added: Callable[[Run], np.ndarray], joint: int | None) -> DataSet:
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


@dataclass
class Told:
    """What was told of the disturbances of one kind that were put."""

    put: int = 0
    located: int = 0
    judged: int = 0
    right: int = 0
    instead: Counter[str] = field(default_factory=Counter)

    def __str__(self) -> str:
        instead = ", ".join(f"{count} {kind}" for kind, count in self.instead.items())
        right = f", {self.right} of {self.judged} described right" * bool(self.judged)
        return f"{self.located} of {self.put} located{right}; told of another kind beside or instead: {instead or 0}"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("cases", type=Path, nargs="+")
    parser.add_argument("--put", type=int, default=40, help="disturbances to put")
    parser.add_argument("--diagnose", type=int, default=0, help="of these, whole diagnoses")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--kinds", nargs="+", choices=[*KINDS, WARMING], default=KINDS, help="in turn")
    arguments = parser.parse_args()
    folders, kinds = sorted(arguments.cases), arguments.kinds
    told = {kind: Told() for kind in kinds}
    for number in range(arguments.put):
        rng = np.random.default_rng([arguments.seed, number])
        part = few(read_data_set(folders[number % len(folders)]), rng)
        data_set, put = disturbed(part, kinds[number % len(kinds)], number // len(kinds), rng)
        started = time.process_time()
        case = case_of(data_set, (), DEFAULT)
        found = disturbances(case)
        spent = time.process_time() - started
        said = _count(told[put.kind], put, described(case, found))
        print(f"{number} {len(data_set.runs)} runs, {put}: {said}, {spent:.2f} s", flush=True)
        if number < arguments.diagnose:
            print(f"   {diagnose(data_set).verdict}", flush=True)
    for kind, each in told.items():
        print(f"{kind}: {each}")
    false = 0
    for folder, part in _parts(folders, arguments.seed):
        found = disturbances(case_of(part, (), DEFAULT))
        false += bool(found)
        if found:
            print(f"{folder.name}, {len(part.runs)} runs, nothing put: {list(map(_said, found))}")
    print(f"nothing put: {false} of {2 * len(folders)} false")


def described(case: Case, found: Sequence[Disturbance]) -> list[Disturbance]:
    """Return the disturbances with the quantities that a diagnosis says: of a line, each run's own waves tell them."""
    if not any(one.kind == LINE for one in found):
        return list(found)
    stack = case.stack.with_effects([*case.effects, *case.run_offsets])
    plain = torque_system(stack, case.with_torque, case.grouping, (), None)
    _, taken = removed(case, stack, plain, found)
    told = {id(one.disturbance): one.quantities for one in taken}
    return [replace(one, quantities=told.get(id(one), one.quantities)) for one in found]


def _parts(folders: Sequence[Path], seed: int) -> Iterator[tuple[Path, DataSet]]:
    """Return each data set as it is, whole and in a few runs."""
    for number, folder in enumerate(folders):
        data_set = read_data_set(folder)
        yield from ((folder, part) for part in (data_set, few(data_set, np.random.default_rng([seed, 999, number]))))


def _count(told: Told, put: Put, found: Sequence[Disturbance]) -> str:
    """Count what was told of one that was put; return it in words."""
    one = put.located(found)
    wrong = [] if one is None else put.wrong(one)
    told.put += 1
    told.located += one is not None
    told.judged += one is not None and bool(put.truth)
    told.right += one is not None and bool(put.truth) and not wrong
    told.instead.update(each.kind for each in found if each.kind not in TOLD_AS.get(put.kind, (put.kind,)))
    if one is None:
        return f"MISSED: {list(map(_said, found))}"
    return f"located, {len(found)} found" + (f", WRONG {' '.join(wrong)}: {_said(one)}" if wrong else "")


def _said(one: Disturbance) -> str:
    return f"{one.kind} {one.joint or 'power'} " + _numbers({each.name: each.value for each in one.quantities})


def _numbers(values: Mapping[str, float]) -> str:
    return ", ".join(f"{name}={value:.3g}" for name, value in values.items())


if __name__ == "__main__":
    main()

"""Faults put into measured logs, each joint in turn: `python bench/log_faults.py DATA_FOLDER`.

For each kind of fault: how often `check` finds it with its channel, and how often on the robot as it is it finds
something at all. DATA_FOLDER holds data sets with torque, or with currents that are taken for it.
"""

from __future__ import annotations

import sys
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from irtwin.check.check import check
from irtwin.signals.channels import Signals
from irtwin.signals.log import DataSet, read_data_set

LATE = 0.02  # s
ONE = {
    "sign": np.negative,
    "scale": lambda values: 2 * values,
    "dead": np.zeros_like,
    "held_samples": lambda values: values[np.arange(len(values)) // 3 * 3],
}
PREFIXES = {"torque": "tau", "dq": "dq", "q": "q"}


def main(folder: Path) -> None:
    tried: Counter[str] = Counter()
    found: Counter[str] = Counter()
    for file in sorted(folder.glob("*/dataset.toml")):
        data_set = with_torque(read_data_set(file.parent))
        untouched = {(finding.fault, finding.channel) for finding in check(data_set).findings}
        print(f"{data_set.robot.name}, as it is: {sorted(untouched) or 'nothing'}", flush=True)
        for what, fault, channels, faulty in faults(data_set):
            tried[what] += 1
            named = {(finding.fault, finding.channel) for finding in check(faulty).findings}
            if {(fault, channel) for channel in channels} & named:
                found[what] += 1
            else:
                print(f"  missed: {what}, {channels[0]}; said {sorted(named - untouched)}", flush=True)
    for what, count in sorted(tried.items()):
        print(f"{what:24s} {found[what]:3d} of {count}")


def with_torque(data_set: DataSet) -> DataSet:
    if data_set.runs[0].signals.torque is not None:
        return data_set
    return changed(data_set, lambda signals: replace(signals, torque=signals.current, current=None))


def faults(data_set: DataSet) -> Iterator[tuple[str, str, list[str], DataSet]]:
    """Yield each fault's name, its kind, the channels that may be named for it, and the data set with it."""
    names, signals = data_set.robot.joint_names, data_set.runs[0].signals
    fields = [field for field in PREFIXES if getattr(signals, field) is not None]
    for joint, name in enumerate(names):
        other = names[(joint + 1) % len(names)]
        for field in fields:
            prefix = PREFIXES[field]
            kinds = dict(ONE) | ({"unit": np.rad2deg} if field != "torque" else {})
            for fault, change in kinds.items():
                with_it = field_changed(field, joint, change, both=field == "q" and fault in ("sign", "scale", "unit"))
                if not (field == "q" and fault == "dead"):  # a joint that stands
                    yield f"{prefix} {fault}", fault, [f"{prefix}_{name}"], changed(data_set, with_it)
            if field != "q":
                yield f"{prefix} delay", "delay", [f"{prefix}_{name}"], changed(data_set, late(field, joint))
            pair = [f"{prefix}_{name} <-> {prefix}_{other}", f"{prefix}_{other} <-> {prefix}_{name}"]
            yield f"{prefix} swap", "swap", pair, changed(data_set, exchanged(field, joint))
        yield (
            "q zero_offset",
            "zero_offset",
            [f"q_{name}"],
            changed(data_set, field_changed("q", joint, lambda q: q + 0.05)),
        )
    yield "time unit", "unit", ["time"], changed(data_set, lambda it: replace(it, time=1000 * it.time))
    heavy = replace(data_set, runs=tuple(replace(run, payload_mass=500.0) for run in data_set.runs))
    yield "payload unit", "unit", ["payload_mass"], heavy
    if signals.power is not None:
        yield "power unit", "unit", ["power"], changed(data_set, lambda it: replace(it, power=it.power / 1000))
        yield "power dead", "dead", ["power"], changed(data_set, lambda it: replace(it, power=0 * it.power))


def changed(data_set: DataSet, change: Callable[[Signals], Signals]) -> DataSet:
    return replace(data_set, runs=tuple(replace(run, signals=change(run.signals)) for run in data_set.runs))


def field_changed(
    field: str, joint: int, change: Callable[[np.ndarray], np.ndarray], *, both: bool = False
) -> Callable[[Signals], Signals]:
    """Change a joint's column; `both`: its speed with its position."""

    def made(signals: Signals) -> Signals:
        fields = [field, "dq"] if both and signals.dq is not None else [field]
        columns = {name: np.array(getattr(signals, name)) for name in fields}
        for values in columns.values():
            values[:, joint] = change(values[:, joint])
        return replace(signals, **columns)

    return made


def late(field: str, joint: int) -> Callable[[Signals], Signals]:
    def made(signals: Signals) -> Signals:
        values = np.array(getattr(signals, field))
        values[:, joint] = np.interp(signals.time - LATE, signals.time, values[:, joint])
        return replace(signals, **{field: values})

    return made


def exchanged(field: str, joint: int) -> Callable[[Signals], Signals]:
    """Exchange a joint's column with the next joint's; speeds with positions."""

    def made(signals: Signals) -> Signals:
        order = np.arange(signals.q.shape[1])
        other = (joint + 1) % len(order)
        order[[joint, other]] = other, joint
        fields = ["q", "dq"] if field == "q" and signals.dq is not None else [field]
        return replace(signals, **{name: getattr(signals, name)[:, order] for name in fields})

    return made


if __name__ == "__main__":
    main(Path(sys.argv[1]))

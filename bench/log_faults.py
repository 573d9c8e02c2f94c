"""Faults put into measured logs, each joint in turn: `python bench/log_faults.py DATA_FOLDER`.

For each kind of fault: how often `check` names it with its channel; how often it names that channel as one of two which
the torques cannot tell apart ("or"); and of how many faults the data show anything. DATA_FOLDER holds data sets with
torque, or with currents that are taken for it.

The data show a fault if one who knew it would see it: all torques, held out, are predicted better (by 2 standard
deviations between 20 stretches of time) by the log without the fault than by the log with it, and than by the log whose
torque is reversed instead of the position. Faults that are found count as shown.
"""

from __future__ import annotations

import sys
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from irtwin.check.check import check
from irtwin.check.moving import moving
from irtwin.check.rigid_body import rows_of
from irtwin.check.whole_body import Held, WholeBody
from irtwin.signals.channels import Signals
from irtwin.signals.log import DataSet, read_data_set

LATE = 0.02  # s
SEEN = 2.0  # standard deviations
ROWS = 900
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
    rival: Counter[str] = Counter()
    shown: Counter[str] = Counter()
    for file in sorted(folder.glob("*/dataset.toml")):
        data_set = with_torque(read_data_set(file.parent))
        untouched = {(finding.fault, finding.channel) for finding in check(data_set).findings}
        print(f"{data_set.robot.name}, as it is: {sorted(untouched) or 'nothing'}", flush=True)
        for what, fault, channels, faulty in faults(data_set):
            tried[what] += 1
            findings = check(faulty).findings
            named = {(finding.fault, finding.channel) for finding in findings}
            if {(fault, channel) for channel in channels} & named:
                found[what] += 1
                shown[what] += 1
                continue
            either = any(finding.fault == fault and f"(or {channels[0]}:" in finding.say for finding in findings)
            clear = carried(data_set, faulty, channels[0], fault)
            rival[what] += either
            shown[what] += clear
            note = ", as one of two" if either else "" if clear else ", which the data do not show"
            print(f"  missed: {what}, {channels[0]}{note}; said {sorted(named - untouched)}", flush=True)
    print(f"{'':24s} named  or  shown  tried")
    for what, count in sorted(tried.items()):
        print(f"{what:24s} {found[what]:5d} {rival[what]:3d}  {shown[what]:5d}  {count:5d}")
    print(f"{'all':24s} {found.total():5d} {rival.total():3d}  {shown.total():5d}  {tried.total():5d}")


def carried(data_set: DataSet, faulty: DataSet, channel: str, fault: str) -> bool:
    """Return whether one who knew the fault would see it in the log."""
    true, own = left(data_set), left(faulty)
    if fault != "sign" or not channel.startswith("q_"):
        return own.t(true) > SEEN
    joint = data_set.robot.index(channel.removeprefix("q_"))
    mirrored = left(changed(faulty, field_changed("torque", joint, np.negative)))
    return min(own.t(true), mirrored.t(true)) > SEEN


def left(data_set: DataSet) -> Held:
    rows = rows_of(data_set.robot, moving(data_set), ROWS)
    assert rows is not None
    return WholeBody.of(rows).held_out(rows.torque)


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

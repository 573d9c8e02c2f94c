"""Faults put into measured logs, each joint in turn: `python bench/log_faults.py DATA_FOLDER`.

One table: for each kind of fault and each column, how often `check` names it with its channel, of how many. Each miss
is printed with what was said instead, whether the channel was named as one of two which the torques cannot tell apart,
and whether the data show the fault. DATA_FOLDER holds data sets with torque, or with currents that are taken for it.

The data show a fault if one who knew it would see it: all torques, held out, are predicted better (by 2 standard
deviations between 20 stretches of time) by the log without the fault than by the log with it, and than by the log whose
torque is reversed instead of the position. Faults that are found count as shown.
"""

from __future__ import annotations

import json
from argparse import ArgumentParser, RawDescriptionHelpFormatter
from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from time import process_time

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


@dataclass(frozen=True)
class Case:
    """A fault put into a data set, and what became of it.

    `field`: the log's column, short. `found`: named with its channel. `either`: named as one of two. `shown`: the data
    show it.
    """

    robot: str
    field: str
    fault: str
    channel: str
    found: bool
    either: bool
    shown: bool
    said: tuple[tuple[str, str], ...]

    def missed(self) -> str:
        """Return why, for a person."""
        why = "as one of two that the torques cannot tell apart" if self.either else ""
        why = why or ("though the data show it" if self.shown else "the data do not show it")
        instead = ", ".join(f"{fault} of {channel}" for fault, channel in self.said) or "nothing"
        return f"missed: {self.fault} of {self.channel}, {self.robot}: {why}; said {instead}"


def main() -> None:
    parser = ArgumentParser(description=__doc__, formatter_class=RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--only", nargs="*", default=[], metavar="KIND", help='such as "q sign"; all without it')
    parser.add_argument("--sets", nargs="*", default=[], metavar="NAME", help="folders' names; all without it")
    parser.add_argument("--json", type=Path, help="where to write each case")
    asked = parser.parse_args()
    cases = []
    for file in sorted(asked.folder.glob("*/dataset.toml")):
        if asked.sets and file.parent.name not in asked.sets:
            continue
        for case in cases_of(with_torque(read_data_set(file.parent)), asked.only):
            cases.append(case)
            if not case.found:
                print(f"  {case.missed()}", flush=True)
    if asked.json:
        asked.json.write_text(json.dumps([asdict(case) for case in cases], indent=1))
    print(table(cases))
    print(f"{process_time():.0f} s of processor time")


def cases_of(data_set: DataSet, only: Collection[str]) -> Iterator[Case]:
    """Yield what becomes of each fault of the kinds, of all where none is given."""
    robot = data_set.robot.name
    untouched = {(finding.fault, finding.channel) for finding in check(data_set).findings}
    print(f"{robot}, as it is: {sorted(untouched) or 'nothing'}", flush=True)
    true = left(data_set)
    for what, fault, channels, faulty in faults(data_set):
        if only and what not in only:
            continue
        findings = check(faulty).findings
        named = {(finding.fault, finding.channel) for finding in findings}
        found = bool({(fault, channel) for channel in channels} & named)
        either = any(finding.fault == fault and f"(or {channels[0]}:" in finding.say for finding in findings)
        shown = found or carried(true, faulty, channels[0], fault)
        said = tuple(sorted(named - untouched))
        yield Case(robot, what.split()[0], fault, channels[0], found, either and not found, shown, said)


def table(cases: Sequence[Case]) -> str:
    """Return kinds by signals: found of tried."""
    fields = list(dict.fromkeys(case.field for case in cases))
    lines = [f"{'':14s}" + "".join(f"{field:>12s}" for field in fields) + f"{'all':>14s}"]
    for fault in sorted({case.fault for case in cases}):
        of_kind = [case for case in cases if case.fault == fault]
        parts = [share([case for case in of_kind if case.field == field]) for field in fields]
        lines.append(f"{fault:14s}" + "".join(f"{part:>12s}" for part in parts) + f"{share(of_kind):>14s}")
    seen = [case for case in cases if case.shown]
    lines += [
        f"all: {share(cases)} found ({sum(case.found for case in cases) / max(len(cases), 1):.1%}), "
        f"{sum(case.either for case in cases)} more as one of two",
        f"of those that the data show: {share(seen)} ({sum(case.found for case in seen) / max(len(seen), 1):.1%})",
    ]
    return "\n".join(lines)


def share(cases: Sequence[Case]) -> str:
    return f"{sum(case.found for case in cases)} of {len(cases)}" if cases else ""


def carried(true: Held, faulty: DataSet, channel: str, fault: str) -> bool:
    """Return whether one who knew the fault, and what is left of the `true` torques, would see it in the log."""
    own = left(faulty)
    if fault != "sign" or not channel.startswith("q_"):
        return bool(own.t(true) > SEEN)
    joint = faulty.robot.index(channel.removeprefix("q_"))
    mirrored = left(changed(faulty, field_changed("torque", joint, np.negative)))
    return bool(min(own.t(true), mirrored.t(true)) > SEEN)


def left(data_set: DataSet) -> Held:
    rows = rows_of(data_set.robot, moving(data_set), ROWS)
    assert rows is not None
    return WholeBody.of(rows).fit(rows.torque).held_out()


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
    main()

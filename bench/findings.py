"""What a diagnosis says of measured robots, and whether it stays: `python bench/findings.py DATASET...`.

Each data set is diagnosed as it is, from the first and from the last half of each run's time, and with another seed. A
finding stays where one of its family, at one of its joints, is found again.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import numpy as np

from irtwin.document.document import Document, Finding
from irtwin.gap.diagnosis import diagnose
from irtwin.report.wording import share
from irtwin.signals.log import DataSet, Run, read_data_set


def half(data_set: DataSet, last: bool) -> DataSet:
    """Return the data set with the first or the last half of each run's time."""
    return replace(data_set, runs=tuple(_half(run, last) for run in data_set.runs))


def _half(run: Run, last: bool) -> Run:
    count = len(run.signals.time)
    kept = slice(count // 2, count) if last else slice(0, count // 2)
    values: dict[str, Any] = {one.name: getattr(run.signals, one.name) for one in fields(run.signals)}
    cut = {name: value[kept] for name, value in values.items() if isinstance(value, np.ndarray)}
    return replace(run, signals=replace(run.signals, **cut))


def stays(finding: Finding, others: Sequence[Finding]) -> bool:
    """Return whether a finding is among others: its family, at one of its joints, or of the whole robot."""
    return any(
        one.family == finding.family
        and bool(set(one.joints) & set(finding.joints) or not (one.joints or finding.joints))
        for one in others
    )


def section(folder: Path) -> str:
    """Return the section of one data set: what is said of it, and of less of it."""
    data_set = read_data_set(folder)
    said = diagnose(data_set).document
    told = [one for one in said.findings if one.matters]
    listed = "; ".join(f"{one.id} ({one.confidence:.2f})" for one in said.causes) or "none"
    lines = [
        f"### {folder.name}",
        "",
        f"Every cause, as a list by effect would have it: {listed}.",
        "",
        "| data | verdict | findings that matter (confidence), with what they close | others | found again |",
        "| --- " * 5 + "|",
        _row("as it is", said, []),
        _row("first half of the time", diagnose(half(data_set, last=False)).document, told),
        _row("last half of the time", diagnose(half(data_set, last=True)).document, told),
        _row("another seed", diagnose(data_set, seed=1).document, told),
    ]
    return "\n".join(lines) + "\n"


def _row(name: str, said: Document, told: Sequence[Finding]) -> str:
    found = "; ".join(_named(one) for one in said.findings if one.matters) or "none"
    little = [one.share for one in said.findings if not one.matters]
    others = f"{len(little)} that close {share(sum(little))}" if little else "none"
    again = f"{sum(stays(one, said.findings) for one in told)} of {len(told)}" if told else ""
    return f"| {name} | {said.verdict} | {found} | {others} | {again} |"


def _named(one: Finding) -> str:
    effects = " + ".join(cause.partition("@")[0] for cause in one.causes)
    lower, upper = map(share, one.share_interval95)
    return f"{one.id} ({one.confidence:.2f}) as {effects}: {share(one.share)} ({lower} to {upper})"


if __name__ == "__main__":
    given = [Path(each) for each in sys.argv[1:]]
    for place in sorted(each for each in given if (each / "dataset.toml").exists()):
        print(section(place), flush=True)

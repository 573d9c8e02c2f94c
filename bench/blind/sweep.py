"""`python -m blind.sweep CASES LABELS OUT THRESHOLD VALUE...`: what a threshold trades, misses against false alarms.

THRESHOLD is one by which the diagnosis decides, as `criterion.misfit`; `--list` prints them all with value, unit,
meaning and origin. Diagnoses every case once a value, into OUT/THRESHOLD=VALUE (resumable), and prints the scores side
by side. Use cases of a development split: a threshold that was set on a test split makes that split worthless.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path

from blind.compare import answers, table
from blind.run import diagnose_cases
from irtwin.gap.thresholds import DEFAULT


def sweep(cases: Path, labels: Path, out: Path, name: str, values: list[float], workers: int = 2) -> str:
    """Return the scores (Markdown) with each value of a threshold; InputError on a name that there is not."""
    ways = {}
    for value in values:
        changed, folder = DEFAULT.changed(name, value), out / f"{name}={value:g}"
        for line in diagnose_cases(cases, folder, workers, changed):
            print(f"{name} = {value:g}: {line}", flush=True)
        ways[f"{name} = {value:g}"] = answers(folder)
    return table(ways, json.loads(labels.read_text(encoding="utf-8")))


def listed() -> str:
    """Return every threshold (Markdown)."""
    lines = [
        "| threshold | value | unit | what it decides | where its value comes from |",
        "| --- | --- | --- | --- | --- |",
    ]
    for one in DEFAULT.listed():
        lines.append(f"| `{one.name}` | {one.value} | {one.unit} | {one.meaning} | {one.source} |")
    return "\n".join(lines) + "\n"


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m blind.sweep", description=__doc__)
    parser.add_argument("--list", action="store_true", help="print every threshold, and nothing else")
    for name, kind in (("cases", Path), ("labels", Path), ("out", Path), ("threshold", str)):
        parser.add_argument(name, type=kind, nargs="?")
    parser.add_argument("values", type=float, nargs="*")
    parser.add_argument("--workers", type=int, default=2)
    given = parser.parse_args()
    if given.list:
        print(listed())
    elif given.values:
        print(sweep(given.cases, given.labels, given.out, given.threshold, given.values, given.workers))
    else:
        parser.error("give CASES LABELS OUT THRESHOLD VALUE..., or --list")


if __name__ == "__main__":
    main()

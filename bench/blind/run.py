"""`python -m blind.run CASES OUT`: diagnose every case; resumable. It reads the cases and never a label."""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from itertools import repeat
from pathlib import Path

from irtwin.gap.diagnosis import diagnose
from irtwin.gap.thresholds import DEFAULT, Thresholds
from irtwin.signals.log import read_data_set


def diagnose_case(case: Path, out: Path, thresholds: Thresholds = DEFAULT) -> str:
    """Write OUT/CASE.json; an error is written too, as it counts."""
    file = out / f"{case.name}.json"
    if file.exists():
        return f"{case.name} kept"
    started = time.perf_counter()
    try:
        answer = diagnose(read_data_set(case), thresholds=thresholds).to_json()
    except Exception as error:
        answer = {"error": f"{type(error).__name__}: {error}"}
    answer["seconds"] = round(time.perf_counter() - started, 2)
    file.write_text(json.dumps(answer), encoding="utf-8")
    return f"{case.name} {answer.get('verdict', answer.get('error'))} {answer['seconds']} s"


def diagnose_cases(cases: Path, out: Path, workers: int, thresholds: Thresholds = DEFAULT) -> Iterator[str]:
    """Diagnose the cases of a folder; say a line of each."""
    out.mkdir(parents=True, exist_ok=True)
    found = sorted(cases.glob("case_*"))
    with ProcessPoolExecutor(workers) as pool:
        yield from pool.map(diagnose_case, found, repeat(out), repeat(thresholds))


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m blind.run", description=__doc__)
    parser.add_argument("cases", type=Path)
    parser.add_argument("out", type=Path)
    parser.add_argument("--workers", type=int, default=2)
    arguments = parser.parse_args()
    for line in diagnose_cases(arguments.cases, arguments.out, arguments.workers):
        print(line, flush=True)


if __name__ == "__main__":
    main()

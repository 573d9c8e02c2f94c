"""`python -m blind.run CASES OUT`: diagnose every case; resumable. It reads the cases and never a label."""

from __future__ import annotations

import argparse
import json
import time
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

from irtwin.gap.diagnosis import diagnose
from irtwin.signals.log import read_data_set


def diagnose_case(task: tuple[Path, Path]) -> str:
    """Write OUT/CASE.json; an error is written too, as it counts."""
    case, out = task
    file = out / f"{case.name}.json"
    if file.exists():
        return f"{case.name} kept"
    started = time.perf_counter()
    try:
        answer = diagnose(read_data_set(case)).to_json()
    except Exception as error:
        answer = {"error": f"{type(error).__name__}: {error}"}
    answer["seconds"] = round(time.perf_counter() - started, 2)
    file.write_text(json.dumps(answer), encoding="utf-8")
    return f"{case.name} {answer.get('verdict', answer.get('error'))} {answer['seconds']} s"


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m blind.run", description=__doc__)
    parser.add_argument("cases", type=Path)
    parser.add_argument("out", type=Path)
    parser.add_argument("--workers", type=int, default=2)
    arguments = parser.parse_args()
    arguments.out.mkdir(parents=True, exist_ok=True)
    tasks = [(case, arguments.out) for case in sorted(arguments.cases.glob("case_*"))]
    with ProcessPoolExecutor(arguments.workers) as pool:
        for line in pool.map(diagnose_case, tasks):
            print(line, flush=True)


if __name__ == "__main__":
    main()

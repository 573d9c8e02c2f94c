"""`python -m blind.taken_out CASES OUT LABELS`: what is said where the catalogue lacks the effect that is there.

Each strong single case is diagnosed with its own effect unknown to the search; resumable. The answer that is hoped for
is `unexplained`, or an effect that imitates it with little confidence; where the gap lies is to be said all the same.
"""

from __future__ import annotations

import argparse
import json
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np

from blind.score import ABSTAIN, ENOUGH, located, ranked, wilson
from irtwin.gap.diagnosis import diagnose
from irtwin.signals.log import read_data_set


def answer(task: tuple[Path, Path, str]) -> str:
    """Write OUT/CASE.json, the diagnosis without the effect."""
    case, out, effect = task
    file = out / f"{case.name}.json"
    if not file.exists():
        file.write_text(json.dumps(diagnose(read_data_set(case), unknown=[effect]).to_json()), encoding="utf-8")
    return f"{case.name} {effect}"


def page(answers: dict[str, dict[str, Any]], labels: dict[str, dict[str, Any]]) -> str:
    """Return the table, and which effects stand in for those that are unknown."""
    scores: dict[str, list[bool]] = {}
    instead: Counter[tuple[str, str]] = Counter()
    for name, diagnosis in answers.items():
        truth, causes = labels[name]["effects"][0], ranked(diagnosis)
        abstained = diagnosis["verdict"] in ABSTAIN
        scores.setdefault("abstained from", []).append(abstained)
        scores.setdefault("nothing named above 0.5", []).append(all(each["confidence"] <= 0.5 for each in causes))
        scores.setdefault("located", []).append(located(diagnosis, truth))
        if not abstained:
            instead[truth["effect"], causes[0]["effect"]] += 1
    lines = ["| score | reached | 95 % interval | cases |", "| --- | --- | --- | --- |"]
    for score, values in scores.items():
        low, high = wilson(float(np.mean(values)), len(values))
        lines.append(f"| {score} | {np.mean(values):.0%} | {low:.0%} to {high:.0%} | {len(values)} |")
    named = [f"{first} for {effect}" + (f" ({n})" if n > 1 else "") for (effect, first), n in sorted(instead.items())]
    return "\n".join([*lines, "", "Named instead: " + ", ".join(named) + "."]) + "\n"


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m blind.taken_out", description=__doc__)
    parser.add_argument("cases", type=Path)
    parser.add_argument("out", type=Path)
    parser.add_argument("labels", type=Path, help="labels.json")
    parser.add_argument("--workers", type=int, default=2)
    arguments = parser.parse_args()
    arguments.out.mkdir(parents=True, exist_ok=True)
    labels = json.loads(arguments.labels.read_text(encoding="utf-8"))
    strong = {
        name: label["effects"][0]["effect"]
        for name, label in labels.items()
        if label["kind"] == "single" and label["effects"][0]["gap_over_floor"] >= ENOUGH
    }
    tasks = [(arguments.cases / name, arguments.out, effect) for name, effect in strong.items()]
    with ProcessPoolExecutor(arguments.workers) as pool:
        for line in pool.map(answer, tasks):
            print(line, flush=True)
    answers = {name: json.loads((arguments.out / f"{name}.json").read_text(encoding="utf-8")) for name in strong}
    print(page(answers, labels))


if __name__ == "__main__":
    main()

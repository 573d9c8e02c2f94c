"""`python -m blind.compare LABELS NAME=FOLDER...`: scores of several ways of diagnosis side by side."""

from __future__ import annotations

import argparse
import json
from collections import defaultdict
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from blind.score import AIMS, calibration, judge, ranked

SCORES = (
    "right effect first",
    "truth in the class",
    "class size",
    "any cause names it",
    "joint right",
    "scope right",
    "false alarms, clean nulls",
    "false alarms, dirty nulls",
    "unknown effects abstained from",
    "pairs, both found",
)  # what every way gives: a baseline says nothing of places and of how far a gap shrinks


def table(ways: Mapping[str, Mapping[str, Any]], labels: Mapping[str, Any]) -> str:
    """Return the scores (Markdown) of the cases that every way has answered; `ways`: diagnoses by case, by name."""
    cases = [name for name in labels if all(name in answers for answers in ways.values())]
    columns = {way: _scores(answers, labels, cases) for way, answers in ways.items()}
    lines = [f"| {len(cases)} cases | aim | " + " | ".join(ways) + " |", "| --- " * (len(ways) + 2) + "|"]
    for score in (*SCORES, "causes a case", "expected calibration error", "seconds a case, median"):
        if any(score in values for values in columns.values()):
            cells = [_cell(score, values[score]) if score in values else "-" for values in columns.values()]
            lines.append(f"| {score} | {AIMS.get(score, '')} | " + " | ".join(cells) + " |")
    return "\n".join(lines) + "\n"


def _scores(answers: Mapping[str, Any], labels: Mapping[str, Any], cases: list[str]) -> dict[str, float]:
    scores: dict[str, list[float]] = defaultdict(list)
    confident: list[tuple[float, bool]] = []
    for name in cases:
        for score, value in judge(answers[name], labels[name]).items():
            scores[score].append(value)
        causes, true = ranked(answers[name]), {effect["effect"] for effect in labels[name]["effects"]}
        confident += [(cause["confidence"], cause["effect"] in true) for cause in causes]
        scores["causes a case"].append(len(causes))
    found = {score: float(np.mean(values)) for score, values in scores.items()}
    if confident:
        found["expected calibration error"] = calibration(confident)[0]
    seconds = [answers[name]["seconds"] for name in cases if "seconds" in answers[name]]
    return found | ({"seconds a case, median": float(np.median(seconds))} if seconds else {})


def _cell(score: str, value: float) -> str:
    if score in {"class size", "causes a case", "expected calibration error", "seconds a case, median"}:
        return f"{value:.2f}"
    return f"{100 * value:.0f} %"


def answers(folder: Path) -> dict[str, Any]:
    """Return the diagnoses of a folder, by case."""
    return {file.stem: json.loads(file.read_text(encoding="utf-8")) for file in folder.glob("*.json")}


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m blind.compare", description=__doc__)
    parser.add_argument("labels", type=Path, help="labels.json")
    parser.add_argument("ways", nargs="+", metavar="NAME=FOLDER", help="a name and its folder of CASE.json")
    arguments = parser.parse_args()
    labels = json.loads(arguments.labels.read_text(encoding="utf-8"))
    ways = {}
    for way in arguments.ways:
        name, _, folder = way.partition("=")
        ways[name] = answers(Path(folder))
    print(table(ways, labels))


if __name__ == "__main__":
    main()

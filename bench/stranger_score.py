"""`python stranger_score.py OUT FOLDER_labels.json`: what diagnoses say of the cases of `stranger.py`, and counts."""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import Any

import numpy as np


def shapes_held(label: dict[str, Any], causes: list[dict[str, Any]]) -> list[bool]:
    """Return of each number of a law that nobody named whether its interval holds it; of one of all joints their mean.

    That mean is geometric.
    """
    held = []
    for cause in (one for one in causes if one["effect"] in label["also"]):
        numbers = label["law_numbers"][cause["effect"]]
        for stated in (one for one in cause["parameters"] if one["name"] in numbers and one["interval95"]):
            own = dict(zip(label["joints"], numbers[stated["name"]], strict=True))
            true = own[stated["joint"]] if stated["joint"] else np.exp(np.mean(np.log(list(own.values()))))
            held.append(bool(stated["interval95"][0] <= true <= stated["interval95"][1]))
    return held


def score(out: Path, labels: dict[str, Any]) -> list[str]:
    """Return a line for each case, then counts."""
    lines, first, placed, strong, blamed, gap, healthy, false, sure = [], 0, 0, 0, 0, 0, 0, 0, []
    shapes: list[bool] = []
    for name, label in labels.items():
        if not (out / f"{name}.json").exists():
            continue
        answer = json.loads((out / f"{name}.json").read_text(encoding="utf-8"))
        causes = answer.get("causes", [])
        true = {each["effect"]: each for each in label["effects"]}
        told = [(one, one["effect"] in true or one["effect"] in label["also"]) for one in causes]
        wrong = [one for one, right in told if one["confidence"] >= 0.5 and not right]
        false += len(wrong)
        sure += [right for one, right in told if one["confidence"] >= 0.9]
        shapes += shapes_held(label, causes)
        if label["kind"] in ("single", "pair") and max(each["gap_over_floor"] for each in true.values()) >= 1:
            strong += 1
            own = [one for one, _ in told if one["effect"] not in label["also"] or one["effect"] in true]
            right = bool(own) and own[0]["effect"] in true
            first += right
            placed += right and set(own[0]["joints"]) == set(true[own[0]["effect"]]["joints"])
        if label["kind"] == "clean_null":
            healthy, blamed = healthy + 1, blamed + bool(wrong)
            gap += answer.get("verdict") != "no_gap" and not label["also"]
        truth = ", ".join(f"{e['effect']} {e['joints']} {e['gap_over_floor']:.1f}" for e in label["effects"]) or "-"
        says = "; ".join(
            f"{o['effect']} ({o['scope'][0]}) {','.join(o['joints'])} {o['confidence']:.2f}" for o in causes[:5]
        )
        mark = "FALSE " if wrong else ""
        lines.append(
            f"{name} {label['robot']} {label['law']}{'+' if label['named'] else ''} {label['differs']:g} "
            f"{label['scope']}: "
            f"{truth} | {answer.get('verdict', answer.get('error'))} | {mark}{says or '-'} | {answer['seconds']:.0f} s"
        )
    return [
        *lines, f"right first {first}, with joints {placed}, of {strong} of one noise and more",
        f"healthy: blamed {blamed}, not no_gap {gap} (law named or the catalogue's), of {healthy}",
        f"false causes of 0.5 and more {false}; of 0.9 and more right {sum(sure)} of {len(sure)}",
        f"numbers of the shapes of laws that nobody named: within their intervals {sum(shapes)} of {len(shapes)}",
    ]  # fmt: skip


def main() -> None:
    parser = argparse.ArgumentParser(prog="python stranger_score.py", description=__doc__)
    parser.add_argument("out", type=Path)
    parser.add_argument("labels", type=Path)
    given = parser.parse_args()
    print(*score(given.out, json.loads(given.labels.read_text(encoding="utf-8"))), sep="\n")


if __name__ == "__main__":
    main()

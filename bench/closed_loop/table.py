"""`python -m closed_loop.table DIAGNOSES LABELS`: a row for each case, what is true beside what was said; and counts.

`blind.score` scores the same files as it does blind cases; this shows which case went wrong, and how.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import Any

from blind.score import ENOUGH, family, ranked

NAMED = 0.5  # confidence from which a cause is said rather than considered


def truth(label: dict[str, Any]) -> str:
    """Return what acts in a case: effect, joints, gap in floors."""
    each = [f"{one['effect']} {_place(one)} {one['gap_over_floor']:.1f}".split() for one in label["effects"]]
    return " + ".join(" ".join(words) for words in each) or "nothing"


def said(diagnosis: dict[str, Any], most: int = 4) -> str:
    """Return the causes as ranked, with their rivals, scope, joints and confidence."""
    if "error" in diagnosis:
        return str(diagnosis["error"])
    causes = [
        f"{'/'.join([one['effect'], *one['indistinguishable_from']])} ({one['scope']}) {_place(one)} "
        f"{one['confidence']:.2f}"
        for one in ranked(diagnosis)[:most]
    ]
    return "; ".join(causes) or "-"


def _place(one: dict[str, Any]) -> str:
    return ",".join(one["joints"])


def row(name: str, label: dict[str, Any], diagnosis: dict[str, Any]) -> str:
    """Return a case's row in Markdown."""
    right = "" if label["kind"] == "clean_null" else "yes" if _right(label, diagnosis) else "no"
    made = f"{label['robot']}, {1 / label['interval']:.0f} Hz, {'hard' if label['hard'] else 'soft'}"
    verdict = diagnosis.get("verdict", "error")
    return f"| {name} | {made} | {label['scope']} | {truth(label)} | {verdict} | {said(diagnosis)} | {right} |"


def _right(label: dict[str, Any], diagnosis: dict[str, Any]) -> bool:
    """Return whether the first cause is the effect; of a pair, whether both stand in classes."""
    causes, true = ranked(diagnosis), {one["effect"] for one in label["effects"]}
    if label["kind"] == "pair":
        return bool(causes) and true <= set().union(*map(family, causes))
    return bool(causes) and causes[0]["effect"] in true


def counts(labels: dict[str, Any], diagnoses: dict[str, Any]) -> list[str]:
    """Return in words how many cases are right, how many healthy ones alarm, and how many false causes are named."""
    cases = [(label, diagnoses[name]) for name, label in labels.items() if name in diagnoses]
    strong = [
        (label, found)
        for label, found in cases
        if label["kind"] == "single" and label["effects"][0]["gap_over_floor"] >= ENOUGH
    ]
    first = sum(_right(label, found) for label, found in strong)
    classed = sum(bool(ranked(f)) and x["effects"][0]["effect"] in family(ranked(f)[0]) for x, f in strong)
    anywhere = sum(any(x["effects"][0]["effect"] in family(one) for one in ranked(f)) for x, f in strong)
    pairs = [(label, found) for label, found in cases if label["kind"] == "pair"]
    healthy = [found for label, found in cases if label["kind"] == "clean_null"]
    alarms = sum(any(one["confidence"] >= NAMED for one in ranked(found)) for found in healthy)
    false = [
        one
        for label, found in cases
        for one in ranked(found)
        if one["confidence"] >= NAMED and one["effect"] not in {each["effect"] for each in label["effects"]}
    ]
    return [
        f"Singles of at least {ENOUGH} floors: {len(strong)}; first cause right {first}, true effect in its class "
        f"{classed}, among all causes {anywhere}.",
        f"Pairs with both found: {sum(_right(label, found) for label, found in pairs)} of {len(pairs)}.",
        f"Healthy robots with a cause of {NAMED} or more: {alarms} of {len(healthy)}.",
        f"False causes of {NAMED} or more: {len(false)} in {len(cases)} cases.",
    ]


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m closed_loop.table", description=__doc__)
    parser.add_argument("diagnoses", type=Path, help="a folder of CASE.json")
    parser.add_argument("labels", type=Path, help="labels.json")
    arguments = parser.parse_args()
    labels = json.loads(arguments.labels.read_text(encoding="utf-8"))
    files = {name: arguments.diagnoses / f"{name}.json" for name in labels}
    diagnoses = {name: json.loads(file.read_text(encoding="utf-8")) for name, file in files.items() if file.exists()}
    print("| case | arm | scope | true: effect, joint, gap in floors | verdict | said | right |")
    print("| --- | --- | --- | --- | --- | --- | --- |")
    for name, found in diagnoses.items():
        print(row(name, labels[name], found))
    print("", *counts(labels, diagnoses), sep="\n")


if __name__ == "__main__":
    main()

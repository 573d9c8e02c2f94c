"""`python -m blind.score DIAGNOSES LABELS [--healthy DIAGNOSES] [--out PAGE.md]`: score diagnoses by sealed labels.

A score of singles counts cases whose effect leaves at least 1 floor (0.8 measured) unless a row says otherwise.
A diagnosis that ended in an error is a wrong one. `--healthy`: diagnoses of the same robots without the effect.
"""

from __future__ import annotations

import argparse
import hashlib
import json
from collections import defaultdict
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from irtwin.effects.catalogue import catalogue

ENOUGH = 0.8  # floors, what still counts as a gap of 1
ABSTAIN = {"unexplained", "no_gap"}
# aims of the project: score, at least (or at most) what
AIMS = {
    "right effect first": ">= 95 %",
    "family of the first finding right": ">= 99 %",
    "truth in the class": ">= 98 %",
    "class size": "<= 2",
    "joint right": ">= 97 %",
    "regime right": ">= 90 %",
    "false alarms, clean nulls": "<= 2 %",
    "false alarms, dirty nulls": "<= 5 %",
    "unknown effects abstained from": ">= 90 %",
    "unknown effects located": ">= 90 %",
    "pairs, both found": ">= 80 %",
    "interval covers what the true form closes": "90 to 98 %",
    "expected calibration error": "<= 0.05",
}


def ranked(diagnosis: dict[str, Any]) -> list[dict[str, Any]]:
    """Return the causes as ranked; none where there is an error."""
    return list(diagnosis.get("causes", []))


def family(cause: dict[str, Any]) -> set[str]:
    """Return a cause's class: its effect and those that it cannot be told from."""
    return {cause["effect"], *cause.get("indistinguishable_from", [])}


def judge(diagnosis: dict[str, Any], label: dict[str, Any]) -> dict[str, float]:
    """Return what one case adds to each score it takes part in, 0 or 1 (a class' size: a count)."""
    kind, causes = label["kind"], ranked(diagnosis)
    if kind in {"clean_null", "dirty_null"}:
        wrong = diagnosis.get("verdict") != "no_gap"
        return {f"false alarms, {kind.split('_')[0]} nulls": float(wrong)}
    if kind == "unknown":
        return {
            "unknown effects abstained from": float(diagnosis.get("verdict") in ABSTAIN),
            "unknown effects, nothing named above 0.5": float(all(cause["confidence"] <= 0.5 for cause in causes)),
            "unknown effects located": float(located(diagnosis, label["effects"][0])),
        }
    if kind == "pair":
        found = set().union(*(family(cause) for cause in causes)) if causes else set()
        return {"pairs, both found": float({effect["effect"] for effect in label["effects"]} <= found)}
    truth = label["effects"][0]
    strong = truth["gap_over_floor"] >= ENOUGH
    first = causes[0] if causes else None
    right = first is not None and first["effect"] == truth["effect"]
    scores = {f"right effect first, gap {label['level']:g}, {kind}": float(right)}
    if not strong or kind != "single":
        return scores
    scores |= {
        "right effect first": float(right),
        "family of the first finding right": float(_family_first(diagnosis, truth["effect"])),
        "truth in the class": float(first is not None and truth["effect"] in family(first)),
        "any cause names it": float(any(truth["effect"] in family(cause) for cause in causes)),
        "silent": float(first is None),
        "known effects abstained from": float(diagnosis.get("verdict") in ABSTAIN),
        f"right effect first: {truth['channel']}": float(right),
        f"right effect first: {label['scope']}": float(right),
        f"right effect first: {label['robot']}": float(right),
        f"effect {truth['effect']}": float(right),
    }
    if first is not None:
        scores["class size"] = float(len(family(first)))
    if right and first is not None:
        scores["scope right"] = float(first["scope"] == label["scope"])
    if truth["channel"] == "torque" and truth["joints"]:
        named = {joint for cause in causes if truth["effect"] in family(cause) for joint in cause["joints"]}
        scores["joint right"] = float(named == set(truth["joints"]))
    if truth["regimes"]:
        scores["regime right"] = float(_regime(diagnosis, truth))
    return scores


def _family_first(diagnosis: dict[str, Any], effect: str) -> bool:
    findings = diagnosis.get("findings", [])
    return bool(findings) and findings[0]["family"] == catalogue()[effect].family


def _regime(diagnosis: dict[str, Any], truth: dict[str, Any]) -> bool:
    places = [place for place in diagnosis.get("locations", []) if place["channel"] == truth["channel"]]
    return bool(places) and places[0].get("regime") in truth["regimes"]


def located(diagnosis: dict[str, Any], truth: dict[str, Any]) -> bool:
    """Return whether the first place is where the effect acts."""
    places = diagnosis.get("locations", [])
    if not places or places[0]["channel"] != truth["channel"]:
        return False
    return truth["channel"] == "power" or not truth["joints"] or places[0].get("joint") in truth["joints"]


def calibration(pairs: Iterable[tuple[float, bool]], bins: int = 10) -> tuple[float, list[tuple[float, float, int]]]:
    """Return the expected calibration error of (confidence, right), and per bin confidence, share right, count."""
    given = np.array([(c, r) for c, r in pairs], dtype=float).reshape(-1, 2)
    if not len(given):
        return float("nan"), []
    place = np.minimum((given[:, 0] * bins).astype(int), bins - 1)
    taken = [place == b for b in range(bins) if (place == b).any()]
    table = [(*given[inside].mean(axis=0).tolist(), int(inside.sum())) for inside in taken]
    error = sum(count * abs(confidence - share) for confidence, share, count in table) / len(given)
    return float(error), [(float(c), float(s), n) for c, s, n in table]


def calibration_of_true_confidences(confidences: Sequence[float], draws: int = 2000) -> tuple[float, float]:
    """Return the error that confidences would have if each were true, as causes are few: its mean and 95 % point."""
    rng, given = np.random.default_rng(0), np.asarray(confidences)
    errors = [calibration(zip(given, rng.random(len(given)) < given, strict=True))[0] for _ in range(draws)]
    return float(np.mean(errors)), float(np.quantile(errors, 0.95))


def closed_by_true_form(diagnosis: dict[str, Any], healthy: dict[str, Any]) -> float:
    """Return the closed fraction of a refit with the true form: it leaves what the healthy robot's twin leaves.

    In the channels in which a cause is named, as the diagnosis counts its own.
    """
    channels = {cause["evidence"]["channel"] for cause in ranked(diagnosis)}
    above, left = 0.0, 0.0
    for channel in channels:
        for one, other in zip(*(_equations(each, channel) for each in (diagnosis, healthy)), strict=True):
            if one["noise_floor"] and (one["excess"] or 0) > 0:
                above += one["excess"]
                left += (other["rmse"] / one["noise_floor"]) ** 2 - 1
    return min(1 - left / above, 1.0)


def _equations(diagnosis: dict[str, Any], channel: str) -> list[dict[str, Any]]:
    gap = diagnosis["gap"][channel]
    return list(gap.values()) if channel == "torque" else [gap]


def wilson(share: float, count: int) -> tuple[float, float]:
    """Return the 95 % interval of a share."""
    z = 1.96
    middle = (share + z * z / (2 * count)) / (1 + z * z / count)
    half = z * np.sqrt(share * (1 - share) / count + z * z / (4 * count**2)) / (1 + z * z / count)
    return float(max(0, middle - half)), float(min(1, middle + half))


def page(
    diagnoses: dict[str, dict[str, Any]],
    labels: dict[str, dict[str, Any]],
    healthy: dict[str, dict[str, Any]],
    seal: str,
) -> str:
    """Return the page of results."""
    scores: dict[str, list[float]] = defaultdict(list)
    confident: list[tuple[float, bool]] = []
    closed, of_closable, seconds, errors = [], [], [], 0
    for name, label in labels.items():
        if name not in diagnoses:
            continue
        diagnosis = diagnoses[name]
        errors += "error" in diagnosis
        for score, value in judge(diagnosis, label).items():
            scores[score].append(value)
        true = {effect["effect"] for effect in label["effects"]}
        confident += [(cause["confidence"], cause["effect"] in true) for cause in ranked(diagnosis)]
        seconds.append(diagnosis.get("seconds", np.nan))
        fraction = (diagnosis.get("shrink") or {}).get("closed_fraction")
        if fraction and label["kind"] == "single" and label["effects"][0]["gap_over_floor"] >= ENOUGH:
            closed.append(fraction["value"])
            if "gap" in healthy.get(name, {}):
                true_form = closed_by_true_form(diagnosis, healthy[name])
                of_closable.append(fraction["value"] / true_form)
                low, high = fraction["interval95"]
                scores["interval covers what the true form closes"].append(float(low <= true_form <= high))
    error, table = calibration(confident)
    lines = [f"{len(seconds)} of {len(labels)} cases, labels' SHA-256 `{seal}`, {errors} ended in an error.", ""]
    lines += ["| score | reached | 95 % interval | aim | cases |", "| --- | --- | --- | --- | --- |"]
    first = [score for score in AIMS if score in scores]
    for score in first + sorted(set(scores) - set(first)):
        lines.append(_row(score, scores[score]))
    lines += _calibration_rows(error, confident)
    if closed:
        lines.append(f"| closed fraction, median | {np.median(closed):.2f} | | | {len(closed)} |")
    if of_closable:
        median, most = np.median(of_closable), np.mean(np.array(of_closable) >= 0.95)
        lines.append(
            f"| closed, of what the true form closes: median (share of cases above 0.95) | {median:.2f} ({most:.0%}) "
            f"| | >= 0.95 | {len(of_closable)} |"
        )
    if seconds:
        median, largest = np.nanmedian(seconds), np.nanmax(seconds)
        lines.append(f"| seconds a case, median (largest) | {median:.1f} ({largest:.1f}) | | | {len(seconds)} |")
    lines += ["", "| confidence given | share right | causes |", "| --- | --- | --- |"]
    lines += [f"| {c:.2f} | {s:.2f} | {n} |" for c, s, n in table]
    return "\n".join(lines) + "\n"


def _calibration_rows(error: float, confident: Sequence[tuple[float, bool]]) -> list[str]:
    aim, causes = AIMS["expected calibration error"], f"{len(confident)} causes"
    rows = [f"| expected calibration error | {error:.3f} | | {aim} | {causes} |"]
    if confident:
        mean, most = calibration_of_true_confidences([given for given, _ in confident])
        rows.append(f"| that of true confidences, as few | {mean:.3f} | up to {most:.3f} | | {causes} |")
    return rows


def _row(score: str, values: list[float]) -> str:
    mean, count = float(np.mean(values)), len(values)
    if score == "class size":
        return f"| {score} | {mean:.2f} | | {AIMS[score]} | {count} |"
    low, high = wilson(mean, count)
    return f"| {score} | {100 * mean:.0f} % | {100 * low:.0f} to {100 * high:.0f} % | {AIMS.get(score, '')} | {count} |"


def _read(folder: Path, labels: dict[str, Any]) -> dict[str, dict[str, Any]]:
    files = {file.stem: file for file in folder.glob("*.json")}
    return {name: json.loads(file.read_text(encoding="utf-8")) for name, file in files.items() if name in labels}


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m blind.score", description=__doc__)
    parser.add_argument("diagnoses", type=Path, help="a folder of CASE.json")
    parser.add_argument("labels", type=Path, help="labels.json")
    parser.add_argument("--healthy", type=Path, help="a folder of CASE.json")
    parser.add_argument("--out", type=Path)
    arguments = parser.parse_args()
    text = arguments.labels.read_text(encoding="utf-8")
    labels = json.loads(text)
    diagnoses = _read(arguments.diagnoses, labels)
    healthy = _read(arguments.healthy, labels) if arguments.healthy else {}
    result = page(diagnoses, labels, healthy, hashlib.sha256(text.encode()).hexdigest())
    if arguments.out:
        arguments.out.write_text(result, encoding="utf-8")
    print(result)


if __name__ == "__main__":
    main()

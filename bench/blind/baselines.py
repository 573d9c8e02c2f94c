"""`python -m blind.baselines CASES OUT --labels DEVELOPMENT.json`: what plain ways of selection make of the cases.

They choose among the columns that the diagnosis has, so that only the way of choosing differs. Writes
OUT/BASELINE/CASE.json in the form of a diagnosis, which `blind.score` and `blind.compare` read; resumable. They say
which effect acts in which joint, and nothing of regimes or of how far the gap shrinks.
"""

from __future__ import annotations

import argparse
import json
import time
from collections import Counter
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import scipy

from blind.library import Explained, Library, power_library, swept, torque_library
from irtwin.gap.data.case import Case, case_of
from irtwin.gap.regression.hypotheses import Hypothesis, Variant
from irtwin.gap.thresholds import DEFAULT
from irtwin.signals.log import read_data_set

STEPS = 20  # of forward selection, at most
STRONG = 6.0  # of BIC (Kass and Raftery 1995): rivals that are nearer are not told apart
ALPHA = 0.01  # of the F-test, over all hypotheses (Bonferroni)
BOOTSTRAPS = 50
# both chosen on 20 development cases, torque alone: first right most often, then fewest alarms on clean nulls
THRESHOLD = 0.01  # of the residual's mean square: columns that add less are set to zero
RIDGE = 0.01  # of a column's own square
INCLUDED = 0.6  # of the bootstraps (Fasel et al. 2022)


@dataclass(frozen=True)
class Choice:
    """A hypothesis chosen in one shape; the larger `rank` the sooner; `confidence` as the way of choosing gives it."""

    hypothesis: Hypothesis
    variant: Variant
    rank: tuple[float, float]
    confidence: float
    rivals: tuple[str, ...] = ()


Select = Callable[[Library], list[Choice]]


def bic_greedy(library: Library) -> list[Choice]:
    """Add what lowers BIC the most, sample by sample, until nothing does."""
    return _forward(library, _by_bic)


def f_test(library: Library) -> list[Choice]:
    """Add what the F-test over samples finds the most significant, until nothing is."""
    return _forward(library, _by_f)


def e_sindy(library: Library) -> list[Choice]:
    """Choose by inclusion probability in bootstrapped, sequentially thresholded least squares over the whole library.

    Fasel, Kutz, Brunton and Brunton 2022 (E-SINDy); runs are drawn instead of samples. Each effect stands there in
    the shape that explains the most alone, as least squares cannot choose among near copies.
    """
    single = [h for h in library.hypotheses if h.joint is not None or len({t.joint for t in h.variants[0].terms}) == 1]
    left = library.beside_the_twin(library.total)
    variants = [h.variants[_gains(left, h.variants, library)[1]] for h in single]
    columns = np.array(sorted({k for variant in variants for k in variant.columns}))
    place = {int(k): p for p, k in enumerate(columns)}
    generator = np.random.default_rng(0)
    draws = []
    for _ in range(BOOTSTRAPS):
        drawn = np.bincount(generator.integers(len(library.groups), size=len(library.groups)))
        products = np.sum([count * library.groups[g] for g, count in enumerate(drawn) if count], axis=0)
        draws.append(thresholded(library.beside_the_twin(products)[np.ix_([*columns, -1], [*columns, -1])]))
    included, size = np.mean(np.array(draws) > 0, axis=0), np.mean(draws, axis=0)
    choices = []
    for hypothesis, variant in zip(single, variants, strict=True):
        own = [place[k] for k in variant.columns]
        chance = float(included[own].max())
        if chance >= INCLUDED:
            choices.append(Choice(hypothesis, variant, (chance, float(size[own].sum())), chance))
    return choices


BASELINES: dict[str, Select] = {"bic_greedy": bic_greedy, "f_test": f_test, "e_sindy": e_sindy}


def thresholded(products: np.ndarray) -> np.ndarray:
    """Return the share of the mean square that each of M columns adds, by STLSQ on (M + 1, M + 1) products.

    Sequentially thresholded least squares (Brunton, Proctor and Kutz 2016): what adds less than THRESHOLD is set to
    zero, the rest fitted again; ridge as in PySINDy.
    """
    normal, right, square = products[:-1, :-1], products[:-1, -1], products[-1, -1]
    inside = np.arange(len(right))
    while True:
        own = normal[np.ix_(inside, inside)]
        values = np.linalg.solve(own + np.diag(1 + RIDGE * np.diag(own)), right[inside])
        adds = values**2 * np.diag(own) / square
        if (adds >= THRESHOLD).all():
            break
        inside = inside[adds >= THRESHOLD]
    share = np.zeros(len(right))
    share[inside] = adds
    return share


@dataclass(frozen=True)
class _Verdicts:
    """What a criterion says of H hypotheses: what ranks them, whether each is taken, and how sure it is."""

    rank: np.ndarray
    taken: np.ndarray
    confidence: np.ndarray
    near: float  # ranks that differ by less are not told apart


Criterion = Callable[[float, np.ndarray, np.ndarray, float, int], _Verdicts]


def _by_bic(before: float, gain: np.ndarray, count: np.ndarray, rows: float, used: int) -> _Verdicts:
    lower = -rows * np.log1p(-np.minimum(gain / before, 1 - 1e-12)) - count * np.log(rows)
    return _Verdicts(lower, lower > 0, scipy.special.expit(lower / 2), STRONG)


def _by_f(before: float, gain: np.ndarray, count: np.ndarray, rows: float, used: int) -> _Verdicts:
    free = rows - used - count
    ratio = gain / count / (np.maximum(before - gain, 1e-12 * before) / free)
    log_p = np.maximum(scipy.stats.f.logsf(ratio, count, free), -1e6)
    log_p -= ratio * 1e-9  # which still ranks what underflows
    return _Verdicts(-log_p, log_p < np.log(ALPHA / len(gain)), -np.expm1(log_p), 0.0)


def _forward(library: Library, criterion: Criterion) -> list[Choice]:
    left = library.beside_the_twin(library.total)
    candidates, chosen = list(library.hypotheses), list[Choice]()
    used = library.system.base
    while candidates and len(chosen) < STEPS:
        tried = [_gains(left, hypothesis.variants, library) for hypothesis in candidates]
        gain, count = np.array([gain for gain, _ in tried]), np.array([_count(each) for each in candidates])
        said = criterion(float(left[-1, -1]), gain, count, library.rows, used)
        best = int(np.argmax(said.rank))
        if not said.taken[best]:
            break
        hypothesis, variant = candidates[best], candidates[best].variants[tried[best][1]]
        near = np.flatnonzero(said.taken & (said.rank[best] - said.rank < said.near))
        rivals = dict.fromkeys(candidates[k].effect for k in near if candidates[k].effect != hypothesis.effect)
        chosen.append(
            Choice(hypothesis, variant, (float(said.rank[best]), 0.0), float(said.confidence[best]), tuple(rivals))
        )
        left = swept(left, variant.columns)
        used += len(variant.columns)
        candidates = [each for each in candidates if not _overlap(each, hypothesis)]
    return chosen


def _count(hypothesis: Hypothesis) -> int:
    """Return how many coefficients a hypothesis has, its shape counted as one where there are several."""
    return len(hypothesis.variants[0].columns) + (len(hypothesis.variants) > 1)


def _overlap(one: Hypothesis, other: Hypothesis) -> bool:
    same = (one.effect, one.scope) == (other.effect, other.scope)
    return same and (one.joint == other.joint or None in (one.joint, other.joint))


def _gains(left: np.ndarray, variants: Sequence[Variant], library: Library) -> tuple[float, int]:
    """Return the squares that the best variant explains, and its place; none where a coefficient breaks its bound."""
    gains = [_gain(left, variant, library) for variant in variants]
    best = int(np.argmax(gains))
    return gains[best], best


def _gain(left: np.ndarray, variant: Variant, library: Library) -> float:
    columns = np.array(variant.columns)
    right = left[columns, -1]
    values = np.linalg.solve(left[np.ix_(columns, columns)] + np.eye(len(columns)), right)
    lowest = np.array([term.lowest for term in variant.terms]) / library.system.scale[columns]
    lowest[columns >= library.system.changed] = -np.inf
    return 0.0 if (values < lowest).any() else float(values @ right)


def majority(labels: dict[str, Any]) -> dict[str, Any]:
    """Return the cause that is the commonest among the cases with a single effect, its confidence its share there."""
    singles = [
        label["effects"][0] | {"scope": label["scope"]} for label in labels.values() if label["kind"] == "single"
    ]
    (effect, count), *_ = Counter(one["effect"] for one in singles).most_common(1)
    own = [one for one in singles if one["effect"] == effect]
    joints = Counter(tuple(one["joints"]) for one in own).most_common(1)[0][0]
    scope = Counter(one["scope"] for one in own).most_common(1)[0][0]
    return _cause(effect, scope, joints, count / len(singles), ())


def _cause(effect: str, scope: str, joints: Sequence[str], confidence: float, rivals: Sequence[str]) -> dict[str, Any]:
    return {
        "effect": effect,
        "joints": list(joints),
        "scope": scope,
        "confidence": confidence,
        "parameters": [],
        "indistinguishable_from": list(rivals),
    }


def document(robot: str, causes: Sequence[dict[str, Any]], seconds: float) -> dict[str, Any]:
    """Return causes in the form of a diagnosis."""
    ambiguous = any(cause["indistinguishable_from"] for cause in causes)
    return {
        "verdict": "ambiguous" if ambiguous else "attributed" if causes else "no_gap",
        "robot": robot,
        "gap": {},
        "locations": [],
        "causes": list(causes),
        "not_testable": [],
        "shrink": {},
        "next_experiment": None,
        "seconds": round(seconds, 2),
    }


def causes_of(choices: Sequence[Choice]) -> list[dict[str, Any]]:
    """Join choices of one effect and scope into a cause; causes in the order of their best choice."""
    causes: dict[tuple[str, str], list[Choice]] = {}
    for choice in sorted(choices, key=lambda choice: choice.rank, reverse=True):
        causes.setdefault((choice.hypothesis.effect, choice.hypothesis.scope), []).append(choice)
    return [
        _cause(effect, scope, [c.hypothesis.joint for c in own if c.hypothesis.joint], own[0].confidence, own[0].rivals)
        for (effect, scope), own in causes.items()
    ]


def answers(case: Case, names: Sequence[str]) -> dict[str, dict[str, Any]]:
    """Return what each baseline says of a case that has torque; power is judged on the torque that it explained."""
    started = time.perf_counter()
    torque, left_out = torque_library(case)
    shared = time.perf_counter() - started
    found = {}
    for name in names:
        started = time.perf_counter()
        choices = BASELINES[name](torque)
        if case.with_power:
            explained = Explained(case, torque, left_out, [choice.variant for choice in choices])
            choices = choices + BASELINES[name](power_library(case, explained))
        found[name] = document(case.robot.name, causes_of(choices), shared + time.perf_counter() - started)
    return found


def answer_case(task: tuple[Path, Path, dict[str, Any] | None]) -> str:
    """Write OUT/BASELINE/CASE.json for each; an error is written too, as it counts."""
    folder, out, commonest = task
    names = [name for name in BASELINES if not (out / name / f"{folder.name}.json").exists()]
    try:
        case = case_of(read_data_set(folder), (), DEFAULT)
        found = answers(case, names) if names else {}
        if commonest:
            found["majority"] = document(case.robot.name, [commonest], 0.0)
    except Exception as error:
        found = {name: {"error": f"{type(error).__name__}: {error}"} for name in names}
    for name, answer in found.items():
        (out / name).mkdir(parents=True, exist_ok=True)
        (out / name / f"{folder.name}.json").write_text(json.dumps(answer), encoding="utf-8")
    return f"{folder.name} " + ", ".join(f"{name}: {_first(answer)}" for name, answer in found.items())


def _first(answer: dict[str, Any]) -> str:
    causes = answer.get("causes", [])
    return causes[0]["effect"] if causes else answer.get("verdict", answer.get("error", ""))


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m blind.baselines", description=__doc__.splitlines()[0])
    parser.add_argument("cases", type=Path)
    parser.add_argument("out", type=Path)
    parser.add_argument("--labels", type=Path, help="labels of the development cases, for the majority class")
    parser.add_argument("--first", type=int, help="take only so many cases")
    parser.add_argument("--workers", type=int, default=2)
    arguments = parser.parse_args()
    commonest = majority(json.loads(arguments.labels.read_text(encoding="utf-8"))) if arguments.labels else None
    folders = sorted(arguments.cases.glob("case_*"))[: arguments.first]
    with ProcessPoolExecutor(arguments.workers) as pool:
        for line in pool.map(answer_case, [(folder, arguments.out, commonest) for folder in folders]):
            print(line, flush=True)


if __name__ == "__main__":
    main()

"""`python -m blind.fit_confidence DIAGNOSES LABELS`: fit the confidence to causes named in development cases.

A cause is right where its effect is one of the label's, a finding where its family is that of one of them. Prints the
weights for `irtwin.gap.thresholds.Confidence`, the expected calibration error of the shipped weights and,
cross-validated over cases, of the fitted ones, and by how much the families' confidences are off.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy.optimize import minimize, minimize_scalar
from scipy.special import expit

from blind.compare import answers
from blind.score import calibration, calibration_of_true_confidences, ranked
from irtwin.effects.catalogue import catalogue
from irtwin.gap.isolation.confidence import as_large_as, confidence
from irtwin.gap.thresholds import DEFAULT, Confidence

FITTED = ("constant", "per_t", "per_closed", "per_gain", "per_share", "per_count", "unexplained")
_FOLDS = 10
_RIDGE = 1e-3  # of the squared weights but the constant's, a cause: what the causes do not tell stays small


@dataclass(frozen=True)
class Named:
    """A cause that was named: what its confidence depends on, and whether it is right."""

    case: str
    t: float
    gain: float
    closed: float
    share: float
    count: float
    unexplained: bool
    right: bool

    def logit(self, weights: Confidence) -> float:
        """Return the logarithm of the odds that weights give."""
        sure = confidence(self.t, self.gain, self.closed, self.share, self.count, weights, unexplained=self.unexplained)
        return float(np.log(sure / (1 - sure)))


def named(diagnoses: Mapping[str, Any], labels: Mapping[str, Any]) -> Iterator[Named]:
    """Yield the causes of the cases that have a label."""
    for case in sorted(set(diagnoses) & set(labels)):
        causes, true = ranked(diagnoses[case]), {effect["effect"] for effect in labels[case]["effects"]}
        most = max((cause["evidence"]["gain_on_groups_left_out"] for cause in causes), default=1.0)
        for cause in causes:
            evidence = cause["evidence"]
            yield Named(
                case,
                evidence["t_between_groups"],
                evidence["gain_on_groups_left_out"],
                evidence["closed_where_it_acts"],
                min(evidence["gain_on_groups_left_out"] / most, 1.0),
                as_large_as(
                    evidence["gain_on_groups_left_out"],
                    [other["evidence"]["gain_on_groups_left_out"] for other in causes],
                ),
                _left_open(diagnoses[case]),
                cause["effect"] in true,
            )


def _left_open(diagnosis: Mapping[str, Any]) -> bool:
    """Return whether a gap is unexplained for another reason than that its causes are unsure, which they decide."""
    return diagnosis["verdict"] == "unexplained" and diagnosis.get("unexplained_because") != "unsure"


def families(diagnoses: Mapping[str, Any], labels: Mapping[str, Any]) -> Iterator[tuple[float, bool]]:
    """Yield the confidence of each finding of the cases that have a label, and whether its family is right."""
    known = catalogue()
    for case in sorted(set(diagnoses) & set(labels)):
        true = {known[one["effect"]].family for one in labels[case]["effects"] if one["effect"] in known}
        for finding in diagnoses[case].get("findings", ()):
            yield finding["confidence"], finding["family"] in true


def more(found: list[tuple[float, bool]]) -> float:
    """Return what findings' confidences lack, in logits: what makes what is there likeliest, drawn towards 0."""
    given = np.clip([sure for sure, _ in found], 1e-6, 1 - 1e-6)
    right = np.array([is_right for _, is_right in found], dtype=float)
    plain = np.log(given / (1 - given))

    def loss(shift: float) -> float:
        logit = plain + shift
        return float(np.logaddexp(0.0, logit).sum() - right @ logit + 0.5 * shift**2)

    return float(minimize_scalar(loss, bounds=(-4.0, 4.0), method="bounded").x)


def fit(causes: list[Named]) -> Confidence:
    """Return the weights of a logistic regression on causes; the bounds of t and gain stay."""
    none = replace(DEFAULT.confidence, **dict.fromkeys(FITTED, 0.0))
    features = np.array([[one.logit(replace(none, **{name: 1.0})) for name in FITTED] for one in causes])
    right = np.array([one.right for one in causes], dtype=float)

    def loss(weights: np.ndarray) -> tuple[float, np.ndarray]:
        logit = features @ weights
        small = len(right) * _RIDGE * np.append(0.0, weights[1:])
        value = np.logaddexp(0.0, logit).sum() - right @ logit + 0.5 * small @ weights
        return float(value), features.T @ (expit(logit) - right) + small

    found = minimize(loss, np.zeros(len(FITTED)), jac=True, method="BFGS")
    return replace(none, **{name: float(value) for name, value in zip(FITTED, found.x, strict=True)})


def error(causes: list[Named], weights: list[Confidence]) -> float:
    """Return the expected calibration error of causes, each by its own weights."""
    given = zip(causes, weights, strict=True)
    return calibration([(float(expit(one.logit(own))), one.right) for one, own in given])[0]


def cross_validated(causes: list[Named]) -> list[Confidence]:
    """Return for each cause the weights fitted without a tenth of the cases, its own among them."""
    cases = sorted({one.case for one in causes})
    fold = {case: place % _FOLDS for place, case in enumerate(np.random.default_rng(0).permutation(cases).tolist())}
    own = [fit([one for one in causes if fold[one.case] != k]) for k in range(_FOLDS)]
    return [own[fold[one.case]] for one in causes]


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m blind.fit_confidence", description=__doc__)
    parser.add_argument("diagnoses", type=Path, help="folder of CASE.json, of a development split")
    parser.add_argument("labels", type=Path)
    given = parser.parse_args()
    diagnoses, labels = answers(given.diagnoses), json.loads(given.labels.read_text(encoding="utf-8"))
    causes, found = list(named(diagnoses, labels)), list(families(diagnoses, labels))
    if found:
        print(f"{len(found)} findings, {100 * np.mean([right for _, right in found]):.0f} % of them of a right family")
        print(f"family_more = {more(found):.3f} beyond what they were given with; error {calibration(found)[0]:.3f}")
    right = sum(one.right for one in causes)
    print(f"{len(causes)} causes, {100 * right / max(len(causes), 1):.0f} % of them right")
    weights = fit(causes)
    for name in FITTED:
        print(f"{name} = {getattr(weights, name):.3f}  (shipped: {getattr(DEFAULT.confidence, name):.3f})")
    shipped = error(causes, [DEFAULT.confidence] * len(causes))
    fitted = error(causes, cross_validated(causes))
    mean, most = calibration_of_true_confidences([expit(one.logit(DEFAULT.confidence)) for one in causes])
    print(f"expected calibration error: shipped {shipped:.3f}, fitted and cross-validated {fitted:.3f}")
    print(f"as many true confidences would have {mean:.3f}, up to {most:.3f}")


if __name__ == "__main__":
    main()

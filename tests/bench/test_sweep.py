"""A threshold swept over cases, and the confidence fitted to causes of which the truth is known."""

import json

import numpy as np
import pytest
from scipy.special import expit

from blind.fit_confidence import FITTED, Named, cross_validated, error, fit, named
from blind.score import calibration, calibration_of_true_confidences
from blind.sweep import listed, sweep
from irtwin.errors import InputError
from irtwin.gap.thresholds import DEFAULT


def test_every_threshold_is_listed():
    assert all(f"| `{one.name}` | {one.value} |" in listed() for one in DEFAULT.listed())


def test_an_unknown_threshold_is_refused_before_anything_is_diagnosed(tmp_path):
    with pytest.raises(InputError, match="there is no threshold"):
        sweep(tmp_path, tmp_path / "labels.json", tmp_path / "out", "selection.nothing", [1.0])
    assert not (tmp_path / "out").exists()


def test_few_causes_leave_an_error_of_calibration_whatever_the_confidence():
    rng = np.random.default_rng(3)
    given = rng.uniform(0, 1, 4000)
    right = rng.uniform(size=4000) < given
    few, most = calibration_of_true_confidences(given[:60].tolist(), draws=200)
    many, _ = calibration_of_true_confidences(given.tolist(), draws=20)
    assert many < 0.03 < few < most
    assert calibration(zip(given, right, strict=True))[0] == pytest.approx(many, abs=0.02)


@pytest.mark.slow
def test_weights_are_found_again():
    rng = np.random.default_rng(1)
    true = DEFAULT.confidence
    causes = []
    for number in range(6000):
        gain, closed, count = 10 ** rng.uniform(-3, 0), rng.uniform(0, 1), int(rng.integers(1, 4))
        one = Named(
            f"case_{number}", rng.uniform(0, 12), gain, closed, rng.uniform(0.1, 1), count, bool(rng.integers(2)), False
        )
        causes.append(Named(**{**vars(one), "right": bool(rng.uniform() < expit(one.logit(true)))}))
    found = fit(causes)
    for name in FITTED:
        assert getattr(found, name) == pytest.approx(getattr(true, name), abs=0.35), name
    assert error(causes, [true] * len(causes)) < 0.03
    assert error(causes[:600], cross_validated(causes[:600])) < 0.08


def test_a_cause_is_right_where_the_label_has_its_effect():
    evidence = {"t_between_groups": 3.0, "gain_on_groups_left_out": 0.2, "closed_where_it_acts": 0.9}
    cause = {"effect": "payload", "evidence": evidence}
    other = {"effect": "backlash", "evidence": evidence | {"gain_on_groups_left_out": 0.1}}
    diagnoses = {"case_1": {"verdict": "attributed", "causes": [cause, other]}, "case_2": {"error": "x", "causes": []}}
    labels = {"case_1": {"effects": [{"effect": "payload"}]}, "case_2": {"effects": []}}
    assert [(one.right, one.share, one.count) for one in named(json.loads(json.dumps(diagnoses)), labels)] == [
        (True, 1.0, 1.5),  # one of half its gain counts half
        (False, 0.5, 2),
    ]

"""A threshold swept over cases, and how far confidences are off in few of them."""

import numpy as np
import pytest

from blind.score import calibration, calibration_of_true_confidences
from blind.sweep import listed, sweep
from irtwin.errors import InputError
from irtwin.gap.thresholds import DEFAULT


def test_every_threshold_is_listed():
    assert all(f"| `{one.name}` | {one.value} |" in listed() for one in DEFAULT.listed())


def test_an_unknown_threshold_is_refused_before_anything_is_diagnosed(tmp_path):
    with pytest.raises(InputError, match="there is no threshold"):
        sweep(tmp_path, tmp_path / "labels.json", tmp_path / "out", "criterion.nothing", [1.0])
    assert not (tmp_path / "out").exists()


def test_few_causes_leave_an_error_of_calibration_whatever_the_confidence():
    rng = np.random.default_rng(3)
    given = rng.uniform(0, 1, 4000)
    right = rng.uniform(size=4000) < given
    few, most = calibration_of_true_confidences(given[:60].tolist(), draws=200)
    many, _ = calibration_of_true_confidences(given.tolist(), draws=20)
    assert many < 0.03 < few < most
    assert calibration(zip(given, right, strict=True))[0] == pytest.approx(many, abs=0.02)

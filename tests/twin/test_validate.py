from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from tests.synthetic import arm, measure, swing, with_constants

from irtwin.signals.filter import low_pass
from irtwin.twin.identify import identify
from irtwin.twin.validate import validate

ROBOT = with_constants(arm(2))
TWIN = identify(ROBOT, [measure(ROBOT, swing(ROBOT, 1), noise=0.1)])


def test_every_run_is_judged_by_joint():
    motions = [measure(ROBOT, swing(ROBOT, seed), noise=0.5, seed=seed) for seed in (2, 3)]
    fits = validate(TWIN, motions)
    assert [fit.run for fit in fits] == ["swing_2", "swing_3"]
    for fit, motion in zip(fits, motions, strict=True):
        np.testing.assert_allclose(fit.torque_rmse, 0.5, rtol=0.15)
        assert fit.modelled_energy == pytest.approx(TWIN.energy(motion))
        assert fit.measured_energy == pytest.approx(np.trapezoid(motion.power, motion.time))
        assert fit.energy_error == pytest.approx(abs(fit.modelled_energy / fit.measured_energy - 1) * 100)


def test_the_model_is_judged_in_the_band_of_the_measurement():
    motion = swing(ROBOT, 4)
    filtered = replace(motion, torque=low_pass(TWIN.torque(motion), 100, 2.0), cutoff=2.0)
    (fit,) = validate(TWIN, [filtered])
    assert fit.torque_rmse.max() < 1e-9
    (blind,) = validate(TWIN, [replace(filtered, cutoff=None)])
    assert blind.torque_rmse.min() > 0.1  # friction jumps where the filtered one does not


def test_a_motion_that_was_not_measured_has_only_a_modelled_energy():
    (fit,) = validate(TWIN, [swing(ROBOT, 5)])
    assert fit.modelled_energy > 0
    assert fit.torque_rmse is fit.r_squared is fit.power_rmse is fit.power_r_squared is fit.energy_error is None

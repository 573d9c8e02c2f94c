"""On and off, told from power beside a motion that takes more than the load."""

from __future__ import annotations

import numpy as np
import pytest

from irtwin.gap.repeats.series import Series
from irtwin.gap.repeats.switching import two_levels

TIME = np.arange(1000) / 125


@pytest.mark.parametrize("duty", [0.1, 0.5, 0.8])
@pytest.mark.parametrize("trust", [0.1, 1.0])
def test_two_levels_are_told_beside_the_motion(duty, trust):
    rng = np.random.default_rng(0)
    motion = np.column_stack([np.ones(1000), np.sin(2 * TIME), np.abs(np.cos(2 * TIME)), np.sin(3 * TIME) ** 2])
    runs, true = {}, {}
    for name in ("first", "second"):
        true[name] = (TIME / 1.5 + rng.random()) % 1 < duty
        values = motion @ [50.0, 300.0, -200.0, 100.0] + 12.0 * true[name] + 2.0 * rng.standard_normal(1000)
        runs[name] = Series(TIME, values, motion)
    told = two_levels(runs, trust)
    assert np.mean([np.mean(told[name] == true[name]) for name in runs]) > 0.95

"""What a model saves: twice the likelihood of samples that are independent, and less of those that are not."""

from __future__ import annotations

import numpy as np
import pytest

from irtwin.gap.repeats.switching import saved


def test_white_noise_is_worth_its_likelihood():
    after = np.random.default_rng(0).standard_normal(2000)
    assert saved([2 * after], [after]) == pytest.approx(2000 / 2 * np.log(4), rel=0.1)


def test_each_series_saves_by_itself():
    after = np.random.default_rng(0).standard_normal(500)
    assert saved([2 * after, after], [after, after]) == pytest.approx(saved([2 * after], [after]))


def test_what_remembers_says_less():
    after = np.convolve(np.random.default_rng(0).standard_normal(2000), np.ones(20), "valid")
    assert saved([2 * after], [after]) < 0.1 * len(after) / 2 * np.log(4)

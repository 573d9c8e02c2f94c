"""What reference runs leave over one another, on squares that are known."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from irtwin.gap.isolation.apart import spread

ALL = slice(None)


def system(*squares, observed=1):
    """Groups whose mean squares (g,) no fit changes, those of the reference runs first."""
    of_group = np.array(squares)

    def rms(chosen, noise, fitted, of):
        return np.sqrt(of_group[list(of)].mean(axis=0))

    seen = np.arange(len(of_group)) >= len(of_group) - observed
    noise = np.ones(len(of_group[0]))
    return SimpleNamespace(noise_before=noise, group_observed=seen, of_group=of_group, rms=rms)


def test_runs_that_are_alike_leave_nothing_over_one_another():
    assert spread(system(*[[2.0, 3.0]] * 5), np.ones(2), ALL) == pytest.approx(0.0)


def test_the_loudest_half_counts_at_its_worst_joint_and_observed_runs_do_not():
    squares = [[1.0, 1.0], [1.0, 1.0], [1.0, 5.0], [1.0, 5.0], [100.0, 100.0]]
    assert spread(system(*squares), np.ones(2), ALL) == pytest.approx(4.0)


def test_below_the_floor_all_are_alike():
    assert spread(system([0.1], [0.2], [0.3], [0.4], [9.0]), np.ones(1), ALL) < 0


def test_three_groups_have_no_halves():
    assert spread(system([1.0], [1.0], [1.0], [9.0]), np.ones(1), ALL) is None

from __future__ import annotations

import pytest

from irtwin.identification.excitation import expected_seconds

MEASURED = {7: 16.5, 12: 34.3, 30: 90.8}  # s of a shared processor, chains of so many joints, motions of 20 s


@pytest.mark.parametrize("joints", MEASURED)
def test_it_is_within_a_factor_of_two_of_what_was_measured(joints):
    assert MEASURED[joints] / 2 <= expected_seconds(joints, 20.0) <= 2 * MEASURED[joints]


def test_more_joints_take_more_until_the_search_reaches_its_most_work():
    assert expected_seconds(3, 20.0) < expected_seconds(6, 20.0) < expected_seconds(12, 20.0)
    assert expected_seconds(40, 20.0) < 2 * expected_seconds(20, 20.0)

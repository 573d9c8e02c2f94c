"""Where a signal that is sampled apart is known."""

import numpy as np

from irtwin.signals.holes import known_at


def test_a_value_is_known_between_its_own_times_but_for_holes() -> None:
    times = np.concatenate([np.arange(10), 50 + np.arange(10)]) / 10
    wanted = np.array([-0.1, 0.0, 0.25, 0.9, 3.0, 5.0, 5.9, 6.0])
    assert known_at(wanted, times).tolist() == [False, True, True, True, False, True, True, False]
    assert known_at(np.array([1.0, 2.0]), np.array([1.0])).tolist() == [True, False]

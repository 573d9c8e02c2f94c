"""A stated cutoff: between what the longest run and the slowest rate allow."""

from __future__ import annotations

import math

import numpy as np
import pytest

from irtwin.errors import InputError
from irtwin.signals.channels import Signals
from irtwin.signals.sampling import checked_cutoff


def logged(seconds: float, rate: float) -> Signals:
    time = np.arange(round(seconds * rate) + 1) / rate
    return Signals(time, np.zeros((len(time), 1)))


RUNS = [logged(20.0, 100.0), logged(5.0, 40.0)]


@pytest.mark.parametrize("hz", [0.5, 3.0, 19.9])
def test_what_runs_can_be_filtered_with_is_taken_as_it_is(hz: float) -> None:
    assert checked_cutoff(hz, RUNS, "cutoff") == hz


@pytest.mark.parametrize("hz", [0.0, -3.0, math.nan, math.inf, 1e9, 0.49, 20.01])
def test_any_other_is_refused_in_a_line(hz: float) -> None:
    with pytest.raises(InputError) as refused:
        checked_cutoff(hz, RUNS, "dataset.toml: [twin] cutoff")
    assert str(refused.value) == (
        "dataset.toml: [twin] cutoff should be at least 0.5 Hz, 10 periods in the longest run, and below 20 Hz, half "
        f"the slowest sampling rate, not {hz:g} Hz"
    )

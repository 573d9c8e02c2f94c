import numpy as np
import pytest

from irtwin.report.energy.sampling import extremes


def test_a_spike_of_one_sample_survives_in_either_signal():
    measured, modelled = np.zeros(100_000), np.zeros(100_000)
    measured[31_415], modelled[27_182] = 1.0, -1.0
    kept = extremes([measured, modelled], 500)
    assert len(kept) <= 500
    assert {31_415, 27_182, 0, 99_999} <= set(kept)
    assert np.all(np.diff(kept) > 0)


def test_few_samples_are_all_kept():
    assert extremes([np.arange(10.0)], 10).tolist() == list(range(10))


@pytest.mark.parametrize("count", [11, 999, 1001, 4_999])
def test_indices_stay_inside_whatever_the_count(count: int):
    kept = extremes([np.sin(np.arange(count)), np.full(count, np.nan)], 10)
    assert kept[0] == 0 and kept[-1] == count - 1 and len(kept) <= 10

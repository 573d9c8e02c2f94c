import gzip
import json
import re
from base64 import b64decode

import numpy as np
import pytest

from irtwin.packing import embedded_json, extremes, pack, packed_scripts
from tests.virtual.scene_data import HOSTILE, unpack


def test_packed_values_come_back_within_half_a_step_and_absent_ones_stay_absent():
    values = np.random.default_rng(0).normal(3.0, 50.0, 1_000)
    values[7] = np.nan
    back = unpack(pack(values))
    assert np.isnan(back[7])
    assert np.nanmax(np.abs(back - values)) <= np.ptp(values[np.isfinite(values)]) / 65_534


@pytest.mark.parametrize("values", [[2.5, 2.5], [np.nan, np.nan], []])
def test_values_without_range_are_packed_too(values: list[float]):
    np.testing.assert_array_equal(unpack(pack(np.array(values))), values)


def test_scripts_come_back_in_their_order_and_none_can_end_its_element():
    scripts = ["let text = '</script><b>';", "second();"]
    fragment = packed_scripts(scripts)
    packed = re.findall(r'<script type="application/gzip">([^<]*)</script>', fragment.html)
    assert [gzip.decompress(b64decode(text)).decode() for text in packed] == scripts
    assert fragment.scripts[:2] == tuple(scripts)
    assert fragment.html.endswith(f"<script>{fragment.scripts[2]}</script>")


def test_the_same_scripts_are_packed_to_the_same_bytes():
    assert packed_scripts(["a();"]) == packed_scripts(["a();"])


def test_json_cannot_break_out_of_its_element():
    text = embedded_json({HOSTILE: "\u2028&"})
    assert not set(text) & set("<>&\u2028")
    assert json.loads(text) == {HOSTILE: "\u2028&"}


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

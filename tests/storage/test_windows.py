"""Windows of a series: what row groups say agrees with all samples."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pyarrow as pa
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from irtwin.errors import InputError
from irtwin.storage import windows
from irtwin.storage.series import write_series
from irtwin.storage.windows import SeriesWindows

pytestmark = pytest.mark.slow

Known = tuple[SeriesWindows, np.ndarray]  # a series and its samples of power, (N,)

RNG = np.random.default_rng(3)
TIME = np.cumsum(RNG.uniform(0.5, 1.5, 1000)) + 100.0
POWER = 300.0 + 50.0 * RNG.normal(size=1000)
MOMENT = st.floats(90.0, 1200.0)


@pytest.fixture(scope="module", params=["whole", "gaps"])
def series(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Known:
    """The same samples in ten row groups, whole and with some missing."""
    folder = tmp_path_factory.mktemp("series")
    power = np.where(RNG.random(1000) < 0.1, np.nan, POWER) if request.param == "gaps" else POWER
    table = pa.table({"time": TIME, "power": power, 'odd "name': np.arange(1000)})
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("irtwin.storage.series.ROW_GROUP", 100)
        return SeriesWindows(folder / write_series(folder, table)[0]), power


def test_a_curve_is_all_samples_or_the_extremes_of_them(tmp_path: Path) -> None:
    time, spike = np.arange(50_000) / 100, np.zeros(50_000)
    spike[31_415] = 1 / 3
    file = SeriesWindows(tmp_path / write_series(tmp_path, pa.table({"time": time, "x": spike, "on": spike > 0}))[0])
    curve = file.curve("x", 0, 1e9)
    assert len(curve) <= windows.MOST_DRAWN and (314.15, 0.3333333) in curve and curve == sorted(curve)
    assert file.curve("on", 314.13, 314.15) == [(314.13, 0.0), (314.14, 0.0), (314.15, 1.0)]
    assert file.curve("x", 1e6, 1e9) == []
    with pytest.raises(InputError, match="no channel 'y'"):
        file.curve("y", 0, 1)


@settings(max_examples=25, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(one=MOMENT, other=MOMENT)
def test_mean_and_extremes_are_those_of_the_samples(series: Known, one: float, other: float) -> None:
    file, power = series
    start, end = sorted((one, other))
    inside = power[(start <= TIME) & (end >= TIME) & np.isfinite(power)]
    found = [file.mean("power", start, end), file.min("power", start, end), file.max("power", start, end)]
    if len(inside) == 0:
        assert found == [None, None, None]
    else:
        assert found == [pytest.approx(inside.mean(), rel=1e-12), inside.min(), inside.max()]


@settings(max_examples=25, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(moments=st.lists(MOMENT, min_size=3, max_size=3))
def test_integrals_are_those_of_the_line_through_the_samples(series: Known, moments: list[float]) -> None:
    file, power = series
    start, middle, end = sorted(moments)
    kept = np.isfinite(power)
    time, values = TIME[kept], power[kept]
    begin, stop = max(start, time[0]), min(end, time[-1])
    if begin > stop:
        assert file.integral("power", start, end) is None
        return
    inner = time[(time > begin) & (time < stop)]
    at = np.concatenate([[begin], inner, [stop]])
    expected = np.trapezoid(np.interp(at, time, values), at)
    assert file.integral("power", start, end) == pytest.approx(expected, rel=1e-9, abs=1e-6)
    parts = [file.integral("power", *window) or 0.0 for window in ((start, middle), (middle, end))]
    assert sum(parts) == pytest.approx(expected, rel=1e-9, abs=1e-6)


def test_windows_that_begin_and_end_on_samples_and_groups(series: Known) -> None:
    file, power = series
    for start, end in ((0, 999), (100, 199), (99, 200), (100, 200), (5, 5), (999, 999)):
        inside = power[start : end + 1]
        inside = inside[np.isfinite(inside)]
        if len(inside):
            assert file.mean("power", TIME[start], TIME[end]) == pytest.approx(inside.mean(), rel=1e-12)
    assert file.mean("power", -np.inf, np.inf) == pytest.approx(np.nanmean(power), rel=1e-12)
    assert file.begin == TIME[0]


def test_samples_and_names_that_need_quotes(series: Known) -> None:
    file, power = series
    found = file.samples("power", TIME[98], TIME[101])
    expected = [(TIME[i], power[i]) for i in range(98, 102) if np.isfinite(power[i])]
    assert found == expected
    assert file.max('odd "name', 0, 1e9) == 999
    assert file.integral('odd "name', TIME[3], TIME[4]) == pytest.approx(3.5 * (TIME[4] - TIME[3]))


@pytest.mark.parametrize(
    "ask",
    [
        lambda file: file.mean("powr", 0, 1),
        lambda file: file.min("time", 0, 1),
        lambda file: file.integral('power" FROM x --', 0, 1),
        lambda file: file.samples("", 0, 1),
    ],
)
def test_unknown_channels_are_named(series: Known, ask: Callable[[SeriesWindows], object]) -> None:
    with pytest.raises(InputError, match=r"no channel .*; there are power"):
        ask(series[0])


def test_too_many_samples_are_refused(series: Known, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(windows, "MOST_SAMPLES", 100)
    with pytest.raises(InputError, match="more than 100 samples"):
        series[0].samples("power", 0, 1e9)


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"none\.parquet: the series is missing"):
        SeriesWindows(tmp_path / "none.parquet")

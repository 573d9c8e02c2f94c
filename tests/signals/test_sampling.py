"""Runs with holes in time, with held positions, and at odd rates; a stated cutoff that fits to these."""

from __future__ import annotations

import math
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.data_sets import write
from tests.synthetic import arm, as_run, measure, swing

from irtwin.errors import InputError
from irtwin.signals.channels import Signals
from irtwin.signals.conditioning import choose_cutoff, condition
from irtwin.signals.log import Run, read_data_set
from irtwin.signals.sampling import as_sampled, checked_cutoff, interval
from irtwin.twin.identify import identify
from irtwin.twin.predict import predict

ROBOT = arm(2)
FILE = Path("runs/a.csv")


def signals(time: np.ndarray, hold: int = 1) -> Signals:
    rows = np.arange(len(time)) // hold * hold
    q = np.column_stack([np.sin(2 * time[rows]), np.cos(3 * time[rows])])
    return Signals(time, q, torque=np.ones_like(q), power=np.arange(len(time), dtype=float))


def run(seconds: float = 6.0) -> Run:
    return as_run(measure(ROBOT, swing(ROBOT, 1, seconds), noise=0.1))


def with_hole(whole: Run, at: int, seconds: float) -> Run:
    time = whole.signals.time.copy()
    time[at:] += seconds
    return replace(whole, signals=replace(whole.signals, time=time))


def test_an_even_run_stays_as_it_is():
    whole = signals(np.arange(500) / 100)
    pieces, said = as_sampled(whole, FILE)
    assert pieces == [whole]
    assert pieces[0] is whole
    assert said == []


def test_a_hole_in_time_cuts_a_run_in_two(tmp_path):
    folder = write(tmp_path / "set", ROBOT, [with_hole(run(), 200, 1000.0)])
    data_set = read_data_set(folder)
    first, second = data_set.runs
    assert (first.name, second.name) == ("swing_1", "swing_1.2")
    assert (len(first.signals.time), len(second.signals.time)) == (200, 400)
    assert second.signals.time[0] == pytest.approx(1002.0)
    assert second.payload_mass == first.payload_mass
    (finding,) = data_set.findings
    assert (finding.fault, finding.channel, finding.mended) == ("hole", "time", True)
    assert finding.say == f"{folder}/runs/swing_1.parquet: no samples from 1.99 s to 1002 s; taken as 2 runs"


def test_the_second_piece_started_when_its_samples_do(tmp_path):
    folder = write(tmp_path / "set", ROBOT, [with_hole(run(), 200, 1000.0)])
    file = folder / "dataset.toml"
    file.write_text(file.read_text() + "started = 2026-03-01T12:00:00Z\n")
    first, second = read_data_set(folder).runs
    assert first.started == datetime(2026, 3, 1, 12, tzinfo=UTC)
    assert second.started - first.started == timedelta(seconds=1002)


def test_a_repeat_of_a_run_in_pieces_repeats_the_first(tmp_path):
    again = replace(run(), name="again", repeat_of="swing_1")
    first, second, repeat = read_data_set(write(tmp_path / "set", ROBOT, [with_hole(run(), 200, 50.0), again])).runs
    assert repeat.repeat_of == first.name
    assert second.repeat_of is None


def test_a_piece_too_short_is_left_out_and_said():
    time = np.arange(300) / 100
    time[290:] += 1e9
    pieces, said = as_sampled(signals(time), FILE)
    assert [len(piece.time) for piece in pieces] == [290]
    (line,) = said
    assert line.say.endswith("taken as one run; 10 samples left out, in pieces of fewer than 20")


def test_nothing_but_holes_is_refused():
    time = np.arange(300) / 100 + 100.0 * (np.arange(300) // 10)
    with pytest.raises(InputError, match=r"29 holes in time, the first from 0.09 s to 100.1 s, leave 0 pieces"):
        as_sampled(signals(time), FILE)


def test_the_median_of_bursts_is_not_the_interval():
    time = np.cumsum(np.tile([1e-6, 1e-6, 0.02], 200))
    assert interval(time) == pytest.approx(0.005)
    assert as_sampled(signals(time), FILE)[1] == []


@pytest.mark.slow
@given(st.lists(st.floats(1e-6, 1e9), min_size=19, max_size=200))
def test_no_times_ask_for_many_more_rows_than_there_are_samples(gaps):
    time = np.cumsum([0.0, *gaps])
    if not (np.diff(time) > 0).all():
        return
    try:
        pieces, _ = as_sampled(signals(time), FILE)
    except InputError:
        return
    for piece in pieces:
        motion = condition(replace(run(), signals=piece), ROBOT, 1 / np.ptp(piece.time))
        assert len(motion.time) <= 7 * len(piece.time)


def test_conditioning_asks_for_no_rows_across_a_hole():
    with pytest.raises(InputError, match="has a hole in time"):
        condition(with_hole(run(), 200, 1e9), ROBOT, 5.0)


@pytest.mark.parametrize("hold", [2, 3, 5])
def test_held_positions_are_taken_at_the_rate_of_their_updates(hold):
    held = signals(np.arange(1500) / 500, hold)
    (piece,), (said,) = as_sampled(held, FILE)
    np.testing.assert_array_equal(piece.time, held.time[::hold])
    np.testing.assert_array_equal(piece.q, held.q[::hold])
    assert f"positions change at {500 / hold:.4g} Hz, samples are stamped at 500 Hz" in said.say


def test_a_standstill_of_held_positions_is_no_hole():
    time = np.arange(3000) / 500
    moved = np.minimum(time, 2.0) + np.maximum(time - 4.0, 0.0)  # stands from 2 s to 4 s
    held = replace(signals(time), q=np.column_stack([np.sin(2 * moved), np.cos(3 * moved)])[np.arange(3000) // 3 * 3])
    (piece,), _ = as_sampled(held, FILE)
    assert np.diff(piece.time).max() < 0.01
    assert len(piece.time) == 1000


def test_a_robot_that_stands_or_creeps_is_not_held():
    time = np.arange(1000) / 500
    still = replace(signals(time), q=np.zeros((1000, 2)))
    creeping = replace(signals(time), q=np.column_stack([np.round(0.1 * time, 3), np.zeros(1000)]))
    for each in (still, creeping):
        assert as_sampled(each, FILE) == ([each], [])


def test_the_cutoff_of_held_positions_is_that_of_the_motion():
    whole = as_run(swing(ROBOT, 1, 20.0, rate=500.0))
    rows = np.arange(len(whole.signals.time)) // 3 * 3
    held = replace(whole, signals=replace(whole.signals, q=whole.signals.q[rows]))
    (piece,), _ = as_sampled(held.signals, FILE)
    assert choose_cutoff([replace(held, signals=piece)]) == pytest.approx(choose_cutoff([whole]), rel=0.2)


def test_a_run_with_a_hole_is_predicted_on_either_side():
    whole = run()
    twin = identify(ROBOT, [condition(whole, ROBOT, 10.0)])
    cut = with_hole(whole, 300, 100.0)
    table, before = predict(twin, cut), predict(twin, replace(whole, signals=whole.signals.rows(slice(300))))
    np.testing.assert_array_equal(table["time"], cut.signals.time)
    np.testing.assert_allclose(table["tau_joint_1"][:300], before["tau_joint_1"])


def logged(seconds: float, rate: float) -> Signals:
    time = np.arange(round(seconds * rate) + 1) / rate
    return Signals(time, np.zeros((len(time), 1)))


TWO_RATES = [logged(20.0, 100.0), logged(5.0, 40.0)]


@pytest.mark.parametrize("hz", [0.5, 3.0, 19.9])
def test_what_runs_can_be_filtered_with_is_taken_as_it_is(hz: float) -> None:
    assert checked_cutoff(hz, TWO_RATES, "cutoff") == hz


@pytest.mark.parametrize("hz", [0.0, -3.0, math.nan, math.inf, 1e9, 0.49, 20.01])
def test_any_other_is_refused_in_a_line(hz: float) -> None:
    with pytest.raises(InputError) as refused:
        checked_cutoff(hz, TWO_RATES, "dataset.toml: [twin] cutoff")
    assert str(refused.value) == (
        "dataset.toml: [twin] cutoff should be at least 0.5 Hz, 10 periods in the longest run, and below 20 Hz, half "
        f"the slowest sampling rate, not {hz:g} Hz"
    )

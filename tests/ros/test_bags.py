"""Runs written as bags: to the last bit, and as ROS' own formats have it."""

from __future__ import annotations

from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from mcap.reader import make_reader
from tests.signals.bags import FORMS
from tests.signals.test_log import ROBOT

from irtwin.errors import InputError
from irtwin.ros.bags import write_bag
from irtwin.signals.channels import Signals
from irtwin.signals.samples import read_signals

STARTED = datetime(2026, 3, 2, 8, 0, 0, 250_000, tzinfo=UTC)
N = 40
VALUES = arrays(float, (N, 2), elements=st.floats(-1e4, 1e4, allow_subnormal=True))


def run(**channels: Any) -> Signals:
    time = np.arange(N) / 125
    q = np.column_stack([np.sin(time), np.cos(time)])
    return Signals(**{"time": time, "q": q, "torque": 10.0 * q, "power": 300.0 + time / 3.0, **channels})


@pytest.mark.slow
@pytest.mark.parametrize("form", FORMS)
@settings(
    max_examples=5,
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.differing_executors],
)
@given(torque=VALUES, temperature=arrays(float, (N, 2), elements=st.floats(-900, 900)), seed=st.integers(0, 1 << 30))
def test_a_run_comes_back_to_the_last_bit(
    form: str, torque: np.ndarray, temperature: np.ndarray, seed: int, tmp_path: Path
) -> None:
    path = next(place for number in range(1000) if not (place := tmp_path / str(number)).exists()) / form
    drawn = np.random.default_rng(seed)
    given = run(torque=torque, dq=drawn.normal(size=(N, 2)), temperature=temperature, power=drawn.normal(size=N))
    write_bag(path, ROBOT, given, STARTED)
    signals, said = read_signals(path, ROBOT)
    assert said == []
    assert signals.logged().keys() == given.logged().keys()
    for field, values in given.logged().items():
        assert np.array_equal(getattr(signals, field), values), field


def test_times_are_kept_to_the_nanosecond_and_begin_at_zero(tmp_path: Path) -> None:
    time = 1e3 + np.sort(np.random.default_rng(0).uniform(0.0, 10.0, N))
    write_bag(tmp_path / "run.bag", ROBOT, run(time=time), STARTED)
    signals, _ = read_signals(tmp_path / "run.bag", ROBOT)
    assert signals.time == pytest.approx(time - time[0], abs=1e-9)


def test_the_formats_own_reader_finds_ros_messages(tmp_path: Path) -> None:
    write_bag(tmp_path / "run.mcap", ROBOT, run(), STARTED)
    with (tmp_path / "run.mcap").open("rb") as file:
        reader = make_reader(file, validate_crcs=True)
        summary = reader.get_summary()
        messages, header = list(reader.iter_messages()), reader.get_header()
    assert summary is not None
    assert header.profile == "ros2"
    kinds = {channel.topic: summary.schemas[channel.schema_id].name for channel in summary.channels.values()}
    assert kinds == {"/joint_states": "sensor_msgs/msg/JointState", "/power": "std_msgs/msg/Float64"}
    assert {schema.encoding for schema in summary.schemas.values()} == {"ros2msg"}
    assert messages[0][2].log_time == 1_772_438_400_250_000_000
    assert len(messages) == 2 * N


def test_a_file_is_replaced_and_a_folder_is_not(tmp_path: Path) -> None:
    for _ in range(2):
        write_bag(tmp_path / "run.mcap", ROBOT, run(), STARTED)
    write_bag(tmp_path / "run", ROBOT, run(), STARTED)
    for name, what in (("run", "folder"), ("run.bag", "file")):
        (tmp_path / "run.bag").mkdir(exist_ok=True)
        with pytest.raises(InputError, match=f"{name}: is there already; name a new {what}"):
            write_bag(tmp_path / name, ROBOT, run(), STARTED)
    assert sorted(file.name for file in tmp_path.iterdir()) == ["run", "run.bag", "run.mcap"]


def test_times_that_ros_has_not_are_told(tmp_path: Path) -> None:
    for name, year, message in (
        ("run.bag", 1905, "the run began in 1905; ROS 1 counts seconds from 1970 to 2106"),
        ("run.mcap", 2040, "the run began in 2040; ROS 2 counts seconds from 1970 to 2038"),
    ):
        with pytest.raises(InputError, match=message):
            write_bag(tmp_path / name, ROBOT, run(), datetime(year, 1, 1, tzinfo=UTC))
    assert list(tmp_path.iterdir()) == []


def test_a_place_that_cannot_be_written_is_told(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    with pytest.raises(InputError, match="cannot be written"):
        write_bag(tmp_path / "file" / "run.mcap", ROBOT, run(), STARTED)

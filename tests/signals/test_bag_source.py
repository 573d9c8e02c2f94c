"""Runs that ROS recorded: which topics are taken, at what times, and what each fault is called."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from tests.signals.bags import FORMS, numbers, refused, states, write
from tests.signals.test_log import ROBOT, URDF

from irtwin.errors import InputError
from irtwin.robot.urdf import parse_urdf
from irtwin.signals.log import read_data_set
from irtwin.signals.samples import read_signals
from irtwin.signals.sources import bag_source

N = 50
Q = np.column_stack([np.sin(np.arange(N) / 9.0), np.cos(np.arange(N) / 7.0)])
TORQUE = 3.0 * Q + 1e-17
POWER = 100.0 + np.arange(N) / 3.0


@pytest.mark.parametrize("form", FORMS)
def test_a_bag_is_read_to_the_last_bit(form: str, tmp_path: Path) -> None:
    path = write(tmp_path / form, states(Q, effort=TORQUE, velocity=Q / 3), numbers("/meter/power", POWER))
    signals, said = read_signals(path, ROBOT)
    assert said == []
    assert np.array_equal(signals.time, np.arange(N) / 100)
    assert np.array_equal(signals.q, Q)
    assert np.array_equal(signals.dq, Q / 3)
    assert np.array_equal(signals.torque, TORQUE)
    assert np.array_equal(signals.power, POWER)


@pytest.mark.parametrize(("form", "compression"), [("run.bag", "bz2"), ("run.bag", "lz4"), ("run.mcap", "zstd")])
def test_compressed_chunks_are_inflated(form: str, compression: str, tmp_path: Path) -> None:
    path = write(tmp_path / form, states(Q, effort=TORQUE), numbers("/power", POWER), compression=compression)
    signals, _ = read_signals(path, ROBOT)
    assert np.array_equal(signals.q, Q)
    assert np.array_equal(signals.power, POWER)


def test_a_file_of_a_bag_folder_is_a_bag(tmp_path: Path) -> None:
    write(tmp_path / "run", states(Q, effort=TORQUE))
    signals, _ = read_signals(tmp_path / "run" / "run.db3", ROBOT)
    assert np.array_equal(signals.q, Q)


def test_joints_are_taken_by_name_and_others_passed_over(tmp_path: Path) -> None:
    both = np.column_stack([Q[:, 1], np.zeros(N), Q[:, 0]])
    gripper = states(np.zeros((N, 1)), ["finger"], step=9_000_000)
    path = write(tmp_path / "run.bag", states(both, ["b", "belt", "a"], effort=both), gripper)
    signals, _ = read_signals(path, ROBOT)
    assert np.array_equal(signals.q, Q)
    assert len(signals.time) == N


def test_joints_may_have_the_names_that_ros_takes(tmp_path: Path) -> None:
    odd = parse_urdf(URDF.replace('name="a"', 'name="Achse 1"'))
    path = write(
        tmp_path / "run.mcap",
        states(Q, ["Achse_1", "b"]),
        numbers("/i_Achse_1", POWER),
        numbers("/i_b", POWER),
        numbers("/power", POWER),
    )
    signals, _ = read_signals(path, odd)
    assert np.array_equal(signals.q, Q)
    assert np.array_equal(signals.current[:, 0], POWER)


def test_stamps_of_headers_are_the_time_and_recording_joins_the_topics(tmp_path: Path) -> None:
    stamps = [(7 + row) * 8_000_000 for row in range(N)]  # a simulator's clock
    path = write(tmp_path / "run.bag", states(Q, effort=TORQUE, stamps=stamps), numbers("/power", POWER, bits=32))
    signals, _ = read_signals(path, ROBOT)
    assert signals.time == pytest.approx(np.arange(N) * 0.008, abs=1e-12)
    assert signals.power == pytest.approx(POWER, rel=1e-7)


def test_without_stamps_the_times_of_recording_are_the_time(tmp_path: Path) -> None:
    path = write(tmp_path / "run.bag", states(Q, effort=TORQUE, stamps=[0] * N))
    assert np.array_equal(read_signals(path, ROBOT)[0].time, np.arange(N) / 100)


def test_a_topic_of_another_clock_is_taken_straight_in_between(tmp_path: Path) -> None:
    seldom = numbers("/power", 100.0 + np.arange(12) * 10.0, step=50_000_000, first=-20_000_000)
    path = write(tmp_path / "run.mcap", states(Q, effort=TORQUE), seldom)
    signals, said = read_signals(path, ROBOT)
    assert said == []
    assert signals.power == pytest.approx(100.0 + (signals.time + 0.02) / 0.05 * 10.0)


def test_samples_where_another_topic_is_silent_are_left_out_and_told(tmp_path: Path) -> None:
    late = numbers("/power", POWER[:35], first=100_000_000)
    path = write(tmp_path / "run.bag", states(Q, effort=TORQUE), late)
    signals, said = read_signals(path, ROBOT)
    assert (len(signals.time), signals.time[0]) == (35, pytest.approx(0.1))
    assert said == [f"{path}: 15 joint states left out, at which another topic is silent"]
    many = np.vstack([Q] * 4)
    hole = numbers("/power", np.ones(60)) + numbers("/power", np.ones(60), first=1_400_000_000)
    signals, said = read_signals(write(tmp_path / "hole.bag", states(many, effort=many), hole), ROBOT)
    assert said == [f"{tmp_path / 'hole.bag'}: 80 joint states left out, at which another topic is silent"]
    assert len(signals.time) == 120


def test_torque_that_a_message_lacks_is_no_torque(tmp_path: Path) -> None:
    some = states(Q[:30], effort=TORQUE) + states(Q[30:], step=11_000_000, stamps=list(range(20)))
    path = write(tmp_path / "run.bag", some, numbers("/power", POWER))
    assert "time: does not rise" in refused(path)
    nothing = write(tmp_path / "nan.bag", states(Q, effort=np.full((N, 2), np.nan)), numbers("/power", POWER))
    assert read_signals(nothing, ROBOT)[0].torque is None


DATA_SET = """[robot]
name = "Two"
urdf = "robot.urdf"
[[run]]
file = "runs/one"
payload_mass = 1.5
"""


def test_a_data_set_names_the_folder_of_a_bag_and_its_topics(tmp_path: Path) -> None:
    (tmp_path / "robot.urdf").write_text(URDF)
    (tmp_path / "runs").mkdir()
    toml = tmp_path / "dataset.toml"
    toml.write_text(DATA_SET)
    left, right = states(Q, effort=TORQUE, topic="/left/states"), states(-Q, effort=TORQUE, topic="/right/states")
    path = write(tmp_path / "runs" / "one", left, right, numbers("/watts", POWER), numbers("/power", POWER / 2))
    with pytest.raises(InputError, match=r"/left/states, /right/states; say which in dataset\.toml: \[topics\] joint_"):
        read_data_set(tmp_path)
    toml.write_text(DATA_SET + '[topics]\njoint_states = "/right/states"\npower = "/watts"\n')
    (run,) = read_data_set(tmp_path).runs
    assert run.name == "one"
    assert np.array_equal(run.signals.q, -Q)
    assert np.array_equal(run.signals.power, POWER)
    before = run.sha256
    (path / "note.txt").write_text("another file")
    (run,) = read_data_set(tmp_path).runs
    assert run.sha256 != before


def test_what_is_wrong_in_the_table_of_topics_is_told(tmp_path: Path) -> None:
    (tmp_path / "robot.urdf").write_text(URDF)
    (tmp_path / "runs").mkdir()
    write(tmp_path / "runs" / "one", states(Q, effort=TORQUE), numbers("/power", POWER))
    for line, message in {
        'joint_state = "/a"': r"\[topics\] joint_state is not known; did you mean joint_states",
        "power = 3": r"\[topics\] power should be text, not 3",
        'power = "/watts"': r"/watts of \[topics\] holds no numbers; there are /power",
        'joint_states = "/a"': r"/a of \[topics\] holds no joint states; there are /joint_states",
    }.items():
        (tmp_path / "dataset.toml").write_text(f"{DATA_SET}[topics]\n{line}\n")
        with pytest.raises(InputError, match=message):
            read_data_set(tmp_path)
    (tmp_path / "dataset.toml").write_text("topics = 1\n" + DATA_SET)
    with pytest.raises(InputError, match=r"\[topics\] should be a table"):
        read_data_set(tmp_path)


@pytest.mark.parametrize("form", FORMS)
def test_a_bag_without_joint_states_is_told(form: str, tmp_path: Path) -> None:
    path = write(tmp_path / form, numbers("/power", POWER))
    assert refused(path) == ": holds no joint states (sensor_msgs/JointState); record /joint_states"


@pytest.mark.parametrize(
    ("form", "messages", "said"),
    [
        (
            "run.bag", [states(Q, ["a", "elbow"])],
            ": no message of /joint_states has all joints of two; b is missing (it has a, elbow)",
        ),
        (
            "run.mcap", [states(Q), states(np.zeros((1, 3)), step=1)],
            ", joint state 2: 3 values of position for 2 joints; record the run again",
        ),
        (
            "run.bag", [states(Q), numbers("/a/power", POWER), numbers("/b/power", POWER)],
            ": several topics could be power: /a/power, /b/power; "
            'say which in dataset.toml: [topics] power = "/a/power"',
        ),
    ],
    ids=["a joint is missing", "values do not fit the names", "several topics for a column"],
)  # fmt: skip
def test_messages_that_cannot_be_taken_are_told(form: str, messages: list, said: str, tmp_path: Path) -> None:
    assert refused(write(tmp_path / form, *messages)) == said


def test_a_value_that_is_none_is_told_by_its_message(tmp_path: Path) -> None:
    q = Q.copy()
    q[6, 1] = np.nan
    path = write(tmp_path / "run.bag", states(q, effort=TORQUE))
    assert refused(path).startswith(", joint state 7, column q_b: is not a finite number")
    _, said = read_signals(path, ROBOT, repair=True)
    assert said == [f"{path}: 1 samples dropped, column q_b is not a finite number: joint state 7"]


def test_too_many_values_are_refused_before_they_are_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = write(tmp_path / "run.bag", states(Q, effort=TORQUE))
    monkeypatch.setattr("irtwin.signals.sources.source.MOST_VALUES", 100)
    assert refused(path) == ": 50 samples of 7 columns; a run may have 100 values: cut it into several"
    monkeypatch.undo()
    monkeypatch.setattr(bag_source, "MOST_VALUES", 100)  # of an index that says too little
    assert refused(path) == ": more than 100 values; cut the run into several"


def test_without_rosbags_it_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = write(tmp_path / "run.bag", states(Q))
    monkeypatch.setitem(__import__("sys").modules, "rosbags.rosbag1", None)
    told = r'bags need the package rosbags; install it with: pip install "irtwin\[ros\]"'
    with pytest.raises(InputError, match=told):
        read_signals(path, ROBOT)

"""A log is played as if its robot moved now."""

from __future__ import annotations

import threading
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tests import data_sets, small_robots, synthetic

from irtwin.errors import InputError
from irtwin.live.joint_stream import State
from irtwin.live.replay import Replay

ROBOT = synthetic.with_constants(synthetic.arm(2))


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = small_robots.data_set(tmp_path_factory.mktemp("replay") / "data", "arm")
    return next(folder.rglob("*.parquet"))


def played(replay: Replay, after: float = 0.0, ahead: float = 3600.0) -> list[State]:
    return list(replay.play(threading.Event(), replay.start(after=after, ahead=ahead)))


def test_all_states_come_in_order_with_the_logs_own_pauses(log: Path) -> None:
    replay = Replay(log, ROBOT, "arm", speed=1000.0)
    before = time.time()
    states = played(replay)
    times = np.array([state.time for state in states])
    np.testing.assert_allclose(times - times[0], replay.signals.time - replay.signals.time[0], atol=1e-5)
    assert before <= times[0] <= time.time()
    np.testing.assert_array_equal([state.of("q") for state in states], replay.signals.q)
    np.testing.assert_array_equal([state.of("power")[0] for state in states], replay.signals.power)
    assert {state.robot_id for state in states} == {"arm"}


def test_it_begins_after_what_is_stored(log: Path) -> None:
    later = time.time() + 100
    assert played(Replay(log, ROBOT, "arm", speed=1000.0), after=later)[0].time > later


def test_a_speed_that_runs_too_far_ahead_of_the_clock_is_refused(log: Path) -> None:
    with pytest.raises(InputError, match="at 1000 times its speed the log ends 8 s ahead of the clock: play it slower"):
        played(Replay(log, ROBOT, "arm", speed=1000.0), ahead=5.0)


def test_it_stops_when_told(log: Path) -> None:
    done = threading.Event()
    states = []
    for state in Replay(log, ROBOT, "arm", speed=0.01).play(done, time.time()):
        states.append(state)
        done.set()
    assert len(states) == 1


def test_a_payload_is_that_of_the_data_set(tmp_path: Path) -> None:
    run = synthetic.as_run(synthetic.measure(ROBOT, synthetic.swing(ROBOT, 1, seconds=1.0)))
    run = replace(run, payload_mass=2.5, payload_com=(0.0, 0.1, 0.2))
    folder = data_sets.write(tmp_path / "d", ROBOT, [run])
    (file,) = folder.rglob("*.parquet")
    state = played(Replay(file, ROBOT, "arm", speed=1000.0))[0]
    assert (state.payload, state.payload_com) == (2.5, (0.0, 0.1, 0.2))


def test_a_log_of_another_robot_is_refused(log: Path) -> None:
    with pytest.raises(InputError):
        Replay(log, synthetic.arm(3), "arm")

"""Who looks on gets each sample; who reads too slowly is let go, and watching waits for nobody."""

from __future__ import annotations

import json
import math
import socket
import time
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from tests.waiting import wait_for

from irtwin.live import broadcast
from irtwin.live.broadcast import SOCKET, Broadcast, reachable
from irtwin.live.joint_stream import State, state_of

NOTHING: dict[str, list[float]] = {"time": [], "power": []}


def state(at: float, power: float = 400.0, robot: str = "r") -> State:
    measured = {} if math.isnan(power) else {"power": (power,)}
    return state_of(robot, 2, at, {"q": (0.5, -0.25), **measured}, where="a test")


def asked(folder: Path, robot: bytes) -> socket.socket:
    client = socket.socket(socket.AF_UNIX)
    client.settimeout(30)
    with reachable(folder / SOCKET) as address:
        client.connect(address)
    if robot:
        client.sendall(robot)
    return client


def connect(folder: Path, to: Broadcast) -> socket.socket:
    client = asked(folder, b"r\n")
    wait_for(lambda: any(one.begun for one in to._clients))
    return client


@pytest.mark.parametrize("folder", ["live", "/".join(["a-folder-with-a-long-name"] * 6)])
def test_states_and_what_the_twin_says_arrive_as_lines(tmp_path: Path, folder: str) -> None:
    place = tmp_path / folder
    with Broadcast(place) as told:
        told.state(state(1.0))  # nobody looks on
        with connect(place, told) as client, client.makefile() as lines:
            told.state(state(2.0, robot="another"))
            told.state(state(2.0))
            told.state(state(3.0, math.nan))
            motion = SimpleNamespace(time=np.array([1.0, 2.0, 3.0]))
            told.stretches("r", [SimpleNamespace(motion=motion, power=np.array([5.0, 6.0, 7.0]), begins=False)])
            assert json.loads(lines.readline())["newest"]["time"] == 1.0
            assert json.loads(lines.readline()) == {"robot": "r", "time": 2.0, "q": [0.5, -0.25], "power": 400.0}
            assert json.loads(lines.readline())["power"] is None
            assert json.loads(lines.readline()) == {"robot": "r", "modelled": {"time": [2.0, 3.0], "power": [6.0, 7.0]}}
    assert not list(place.iterdir())


def test_one_that_does_not_read_is_let_go(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(broadcast, "_BUFFER", 4096)
    with Broadcast(tmp_path) as told, connect(tmp_path, told):
        began = time.monotonic()
        while told._clients:
            told.state(state(time.monotonic()))
            assert time.monotonic() - began < 30


def test_more_than_a_few_are_turned_away(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(broadcast, "_MOST", 1)
    with Broadcast(tmp_path) as told, connect(tmp_path, told), asked(tmp_path, b"") as second:
        assert second.recv(1) == b""


def test_a_socket_that_a_crash_left_is_taken_over(tmp_path: Path) -> None:
    left = socket.socket(socket.AF_UNIX)
    left.bind(str(tmp_path / SOCKET))
    left.close()
    with Broadcast(tmp_path) as told, connect(tmp_path, told) as client:
        told.state(state(1.0))
        assert client.recv(1) == b"{"


def answer(folder: Path, question: bytes) -> bytes:
    with asked(folder, question) as client, client.makefile("rb") as lines:
        return lines.readline()


def test_who_asks_later_gets_the_last_minutes_though_nobody_looked_on(tmp_path: Path) -> None:
    motion = SimpleNamespace(time=np.array([1.0, 2.0, 3.0]))
    with Broadcast(tmp_path) as told:
        for at, power in enumerate([400.0, math.nan, 402.5]):
            told.state(state(float(at), power))
            told.state(state(float(at), robot="another"))
        told.stretches("r", [SimpleNamespace(motion=motion, power=np.array([5.0, 6.0, 7.0]), begins=True)])
        assert json.loads(answer(tmp_path, b"r\n")) == {
            "robot": "r",
            "recent": {
                "measured": {"time": [0.0, 2.0], "power": [400.0, 402.5]},
                "modelled": {"time": [1.0, 2.0, 3.0], "power": [5.0, 6.0, 7.0]},
            },
            "newest": {"robot": "r", "time": 2.0, "q": [0.5, -0.25], "power": 402.5},
        }


def test_what_is_no_question_stops_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(broadcast, "_ASKING", 0.05)
    with Broadcast(tmp_path):
        assert answer(tmp_path, b"") == b""
        assert answer(tmp_path, b"\xff\n") == b""
        said = json.loads(answer(tmp_path, b"nobody\n"))
        assert said == {"robot": "nobody", "recent": {"measured": NOTHING, "modelled": NOTHING}, "newest": None}


def test_what_comes_while_the_last_minutes_are_on_their_way_follows_them(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    last_minutes = Broadcast._last_minutes

    def slowly(told: Broadcast, robot: str) -> bytes:
        line = last_minutes(told, robot)
        told.state(state(2.0))
        time.sleep(0.1)
        return line

    monkeypatch.setattr(Broadcast, "_last_minutes", slowly)
    with Broadcast(tmp_path) as told:
        told.state(state(1.0))
        with connect(tmp_path, told) as client, client.makefile() as lines:
            told.state(state(3.0))
            assert json.loads(lines.readline())["newest"]["time"] == 1.0
            assert [json.loads(lines.readline())["time"] for _ in range(2)] == [2.0, 3.0]

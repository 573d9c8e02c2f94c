"""RTDE: what a client makes of what a controller says, and of one that breaks off, is silent or sends nonsense."""

from __future__ import annotations

import math
import socket
import struct
import threading
import time
from dataclasses import replace

import pytest
from tests.dripping import dripping
from tests.live.controller import Controller, package, serving
from tests.synthetic import arm

from irtwin.errors import InputError
from irtwin.live import rtde
from irtwin.live.joint_stream import State
from irtwin.live.rtde import Rtde
from irtwin.robot.description import Robot

CONSTANTS = [10.0, 9.0, 8.0, 4.0, 3.0, 2.0]


def robot(*, constants: bool = True) -> Robot:
    made = arm(6)
    joints = zip(made.joints, CONSTANTS, strict=True)
    return replace(made, joints=tuple(replace(one, torque_constant=k if constants else None) for one, k in joints))


class Follower:
    """Takes states until there are enough of them."""

    def __init__(self, count: int) -> None:
        self.states: list[State] = []
        self.refused: list[str] = []
        self.said: list[str] = []
        self.done = threading.Event()
        self._count = count

    def follow(self, client: Rtde) -> None:
        ends = threading.Timer(20.0, self.done.set)
        ends.start()
        for state in client.states(self.done, self.said.append):
            if isinstance(state, InputError):
                self.refused.append(str(state))
            else:
                self.states.append(state)
            if len(self.states) >= self._count:
                self.done.set()
        ends.cancel()
        assert len(self.states) >= self._count, self.said


def followed(controller: Controller, count: int, *, constants: bool = True) -> tuple[Follower, Rtde]:
    follower = Follower(count)
    with serving(controller) as port:
        client = Rtde(f"127.0.0.1:{port}", robot(constants=constants), "arm")
        follower.follow(client)
    return follower, client


def test_states_are_what_the_controller_says() -> None:
    controller = Controller()
    before = time.time()
    follower, client = followed(controller, 40)
    assert (follower.refused, follower.said) == ([], [])
    first = follower.states[0]
    assert before - 1.0 < first.time < time.time() + 1.0
    for row, state in enumerate(follower.states):
        assert state.robot_id == "arm"
        assert state.time - first.time == pytest.approx(row * 0.008, abs=1e-6)
        assert list(state.of("q")) == controller.value("actual_q", row)
        assert list(state.of("dq")) == controller.value("actual_qd", row)
        assert state.of("torque") == pytest.approx([(0.5 * joint - 0.2) * CONSTANTS[joint] for joint in range(6)])
        assert list(state.of("temperature")) == controller.value("joint_temperatures", row)
        assert state.of("power") == pytest.approx([48.0 * controller.value("actual_robot_current", row)[0]])
        assert state.payload == 1.5
    assert client.what == (
        "positions, speeds, torques (current times torque constant), temperatures, "
        "power (robot voltage times robot current)"
    )


def test_what_the_controller_lacks_is_not_asked_for_again_and_told() -> None:
    lacking = ("actual_robot_current", "joint_temperatures", "payload")
    controller = Controller(lacking=lacking)
    follower, client = followed(controller, 5)
    assert len(controller.asked) == 2
    assert not set(lacking) & set(controller.asked[1])
    state = follower.states[0]
    assert math.isnan(state.of("power")[0])
    assert all(map(math.isnan, state.of("temperature")))
    assert state.payload is None
    assert client.what.endswith("torque constant); no power: the controller does not offer it")


def test_without_torque_constants_torque_is_not_said_and_why() -> None:
    follower, client = followed(Controller(), 3, constants=False)
    assert all(map(math.isnan, follower.states[0].of("torque")))
    assert client.what.endswith("; no torques: give torque_constant of each joint")


def test_a_connection_that_breaks_is_made_again_and_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("irtwin.live.controller.AGAIN", 0.05)
    follower, client = followed(Controller(breaks=10), 25)
    assert follower.said[:2] == [
        f"{client.address}: the connection is lost (it closed the connection); trying again",
        f"{client.address}: connected again",
    ]
    times = [state.time for state in follower.states]
    assert len(times) == 25


def test_a_controller_that_falls_silent_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("irtwin.live.controller.AGAIN", 0.05)
    monkeypatch.setattr(rtde, "_PATIENCE", 0.3)
    follower, _ = followed(Controller(quiet=10), 15)
    assert "the connection is lost (no whole package within 0.3 s); trying again" in follower.said[0]


@pytest.mark.parametrize(
    ("sent", "reason"),
    [
        (
            b"GET / HTTP/1.1\r\n" * 2000,
            "no RTDE|a data package is not what was asked for|no whole package",
        ),
        (struct.pack(">HB", 1, 85), "what it sends is no RTDE"),
        (package("U", b"\x07" + bytes(8)), "a data package is not what was asked for"),
        (package("U", b"\x08" + bytes(8 * 28)), "a data package is not what was asked for"),
    ],
)
def test_nonsense_breaks_off_and_is_told(sent: bytes, reason: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("irtwin.live.controller.AGAIN", 0.05)
    monkeypatch.setattr(rtde, "_PATIENCE", 0.5)
    follower, _ = followed(Controller(spoilt={5: sent}), 12)
    assert len(follower.said) >= 2
    assert any(part in follower.said[0] for part in reason.split("|")), follower.said


def test_packages_of_other_kinds_are_passed_over() -> None:
    follower, _ = followed(Controller(spoilt={2: package("M", b"\x02hi\x00\x01"), 3: package("?", b"")}), 10)
    assert (follower.refused, follower.said) == ([], [])


@pytest.mark.parametrize("value", [math.nan, math.inf, 1e9])
def test_a_value_that_is_none_is_refused_and_the_rest_goes_on(value: float) -> None:
    wrong = package("U", b"\x07" + struct.pack(">28d", 1000.04, value, *[0.0] * 26))
    controller = Controller(spoilt={5: wrong})
    follower, client = followed(controller, 10)
    assert follower.refused == [f"{client.address}: position is not a number within 10000"]
    assert follower.said == []


def test_a_port_where_nobody_answers_is_told() -> None:
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    with pytest.raises(InputError, match=f"127.0.0.1:{port}: no controller answers by RTDE .*check address and port"):
        Rtde(f"127.0.0.1:{port}", robot(), "arm")


@pytest.mark.parametrize(
    ("controller", "reason"),
    [
        (Controller(version=1), "it does not speak version 2 of RTDE"),
        (Controller(lacking=("actual_q",)), "it has no actual_q"),
    ],
)
def test_a_controller_that_will_not_do_is_told(controller: Controller, reason: str) -> None:
    with serving(controller) as port, pytest.raises(InputError, match=rf"no controller answers by RTDE \({reason}\)"):
        Rtde(f"127.0.0.1:{port}", robot(), "arm")


def test_another_arm_is_refused_before_it_connects() -> None:
    with pytest.raises(InputError, match="has 2 moving joints; an arm of Universal Robots has 6"):
        Rtde("127.0.0.1:1", arm(2), "arm")


@pytest.mark.parametrize("address", ["", ":30004", "host:", "host:abc", "host:0", "host:70000", "host:²"])
def test_an_address_that_is_none_is_told(address: str) -> None:
    with pytest.raises(InputError, match="give HOST or HOST:PORT"):
        Rtde(address, robot(), "arm")


@pytest.mark.parametrize("timestamp", [math.nan, math.inf, -math.inf, -1e300, 1e300])
@pytest.mark.parametrize("sample", [0, 5])
def test_a_timestamp_that_is_none_is_refused_and_the_rest_goes_on(timestamp: float, sample: int) -> None:
    follower, client = followed(Controller(times={sample: timestamp}), 10)
    assert follower.refused
    assert set(follower.refused) == {f"{client.address}: timestamp is not a time in s since 1970"}
    assert all(math.isfinite(state.time) for state in follower.states)


def test_a_package_that_comes_byte_by_byte_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(rtde, "_PATIENCE", 0.6)
    with (
        dripping(b"V", every=0.2) as port,
        pytest.raises(InputError, match=r"no controller answers by RTDE \(no whole package within 0.6 s\)"),
    ):
        Rtde(f"127.0.0.1:{port}", robot(), "arm")


def test_who_follows_a_silent_controller_can_stop(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(rtde, "_PATIENCE", 60.0)
    with serving(Controller(quiet=5)) as port:
        client, done = Rtde(f"127.0.0.1:{port}", robot(), "arm"), threading.Event()
        following = threading.Thread(target=lambda: list(client.states(done, print)))
        following.start()
        done.set()
        following.join(10)
        assert not following.is_alive()

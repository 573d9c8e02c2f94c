"""Lines of a stream: what they say, and what is refused."""

from __future__ import annotations

import io
import json
import math
import socket
import threading
from contextlib import suppress
from typing import Any

import pytest

from irtwin.errors import InputError
from irtwin.live.joint_stream import LONGEST_LINE, State, StateReader, feed, lines_of, listening

READER = StateReader({"R": ["a1", "a2"]})
GOOD: dict[str, Any] = {"robot": "R", "time": 5.5, "position": [0.1, 0.2]}


def line(**changes: Any) -> bytes:
    return json.dumps({key: value for key, value in {**GOOD, **changes}.items() if value is not ...}).encode()


def test_a_full_line() -> None:
    said = line(velocity=[1, 2], effort=[3, 4], temperature=[5, 6], power=7, payload=2.5)
    assert READER.read(said) == State("R", 5.5, ((0.1, 0.2), (1.0, 2.0), (3.0, 4.0), (5.0, 6.0), (7.0,)), 2.5)


@pytest.mark.parametrize("said", ["Prüfstand 3", "Pru\u0308fstand 3", "Pr_fstand_3~1"])
def test_a_robot_is_said_by_its_name_or_its_identifier(said: str) -> None:
    reader = StateReader({"Pr_fstand_3~1": ["a1", "a2"], "R": ["a1", "a2"]}, {"Pr_fstand_3~1": "Prüfstand 3", "R": "R"})
    assert reader.read(line(robot=said)).robot_id == "Pr_fstand_3~1"
    with pytest.raises(InputError, match=r"no robot 'Prufstand 3' in the workspace.*known are Prüfstand 3, R$"):
        reader.read(line(robot="Prufstand 3"))
    with pytest.raises(InputError, match="`name` must list the joints of Prüfstand 3: a1, a2"):
        reader.read(line(robot=said, name=["a1"]))


def test_what_is_not_said_is_nan() -> None:
    state = READER.read(line())
    assert all(map(math.isnan, [*state.of("dq"), *state.of("torque"), *state.of("temperature"), *state.of("power")]))
    assert (state.payload, state.performs) == (None, None)


def test_values_follow_the_names() -> None:
    state = READER.read(line(name=["a2", "a1"], velocity=[2, 1]))
    assert (state.of("q"), state.of("dq")) == ((0.2, 0.1), (1.0, 2.0))


@pytest.mark.parametrize(
    ("said", "message"),
    [
        (b"{", "not JSON"),
        (line(performs=7), "`performs` is not the name of a planned run"),
        (b"POST /robot HTTP/1.1\r\n", "an HTTP request, which a web page may have sent"),
        (b"\xff\xfe", "not JSON"),
        (b"[" * 60_000, "not JSON"),
        (b"[1]", "not a JSON object"),
        (b" " * (LONGEST_LINE + 1), "longer than"),
        (line(robot="S"), "no robot 'S' in the workspace.*known are R"),
        (line(robot=["R"]), "no robot"),
        (line(time=...), "`time` is not a number"),
        (line(time="5"), "`time` is not a number"),
        (line(time=-1), "since 1970"),
        (line(time=1e18), "since 1970"),
        (line(position=...), "`position` is missing"),
        (line(position=[1]), "2 numbers"),
        (line(position=[1, None]), "2 numbers"),
        (line(position=[1, True]), "2 numbers"),
        (line(position=[1, 10**400]), "2 numbers"),
        (b'{"robot": "R", "time": NaN, "position": [1, 2]}', "`time` is not a number"),
        (b'{"robot": "R", "time": 1, "position": [1, Infinity]}', "2 numbers"),
        (line(velocity=5), "`velocity` must have"),
        (line(name=["a1"]), "`name` must list the joints of R: a1, a2"),
        (line(name=[["a1"], "a2"]), "`name` must list"),
        (line(power="x"), "`power` is not a number"),
    ],
)
def test_what_is_no_state_is_refused(said: bytes, message: str) -> None:
    with pytest.raises(InputError, match=message):
        READER.read(said)


def test_a_bad_line_stops_nothing() -> None:
    taken: list[State] = []
    refused: list[str] = []
    stream = io.BytesIO(line(time=1) + b"\n\nnonsense\n" + b"x" * (3 * LONGEST_LINE) + b"\n" + line(time=2))
    feed(READER.states(lines_of(stream)), taken.append, lambda error: refused.append(str(error)))
    assert [state.time for state in taken] == [1.0, 2.0]
    assert refused == ["a line is not JSON", f"a line is longer than {LONGEST_LINE} bytes"]


def test_clients_on_a_port() -> None:
    taken: list[State] = []
    done = threading.Semaphore(0)

    def handle(lines) -> None:
        feed(READER.states(lines), taken.append, lambda reason: None)
        done.release()

    with listening(0, handle) as port:
        for number in range(3):
            with socket.create_connection(("127.0.0.1", port)) as client:
                client.sendall(b"".join(line(time=10 * number + step) + b"\n" for step in range(5)))
        for _ in range(3):
            assert done.acquire(timeout=10)
        with pytest.raises(InputError, match=f"cannot listen on port {port}"), listening(port, handle):
            pass
    assert len(taken) == 15


def test_an_http_request_ends_its_connection_before_its_body_is_read() -> None:
    taken: list[State] = []
    refused: list[str] = []
    body = line() + b"\n" + line(time=6.5) + b"\n"
    head = f"POST / HTTP/1.1\r\nOrigin: http://evil.example\r\nContent-Length: {len(body)}\r\n\r\n".encode()
    with listening(
        0, lambda lines: feed(READER.states(lines), taken.append, lambda error: refused.append(str(error)))
    ) as port:
        with socket.create_connection(("127.0.0.1", port)) as browser:
            browser.sendall(head + body)
            with suppress(ConnectionResetError):
                assert browser.recv(1) == b""
        with socket.create_connection(("127.0.0.1", port)) as robot:
            robot.sendall(line(time=7.5) + b"\n")
            robot.shutdown(socket.SHUT_WR)
            assert robot.recv(1) == b""
    assert [state.time for state in taken] == [7.5]
    assert len(refused) == 1 and "HTTP request" in refused[0]

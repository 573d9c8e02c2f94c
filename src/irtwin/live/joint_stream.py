"""States of joints as they are streamed: one JSON object a line, fields as in ROS' sensor_msgs/JointState.

{"robot": "KUKA_KR6_R700", "time": 1764583200.012, "position": [...], "velocity": [...], "effort": [...],
 "temperature": [...], "power": 512.0}

`robot` is its name, or its identifier; `time` in s since 1970 UTC; rad, rad/s, N m, degC, W; positions are a must,
the rest is not. Values are in the order of the robot's joints, base to flange, or in that of `name`. `payload`, kg,
`payload_com`, [x, y, z] m in the frame of the flange, and `performs`, the name of the planned run that is carried out,
count where a run begins. The keys of values are those of the table of channels.
"""

from __future__ import annotations

import math
import re
import socketserver
import threading
import unicodedata
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, BinaryIO, TypeGuard, cast

from irtwin.errors import InputError
from irtwin.json_text import parse_json
from irtwin.signals.channels import CHANNELS, REQUIRED, Channel

LONGEST_LINE = 1 << 16  # bytes
_HTTP = re.compile(rb"[A-Z]+ \S+ HTTP/\d")  # its first line
STREAMED = {field: channel for field, channel in CHANNELS.items() if channel.streamed is not None}
_PLACES = {field: place for place, field in enumerate(STREAMED)}
# of magnitude; neither NaN nor infinite, nor an integer beyond a float
_GREATEST = {str(channel.streamed): channel.greatest for channel in STREAMED.values()} | {"payload": 1e6, "time": 1e300}
_LATEST = 253402300799.0  # s: the end of the year 9999


def checked_time(time: float, name: str) -> float:
    """Return a time, s. Raises InputError, with its name, where it is none since 1970."""
    if not 0.0 <= time <= _LATEST:  # nor NaN
        raise InputError(f"{name} is not a time in s since 1970")
    return time


@dataclass(frozen=True, slots=True)
class State:
    """A robot at one moment: `time` in s since 1970; `values` of each streamed channel, in the order of `STREAMED`.

    A channel has a value for each joint, or one; NaN for what was not said. payload kg and its centre of mass,
    m in the frame of the flange; `performs` the name of the plan that it carries out; None where it was not said.
    """

    robot_id: str
    time: float
    values: tuple[tuple[float, ...], ...]
    payload: float | None = None
    payload_com: tuple[float, float, float] | None = None
    performs: str | None = None

    def of(self, field: str) -> tuple[float, ...]:
        """Return the values of a channel, by its field of `Signals`."""
        return self.values[_PLACES[field]]


def state_of(robot_id: str, joints: int, time: float, values: Mapping[str, tuple[float, ...]], *, where: str) -> State:
    """Return the state of a controller at `where`: values by channel's field, NaN for channels that it lacks.

    Raises InputError where a value, or the time, s since 1970, is none of a robot.
    """
    for field, numbers in values.items():
        greatest = STREAMED[field].greatest
        if not all(-greatest <= number <= greatest for number in numbers):  # nor NaN
            raise InputError(f"{where}: {STREAMED[field].label} is not a number within {greatest:g}")
    absent = {field: (math.nan,) * (joints if channel.per_joint else 1) for field, channel in STREAMED.items()}
    filled = tuple((absent | dict(values)).values())
    return State(robot_id, checked_time(time, f"{where}: timestamp"), filled)


class StateReader:
    """Reads lines for robots that are known: their joints' names, base to flange, and their own, by robot_id.

    A line says a robot by its name, in any form of Unicode, or by its robot_id.
    """

    def __init__(self, joints: Mapping[str, Sequence[str]], names: Mapping[str, str] | None = None) -> None:
        self._names = {robot: robot for robot in joints} | dict(names or {})
        self._ids = {_nfc(name): robot for robot, name in self._names.items()}
        self._ids |= {robot: robot for robot in joints if robot not in self._ids}
        self._joints = {robot: tuple(names) for robot, names in joints.items()}
        self._orders: dict[tuple[str, tuple[str, ...]], tuple[int, ...]] = {}

    def states(self, lines: Iterable[bytes]) -> Iterator[State | InputError]:
        """Yield the state of each line that is not empty, or the error of one that says none."""
        for line in lines:
            if line.strip():
                try:
                    yield self.read(line)
                except InputError as error:
                    yield error

    def read(self, line: bytes) -> State:
        """Return the state that a line says. Raises InputError where it says none."""
        if len(line) > LONGEST_LINE:
            raise InputError(f"a line is longer than {LONGEST_LINE} bytes")
        try:
            message = parse_json(line)
        except ValueError:
            if _HTTP.match(line):
                raise InputError("an HTTP request, which a web page may have sent; its connection is closed") from None
            raise InputError("a line is not JSON") from None
        if not isinstance(message, dict):
            raise InputError("a line is not a JSON object")
        name = message.get("robot")
        robot = self._ids.get(_nfc(name)) if isinstance(name, str) else None
        if robot is None:
            raise InputError(
                f"no robot {str(name)[:100]!r} in the workspace: run its data set first; known are {self._known}"
            )
        order = self._order(robot, message.get("name"))
        time = checked_time(_number(message, "time"), "`time`")
        for field in REQUIRED:
            if field in STREAMED and STREAMED[field].streamed not in message:
                raise InputError(f"`{STREAMED[field].streamed}` is missing")
        payload = _number(message, "payload") if "payload" in message else None
        values = tuple([_values(message, channel, order) for channel in STREAMED.values()])
        performs = message.get("performs")
        if performs is not None and not isinstance(performs, str):
            raise InputError("`performs` is not the name of a planned run")
        return State(robot, time, values, payload, _centre(message) if "payload_com" in message else None, performs)

    @property
    def _known(self) -> str:
        return ", ".join(sorted(self._names.values())[:10]) or "none"

    def _order(self, robot: str, names: Any) -> tuple[int, ...]:
        """Return the place in a message of each joint, (n,)."""
        joints = self._joints[robot]
        if names is None:
            return tuple(range(len(joints)))
        if not isinstance(names, list) or sorted(map(str, names)) != sorted(joints):
            raise InputError(f"`name` must list the joints of {self._names[robot]}: {', '.join(joints)}")
        key = (robot, tuple(names))
        if key not in self._orders:
            self._orders[key] = tuple(names.index(joint) for joint in joints)
        return self._orders[key]


def feed(
    states: Iterable[State | InputError], take: Callable[[State], None], refuse: Callable[[InputError], None]
) -> None:
    """Give each state on; what is none, or is not taken, is refused by its error and stops nothing."""
    for state in states:
        try:
            if isinstance(state, InputError):
                raise state
            take(state)
        except InputError as error:
            refuse(error)


def lines_of(stream: BinaryIO) -> Iterator[bytes]:
    """Yield a stream's lines, of one that is too long its beginning: memory stays bounded."""
    while line := stream.readline(LONGEST_LINE + 1):
        rest = line
        while len(rest) > LONGEST_LINE and not rest.endswith(b"\n"):
            rest = stream.readline(LONGEST_LINE + 1)
        yield line


def _till_http(lines: Iterable[bytes]) -> Iterator[bytes]:
    """Yield lines till one begins an HTTP request: any web page can have a browser send those, samples and all."""
    for line in lines:
        yield line
        if _HTTP.match(line):
            return


@contextmanager
def listening(port: int, handle: Callable[[Iterator[bytes]], None]) -> Iterator[int]:
    """Listen on this machine's own address, where `handle` gets the lines of each client; give the port.

    An HTTP request ends the connection with its first line.
    """

    class Handler(socketserver.StreamRequestHandler):
        def handle(self) -> None:
            handle(_till_http(lines_of(cast(BinaryIO, self.rfile))))

    class Server(socketserver.ThreadingTCPServer):
        allow_reuse_address = True
        daemon_threads = True

    try:
        server = Server(("127.0.0.1", port), Handler)
    except OSError as error:
        raise InputError(f"cannot listen on port {port}: {error.strerror}") from None
    with server:
        threading.Thread(target=server.serve_forever, args=(0.1,), daemon=True).start()
        try:
            yield int(server.server_address[1])
        finally:
            server.shutdown()


def _nfc(name: str) -> str:
    return unicodedata.normalize("NFC", name)


def _number(message: Mapping[str, Any], name: str) -> float:
    value = message.get(name)
    if not _is_number(value, _GREATEST[name]):
        raise InputError(f"`{name}` is not a number within {_GREATEST[name]:g}")
    return float(value)


def _numbers(message: Mapping[str, Any], name: str, count: int, most: float, meaning: str) -> list[int | float]:
    values = message[name]
    if not isinstance(values, list) or len(values) != count or not all(_is_number(number, most) for number in values):
        raise InputError(f"`{name}` must have {count} numbers within {most:g}{meaning}")
    return values


def _centre(message: Mapping[str, Any]) -> tuple[float, float, float]:
    x, y, z = map(float, _numbers(message, "payload_com", 3, 100.0, ": m in the frame of the flange"))
    return x, y, z


def _is_number(value: Any, most: float) -> TypeGuard[int | float]:
    return isinstance(value, int | float) and not isinstance(value, bool) and -most <= value <= most


def _values(message: Mapping[str, Any], channel: Channel, order: Sequence[int]) -> tuple[float, ...]:
    name = str(channel.streamed)
    if name not in message:
        return (math.nan,) * (len(order) if channel.per_joint else 1)
    if not channel.per_joint:
        return (_number(message, name),)
    values = _numbers(message, name, len(order), _GREATEST[name], ", one for each joint")
    return tuple([float(values[place]) for place in order])
